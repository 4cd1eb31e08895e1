"""What the data leave open: noise, density, samplers, chains on disk, predictions."""
