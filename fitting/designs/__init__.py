"""Design files: what is wanted of a muscle, one design, and sweeps of millions."""
