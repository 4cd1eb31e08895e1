"""Which effect is missing: the search over sets of effects, the sign-flip test, its limits, the verdict."""
