"""Quick releases read by Hill's law."""
