"""A fitted muscle for other programs: plain numpy, or a table."""
