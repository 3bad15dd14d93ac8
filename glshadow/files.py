"""Atomic file writes, temporary files and the files of a folder. Files that a killed process left are removed by the next one.

Temporary files are named `.glshadow-<machine>-<process>-<number>` and are next to their target file, or in the system's temporary
folder. A file is stale when its process has ended.
"""

from __future__ import annotations

import itertools
import os
import platform
import re
import tempfile
import zlib
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from glshadow.errors import GlshadowError

_MACHINE = (
    f"{zlib.crc32(platform.node().encode()):08x}"  # folders may be shared between machines, process numbers are not
)
_NAME = re.compile(rf"\.glshadow-{_MACHINE}-(\d+)-\d+(\.\w+)?")

_numbers = itertools.count()
_swept: set[Path] = set()


def inside(path: Path, folder: Path) -> bool:
    """Whether a path is in a folder, with all links resolved."""
    return Path(os.path.realpath(path)).is_relative_to(os.path.realpath(folder))


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """A path with the same suffix next to `path`, to write to. Renamed to `path` at the end, removed after an error.

    Raises
    ------
    GlshadowError
        If it cannot be written; also for an OSError inside the block.
    """
    try:
        with _own(path.parent, path.suffix) as part:
            yield part
            part.replace(path)
    except OSError as error:
        raise GlshadowError(f"{path} cannot be written: {error.strerror or error}") from error


@contextmanager
def temporary(suffix: str) -> Iterator[Path]:
    """An empty temporary file with a suffix, removed at the end.

    Raises
    ------
    GlshadowError
        If it cannot be made; also for an OSError inside the block.
    """
    try:
        with _own(Path(tempfile.gettempdir()), suffix) as path:
            yield path
    except OSError as error:
        raise GlshadowError(f"a temporary file cannot be written: {error.strerror or error}") from error


@contextmanager
def _own(folder: Path, suffix: str) -> Iterator[Path]:
    _sweep(folder)
    path = folder / f".glshadow-{_MACHINE}-{os.getpid()}-{next(_numbers)}{suffix}"
    try:
        os.close(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o666))
        yield path
    finally:
        with suppress(OSError):
            path.unlink(missing_ok=True)


def _sweep(folder: Path) -> None:
    """Remove stale files from a folder, once per process."""
    place = folder.absolute()
    if place in _swept:
        return
    _swept.add(place)
    with suppress(OSError), os.scandir(place) as entries:
        for entry in entries:
            match = _NAME.fullmatch(entry.name)
            if match and not _alive(int(match[1])):
                with suppress(OSError):
                    Path(entry.path).unlink()


def _alive(process: int) -> bool:
    if os.name != "posix":
        return True  # on Windows os.kill would end the process, so it counts as running
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except (OSError, OverflowError):  # owned by another user
        return True
    return True
