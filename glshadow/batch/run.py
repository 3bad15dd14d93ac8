"""Runs jobs in processes of their own. Failures are listed, finished images are kept, interrupted batches resume."""

from __future__ import annotations

import contextlib
import multiprocessing
import os
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from pathlib import Path
from typing import Any

from glshadow.batch.draw import Drawer, Drawn
from glshadow.batch.inputs import Models, request_of
from glshadow.batch.job import MOST_PICTURES, Job
from glshadow.core.setting import as_path, flag, instance, optional, refuse, several, text, whole
from glshadow.errors import GlshadowError, ResourceError
from glshadow.gl.driver.context import Backend, backend_of
from glshadow.journal import Journal, Kept

JOURNAL = ".glshadow-batch.jsonl"
Progress = Callable[[int, int, str], None]
"""Called with (finished jobs, all jobs, the last job's image)."""


@dataclass(frozen=True)
class Failed:
    """A job that was not drawn, and the reason."""

    job: Job
    reason: str


@dataclass(frozen=True)
class Done:
    """Result of a batch.

    Attributes
    ----------
    drawn, kept : int
        Number of jobs that were drawn, and that were kept from an earlier run.
    pictures : int
        Number of images that were drawn.
    failed : tuple of Failed
    warnings : tuple of str
        Each once, with the image that it belongs to.
    seconds : float
        Of all processes together, loading and drawing.
    """

    drawn: int
    kept: int
    pictures: int
    failed: tuple[Failed, ...]
    warnings: tuple[str, ...]
    seconds: float


def run_batch(
    jobs: Sequence[Job],
    folder: str | os.PathLike[str],
    processes: int | None = None,
    backend: Backend = "auto",
    fresh: bool = False,
    progress: Progress | None = None,
    dask: str | None = None,
) -> Done:
    """Draw jobs into a folder.

    Jobs of one scene go to one process in sequence, which loads the scene once. A process that crashes loses one job and is replaced. An
    image is kept if its file is unchanged since it was written, and was drawn from the same job, the same bytes of every file of the
    model, and by the same version.

    Parameters
    ----------
    jobs : sequence of Job
        Jobs as returned by `read_jobs`.
    folder : path
        Folder for the images and the journal.
    processes : int, optional
        None: one per core.
    backend : str
        As for Renderer.
    fresh : bool
        Also draw jobs that the journal lists as finished.
    progress : callable, optional
    dask : str, optional
        Address of a Dask scheduler, whose workers draw instead; they must see `folder` and the models under the same paths.

    Raises
    ------
    SettingsError
        If an argument is not allowed, or the journal holds anything else; without dask.distributed, or if no scheduler answers.
    GlshadowError
        If the folder or the journal cannot be written; before anything is drawn.
    ResourceError
        If no process can create an OpenGL context; with its message.

    Warns
    -----
    GlshadowWarning
        If the scheduler has no worker.
    """
    jobs = several(instance(Job), "Jobs", MOST_PICTURES)("jobs", jobs)
    folder = as_path("folder", folder)
    count = optional(whole(1, 1024), "one per core")("processes", processes) or os.cpu_count() or 1
    backend = backend_of(backend, None)
    fresh = flag()("fresh", fresh)
    dask = optional(text(), "processes of this machine")("dask", dask)
    if progress is not None and not callable(progress):
        raise refuse("progress", "a callable (done, total, name) or None", progress)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ResourceError(f"{folder} cannot be created: {error.strerror}") from None
    journal = Journal(folder / JOURNAL)
    journal.add()
    models, kept_images = Models(journal), Kept(journal)
    open_jobs = list(jobs) if fresh else [job for job in jobs if not _is_kept(job, models, kept_images)]
    kept = len(jobs) - len(open_jobs)
    failed: list[Failed] = []
    said: list[str] = []
    pictures, seconds, drawn = 0, 0.0, 0
    ordered = sorted(open_jobs, key=lambda job: (job.scene, job.ground, job.up_axis or ""))
    if dask is None:
        results = _local(ordered, folder, min(count, max(len(ordered), 1)), backend)
    else:
        from glshadow.batch.cluster import on_cluster

        results = on_cluster(ordered, folder, dask, backend)
    for job, result in results:
        if isinstance(result, Drawn):
            drawn, pictures, seconds = drawn + 1, pictures + job.pictures, seconds + result.load + result.draw
            said += [f"{job.output}: {each}" for each in result.warnings]
            models.add(job, result.inputs)
            kept_images.add(request_of(job, result.inputs), dict(zip(job.names(), result.images, strict=True)))
        else:
            failed.append(Failed(job, result))
        if progress is not None:
            progress(kept + drawn + len(failed), len(jobs), job.output)
    return Done(drawn, kept, pictures, tuple(failed), tuple(dict.fromkeys(said)), seconds)


