"""Programs that jax traced and compiled, kept on disk so that the next process finds them."""
