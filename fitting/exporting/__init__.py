"""A fitted muscle for others: plain numpy, or a table."""
