"""Runs jobs on the workers of a Dask cluster."""

from __future__ import annotations

import time
import uuid
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from glshadow.batch.draw import Drawer, Drawn
from glshadow.batch.job import Job
from glshadow.batch.run import outcome
from glshadow.errors import GlshadowError, ResourceError, SettingsError, warn

ANSWERS_S = 10.0  # seconds to wait for a scheduler
_POLL_S = 0.02
_RETRIES = 3  # of a job whose worker was lost

_drawers: dict[str, Drawer] = {}  # per process: a worker keeps its context from job to job


def on_cluster(jobs: Sequence[Job], folder: Path, address: str, backend: Any) -> Iterator[tuple[Job, Drawn | str]]:
    """Results as they finish. If a worker is lost, its jobs go to other workers; files are written atomically.

    If there is no worker, a warning is issued after ANSWERS_S, and the jobs wait for one.

    Raises
    ------
    SettingsError
        Without dask.distributed, or if no scheduler answers.
    ResourceError
        If a worker has no OpenGL; the message names the worker.
    """
    try:
        import distributed
    except ImportError as error:
        raise SettingsError(
            f"--dask needs distributed ({error}); install it with: pip install 'glshadow[dask]'"
        ) from error
    library: Any = distributed
    batch = uuid.uuid4().hex
    try:
        client = library.Client(address, timeout=ANSWERS_S, set_as_default=False)
    except (OSError, ValueError, TimeoutError) as error:
        raise SettingsError(f"no Dask scheduler answers at {address}: {error}") from None
    with client:
        _await_worker(library, client, address)
        blind = {name: why for name, why in client.run(_sees, str(backend)).items() if why}
        if blind:
            raise ResourceError("; ".join(f"worker {name} has no OpenGL: {why}" for name, why in sorted(blind.items())))
        futures = {
            client.submit(
                _drawn, job, folder.resolve(), str(backend), batch,
                key=f"glshadow-{batch}-{number}", retries=_RETRIES, pure=False,
            ): job
            for number, job in enumerate(jobs)
        }  # fmt: skip
        completed = library.as_completed(futures, loop=client.loop)
        while not completed.is_empty():
            _await_result(completed, client, address)
            future = next(completed)
            job = futures[future]
            fault = future.exception() if future.status == "error" else None
            yield (
                job,
                _result(future, library, client, address) if fault is None else f"{type(fault).__name__}: {fault}",
            )
            future.release()


def _await_worker(library: Any, client: Any, address: str) -> None:
    try:
        client.wait_for_workers(1, timeout=ANSWERS_S)
    except (TimeoutError, library.TimeoutError):
        warn(f"the Dask scheduler at {address} has no worker: waiting for one")
        client.wait_for_workers(1)


def _await_result(completed: Any, client: Any, address: str) -> None:
    """Wait for a result; warn if every worker has gone meanwhile."""
    since = time.monotonic()
    while not completed.has_ready():
        time.sleep(_POLL_S)
        if time.monotonic() - since > ANSWERS_S:
            since = time.monotonic()
            _warn_without_workers(client, address)


def _result(future: Any, library: Any, client: Any, address: str) -> Any:
    """The result of a future that was ready; if its worker was lost with it, that of the job's next run."""
    while True:
        try:
            return future.result(timeout=ANSWERS_S)
        except (TimeoutError, library.TimeoutError):
            _warn_without_workers(client, address)


def _warn_without_workers(client: Any, address: str) -> None:
    if not client.nthreads():
        warn(f"the Dask scheduler at {address} has no worker left: waiting for one")


def _drawn(job: Job, folder: Path, backend: str, batch: str) -> Drawn | str:
    return outcome(_drawer(backend), job, folder, batch)


def _sees(backend: str) -> str:
    """Empty, or the reason why this worker cannot draw."""
    try:
        _drawer(backend)
    except GlshadowError as error:
        return " ".join(str(error).split())
    return ""


def _drawer(backend: str) -> Drawer:
    """The drawer of this thread: a context is current on one thread at a time."""
    import threading

    key = f"{backend} {threading.get_ident()}"
    if key not in _drawers:
        _drawers[key] = Drawer(backend)
    return _drawers[key]
