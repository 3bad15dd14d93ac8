"""The same jobs on the workers of a Dask cluster."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from glshadow.batch.draw import Drawer, Drawn
from glshadow.batch.job import Job
from glshadow.batch.run import outcome
from glshadow.errors import GlshadowError, ResourceError, SettingsError

ANSWERS_S = 10.0  # seconds in which a scheduler does
_RETRIES = 3  # of a job whose worker went

_drawers: dict[str, Drawer] = {}  # of this process: a worker keeps its context from job to job


def on_cluster(jobs: Sequence[Job], folder: Path, address: str, backend: Any) -> Iterator[tuple[Job, Drawn | str]]:
    """Results as they come. A worker that goes takes nothing with it: its jobs go to others, and files are put in place whole.

    Raises
    ------
    SettingsError
        Without dask.distributed, or where no scheduler answers.
    ResourceError
        If a worker has no OpenGL: names it.
    """
    try:
        import distributed
    except ImportError as error:
        raise SettingsError(
            f"--dask needs distributed ({error}); install it with: pip install 'glshadow[dask]'"
        ) from error
    library: Any = distributed
    try:
        client = library.Client(address, timeout=ANSWERS_S, set_as_default=False)
    except (OSError, ValueError, TimeoutError) as error:
        raise SettingsError(f"no Dask scheduler answers at {address}: {error}") from None
    with client:
        blind = {name: why for name, why in client.run(_sees, str(backend)).items() if why}
        if blind:
            raise ResourceError("; ".join(f"worker {name} has no OpenGL: {why}" for name, why in sorted(blind.items())))
        futures = {
            client.submit(
                _drawn, job, folder.resolve(), str(backend), key=f"glshadow-{job.key}", retries=_RETRIES, pure=False
            ): job
            for job in jobs
        }
        for future in library.as_completed(futures, loop=client.loop):
            job = futures[future]
            fault = future.exception() if future.status == "error" else None
            yield job, future.result() if fault is None else f"{type(fault).__name__}: {fault}"
            future.release()


def _drawn(job: Job, folder: Path, backend: str) -> Drawn | str:
    return outcome(_drawer(backend), job, folder)


def _sees(backend: str) -> str:
    """Empty, or why this worker cannot draw."""
    try:
        _drawer(backend)
    except GlshadowError as error:
        return " ".join(str(error).split())
    return ""


def _drawer(backend: str) -> Drawer:
    """One for each thread: a context is current on one at a time."""
    import threading

    key = f"{backend} {threading.get_ident()}"
    if key not in _drawers:
        _drawers[key] = Drawer(backend)
    return _drawers[key]
