"""Muscles for a purpose: what one is worth, which is best, what tolerances cost, and designs in batches."""
