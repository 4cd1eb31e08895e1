"""A test of the diagnosis on a user's own protocol: effects are hidden in it, one by one, and looked for."""
