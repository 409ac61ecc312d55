"""One job on many files, by several processes of this machine or of a Dask cluster."""
