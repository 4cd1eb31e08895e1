"""Many data sets, each fitted or diagnosed on its own, here or on a cluster."""
