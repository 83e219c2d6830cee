"""Workers that run trials: processes of this machine or of a Dask cluster."""
