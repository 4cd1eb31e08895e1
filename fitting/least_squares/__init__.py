"""The search for the best values, how well they are known, and the error on held-out runs."""
