"""Journals: results appended as JSON lines, and the request that each image file was drawn for, so that interrupted work can continue."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any

from glshadow.errors import GlshadowError, SettingsError


class Journal:
    """The lines of one file, by key. With `path` None nothing is written.

    A line that an interruption cut short is removed before anything is appended.

    Raises
    ------
    SettingsError
        If the file holds anything else, or is a link, a folder, a device or a pipe.
    GlshadowError
        If it cannot be read.
    """

    def __init__(self, path: str | os.PathLike[str] | None) -> None:
        self.path = None if path is None else Path(path)
        self.records: dict[str, dict[str, Any]] = {}
        if self.path is None:
            return
        if self.path.is_symlink() or (self.path.exists() and not self.path.is_file()):
            kind = "a link" if self.path.is_symlink() else "a folder, a device or a pipe"
            raise SettingsError(f"{self.path} is {kind}, where a journal must be a file")
        if not self.path.exists():
            return
        try:
            data = self.path.read_bytes()
            whole = data.rfind(b"\n") + 1
            if whole < len(data):
                with self.path.open("r+b") as file:
                    file.truncate(whole)
        except OSError as error:
            raise GlshadowError(f"cannot read {self.path}: {error.strerror or error}") from error
        for number, line in enumerate(data[:whole].splitlines(), start=1):
            try:
                self._merge(json.loads(line))
            except (ValueError, TypeError, KeyError, RecursionError) as error:
                raise SettingsError(
                    f"{self.path}, line {number}, is not a journal record; give another file or delete this one"
                ) from error

    def add(self, *records: dict[str, Any]) -> None:
        """Append records by their "key" and wait until they are on the disk; later records extend earlier ones with the same key.

        Without records, create the file, or find that it cannot be written.

        Raises
        ------
        GlshadowError
            If the file cannot be written completely; it then contains none of the records.
        """
        if self.path is not None:
            lines = "".join(json.dumps(record, allow_nan=False, separators=(",", ":")) + "\n" for record in records)
            try:
                self.path.parent.mkdir(parents=True, exist_ok=True)
                _append(self.path, lines.encode())
            except OSError as error:
                raise GlshadowError(f"cannot write {self.path}: {error.strerror or error}") from error
        for record in records:
            self._merge(record)

    def _merge(self, record: dict[str, Any]) -> None:
        self.records[record["key"]] = {**self.records.get(record["key"], {}), **record}


def _append(path: Path, lines: bytes) -> None:
    """Append all lines, or nothing."""
    with path.open("ab", buffering=0) as file:
        before = file.seek(0, os.SEEK_END)
        try:
            written = 0
            while written < len(lines):  # a nearly full disk writes the beginning and refuses the rest
                written += file.write(lines[written:])
            os.fsync(file.fileno())
        except BaseException:
            file.truncate(before)
            raise


class Kept:
    """Which image files exist, and for which request each was last drawn, according to a journal.

    Parameters
    ----------
    journal : Journal
        Its keys are file names, relative to the journal's folder.
    """

    def __init__(self, journal: Journal) -> None:
        assert journal.path is not None
        self._journal, self._folder = journal, journal.path.parent

    def stale(self, name: str, request: str) -> bool:
        """Whether an image exists that was drawn for another request."""
        record = self._journal.records.get(name, {})
        return record.get("request", request) != request and (self._folder / name).is_file()

    def has(self, name: str, request: str) -> bool:
        """Whether an image was drawn for this request and is unchanged."""
        record = self._journal.records.get(name, {})
        digest = record.get("sha256")
        return record.get("request") == request and digest is not None and digest == digest_of_file(self._folder / name)

    def add(self, request: str, images: Mapping[str, str | None]) -> None:
        """Record images that were written for a request: their names and digests."""
        self._journal.add(*({"key": name, "request": request, "sha256": each} for name, each in images.items()))


def digest_of_file(path: Path) -> str | None:
    """SHA-256 of a file's bytes; None if it cannot be read as a file."""
    try:
        if not path.is_file():
            return None
        with path.open("rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except OSError:
        return None


def digest_of(*facts: Any) -> str:
    """Hash of everything that affects a result: settings field by field, arrays by their bytes, all else by its repr."""
    return hashlib.sha256(repr([_plain(each) for each in facts]).encode()).hexdigest()[:24]


def _plain(value: Any) -> Any:
    import numpy as np  # not at the top: command help does not need numpy

    if isinstance(value, np.ndarray):
        data = hashlib.sha256(np.ascontiguousarray(value).tobytes()).hexdigest()
        return ("array", value.shape, str(value.dtype), data)
    if is_dataclass(value) and not isinstance(value, type):
        return (type(value).__name__, *(_plain(getattr(value, each.name)) for each in fields(value)))
    if isinstance(value, tuple | list):
        return [_plain(each) for each in value]
    return value
