"""Who runs the trials: processes of this machine, or of a Dask cluster."""
