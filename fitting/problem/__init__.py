"""What a fit minimises: unknowns, their priors, and one whitened row for each reading."""
