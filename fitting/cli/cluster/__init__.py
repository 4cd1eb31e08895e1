"""Work shared with a running Dask scheduler."""
