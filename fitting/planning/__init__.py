"""Which recording to make next: candidates, what each explanation predicts for them, and how far apart."""
