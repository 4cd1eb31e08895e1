"""Where a model fails: errors by state, the noise of repeated loops, and the fingerprint of a misfit."""
