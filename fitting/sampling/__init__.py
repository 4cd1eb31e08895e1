"""What a posterior is made of: priors, noise, the density, moves, chains on disk, predictions."""
