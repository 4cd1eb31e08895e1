"""What a diagnosis is made of: the search over sets of effects, the test by flips, its limits, its words."""
