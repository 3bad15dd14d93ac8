"""Many pictures: jobs in a file, drawn by processes of this machine or of a Dask cluster."""

from glshadow.batch.job import Job, read_jobs
from glshadow.batch.run import Done, Failed, run_batch

__all__ = ["Done", "Failed", "Job", "read_jobs", "run_batch"]
