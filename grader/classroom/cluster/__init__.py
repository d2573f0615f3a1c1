"""A class graded by the workers of a Dask cluster: what is sent, what is done there, and what comes back."""