def _is_kept(job: Job, models: Models, images: Kept) -> bool:
    request = models.request(job)
    return request is not None and all(images.has(name, request) for name in job.names())


def _local(jobs: Sequence[Job], folder: Path, count: int, backend: Any) -> Iterator[tuple[Job, Drawn | str]]:
    """Results as they finish, from processes on this machine."""
    waiting = list(reversed(jobs))
    context = multiprocessing.get_context("spawn")  # a driver does not survive a fork
    workers: dict[Connection, _Worker] = {}
    try:
        for _ in range(count):
            worker = _Worker(context, folder, backend)
            workers[worker.pipe] = worker
        while workers:
            for ready in wait(list(workers)):
                assert isinstance(ready, Connection)
                worker = workers[ready]
                try:
                    kind, value = ready.recv()
                except (EOFError, OSError):  # it crashed: out of memory, or in its driver
                    del workers[ready]
                    job = worker.job
                    reason = worker.end()
                    if job is not None:
                        yield job, f"its process died ({reason})"
                        if waiting:
                            other = _Worker(context, folder, backend)
                            workers[other.pipe] = other
                    elif not workers and waiting:
                        raise ResourceError(f"no process could start drawing ({reason})") from None
                    continue
                if kind == "refused":  # no OpenGL here: another process will not have it either
                    raise ResourceError(f"a process of the batch has no OpenGL: {value}")
                if worker.job is not None:
                    done, worker.job = worker.job, None
                    yield done, value
                if waiting:
                    worker.begin(waiting.pop())
                else:
                    del workers[ready]
                    worker.end()
    finally:
        for worker in workers.values():
            worker.end(kill=True)


class _Worker:
    """A process and its current job."""

    def __init__(self, context: Any, folder: Path, backend: Any) -> None:
        self.pipe, theirs = context.Pipe()
        self.job: Job | None = None
        self._process = context.Process(target=_work, args=(theirs, folder, backend), daemon=True)
        self._process.start()
        theirs.close()

    def begin(self, job: Job) -> None:
        """Start a job."""
        self.job = job
        self.pipe.send(job)

    def end(self, kill: bool = False) -> str:
        """End the process; returns the reason why it ended."""
        if kill:
            self._process.kill()
        else:
            with contextlib.suppress(OSError):
                self.pipe.send(None)
        self.pipe.close()
        self._process.join(30.0)
        if self._process.is_alive():
            self._process.kill()
            self._process.join()
        code = self._process.exitcode
        return f"signal {-code}" if code is not None and code < 0 else f"exit code {code}"


def _work(pipe: Connection, folder: Path, backend: Any) -> None:
    """Main function of a process: report that it is ready, then draw the jobs that it receives."""
    import signal

    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent process handles Ctrl-C
    with suppress(
        BrokenPipeError, ConnectionResetError, EOFError
    ):  # the parent process was killed: no one receives the result
        try:
            drawer = Drawer(backend)
        except GlshadowError as error:
            pipe.send(("refused", str(error)))
            return
        pipe.send(("ready", None))
        while (job := pipe.recv()) is not None:
            pipe.send(("done", outcome(drawer, job, folder)))
        drawer.release()


def outcome(drawer: Drawer, job: Job, folder: Path, batch: str = "") -> Drawn | str:
    """The result of a job, or its error as one line: an error does not affect other jobs."""
    try:
        return drawer.draw(job, folder, batch)
    except GlshadowError as error:
        return " ".join(str(error).split())
    except MemoryError:
        return "there is not enough memory"
    except Exception as error:  # a defect: reported, and the other jobs continue
        return f"{type(error).__name__}: {error}"
