"""A task, which is data, a model and what may vary; and what is done with it: add, drop, discover, simulate."""
