"""Many images: jobs from a file, drawn by processes on this machine or on a Dask cluster."""

from glshadow.batch.job import Job, read_jobs
from glshadow.batch.run import Done, Failed, run_batch

__all__ = ["Done", "Failed", "Job", "read_jobs", "run_batch"]
