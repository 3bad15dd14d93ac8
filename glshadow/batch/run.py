"""Runs jobs in processes of their own: what fails is listed, what is done is kept, and what was interrupted goes on."""

from __future__ import annotations

import contextlib
import json
import multiprocessing
import os
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass
from multiprocessing.connection import Connection, wait
from pathlib import Path
from typing import Any

from glshadow.batch.draw import Drawer, Drawn
from glshadow.batch.job import Job
from glshadow.core.setting import as_path, whole
from glshadow.errors import GlshadowError, ResourceError

JOURNAL = ".glshadow-batch.jsonl"
Progress = Callable[[int, int, str], None]
"""(jobs done, all jobs, the last one's picture)."""


@dataclass(frozen=True)
class Failed:
    """A job that was not drawn, and why."""

    job: Job
    reason: str


@dataclass(frozen=True)
class Done:
    """What became of a batch.

    Attributes
    ----------
    drawn, kept : int
        Jobs that were drawn, and that were there from an earlier run.
    pictures : int
        That were drawn.
    failed : tuple of Failed
    warnings : tuple of str
        Each once, with the picture that it is of.
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
    backend: Any = "auto",
    fresh: bool = False,
    progress: Progress | None = None,
    dask: str | None = None,
) -> Done:
    """Draw jobs into a folder.

    Jobs of one scene go to one process one after the other, which loads it once. A process that dies takes one job with it and is replaced.

    Parameters
    ----------
    jobs : sequence of Job
        As `read_jobs` gives them.
    folder : path
        Where pictures go, and the journal of what is done.
    processes : int, optional
        None: one for each core.
    backend : str
        As in Renderer.
    fresh : bool
        Draw also what the journal says is done.
    progress : callable, optional
    dask : str, optional
        Address of a Dask scheduler, whose workers draw instead; they see `folder` and the models under the same paths.

    Raises
    ------
    SettingsError, ResourceError
        If the folder cannot be made; if no process gives an OpenGL context: its own words.
    """
    folder = as_path("folder", folder)
    count = whole(1, 1024)("processes", processes if processes is not None else os.cpu_count() or 1)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ResourceError(f"{folder} cannot be made: {error.strerror}") from None
    journal = folder / JOURNAL
    there = set() if fresh else _journaled(journal)
    open_jobs = [job for job in jobs if not (job.key in there and all(path.is_file() for path in job.outputs(folder)))]
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
    with journal.open("a", encoding="utf-8") as kept_file:
        for job, result in results:
            if isinstance(result, Drawn):
                drawn, pictures, seconds = drawn + 1, pictures + job.pictures, seconds + result.load + result.draw
                said += [f"{job.output}: {each}" for each in result.warnings]
                kept_file.write(json.dumps({"key": job.key, "output": job.output, **asdict(result)}) + "\n")
                kept_file.flush()
            else:
                failed.append(Failed(job, result))
            if progress is not None:
                progress(kept + drawn + len(failed), len(jobs), job.output)
    return Done(drawn, kept, pictures, tuple(failed), tuple(dict.fromkeys(said)), seconds)


def _journaled(path: Path) -> set[str]:
    """Keys of jobs that are done; a last line that an interruption cut is left out."""
    if not path.is_file():
        return set()
    found = set()
    for line in path.read_text(encoding="utf-8", errors="replace").splitlines():
        try:
            found.add(str(json.loads(line)["key"]))
        except (ValueError, KeyError, TypeError):
            continue
    return found


def _local(jobs: Sequence[Job], folder: Path, count: int, backend: Any) -> Iterator[tuple[Job, Drawn | str]]:
    """Results as they come, from processes of this machine."""
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
                except (EOFError, OSError):  # it died: of memory, of its driver
                    del workers[ready]
                    job = worker.job
                    reason = worker.end()
                    if job is not None:
                        yield job, f"its process died ({reason})"
                        if waiting:
                            other = _Worker(context, folder, backend)
                            workers[other.pipe] = other
                    elif not workers and waiting:
                        raise ResourceError(f"no process could begin to draw ({reason})") from None
                    continue
                if kind == "refused":  # no OpenGL here: it will not be better in another process
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
    """A process, and the job that it has."""

    def __init__(self, context: Any, folder: Path, backend: Any) -> None:
        self.pipe, theirs = context.Pipe()
        self.job: Job | None = None
        self._process = context.Process(target=_work, args=(theirs, folder, backend), daemon=True)
        self._process.start()
        theirs.close()

    def begin(self, job: Job) -> None:
        """Give it one."""
        self.job = job
        self.pipe.send(job)

    def end(self, kill: bool = False) -> str:
        """Let it go; why it went."""
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
    """What a process does: says that it is ready, then draws what it is given."""
    import signal

    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the first process's affair
    try:
        drawer = Drawer(backend)
    except GlshadowError as error:
        pipe.send(("refused", str(error)))
        return
    pipe.send(("ready", None))
    while (job := pipe.recv()) is not None:
        pipe.send(("done", outcome(drawer, job, folder)))
    drawer.release()


def outcome(drawer: Drawer, job: Job, folder: Path) -> Drawn | str:
    """What a job took, or why it failed, in a line: one job's fault is no other's."""
    try:
        return drawer.draw(job, folder)
    except GlshadowError as error:
        return " ".join(str(error).split())
    except MemoryError:
        return "there is not enough memory"
    except Exception as error:  # a fault of ours: named, and the others go on
        return f"{type(error).__name__}: {error}"
