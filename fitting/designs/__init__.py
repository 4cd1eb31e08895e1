"""Designs and sweeps: what is wanted, where it is computed, what is said of it."""
