"""Inputs of a job's images: the job itself, every file of its model, and glshadow's version."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

from glshadow import __version__
from glshadow.batch.draw import Inputs
from glshadow.batch.job import BUILTIN, Job
from glshadow.journal import Journal, digest_of, digest_of_file


def request_of(job: Job, inputs: Iterable[tuple[str, str | None]]) -> str:
    """Hash of everything that affects the images; moving a model with its files does not change it."""
    return digest_of(__version__, replace(job, scene=Path(job.scene).name), list(inputs))


class Models:
    """The files of each model when it was last drawn, by the journal; each file is hashed once."""

    def __init__(self, journal: Journal) -> None:
        self._journal = journal
        self._digests: dict[Path, str | None] = {}

    def request(self, job: Job) -> str | None:
        """Request of a job for the files as they are now; None if the files are not known."""
        if job.scene in BUILTIN:
            return request_of(job, ())
        names = self._journal.records.get(self._key(job), {}).get("files")
        if not isinstance(names, list):
            return None
        folder = Path(job.scene).parent
        return request_of(job, ((name, self._digest(folder / name)) for name in names))

    def add(self, job: Job, inputs: Inputs) -> None:
        """Record the files of a job."""
        key, files = self._key(job), [name for name, _ in inputs]
        if files and self._journal.records.get(key, {}).get("files") != files:
            self._journal.add({"key": key, "files": files})

    def _key(self, job: Job) -> str:
        return f"model {self._digest(Path(job.scene))}"

    def _digest(self, path: Path) -> str | None:
        if path not in self._digests:
            self._digests[path] = digest_of_file(path)
        return self._digests[path]
