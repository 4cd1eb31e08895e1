"""What the next recording should be: candidates, what each explanation foretells of them, how far apart."""
