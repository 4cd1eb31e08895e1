"""Many data sets, each fitted or diagnosed on its own: which they are, the work on one, the folder of results."""
