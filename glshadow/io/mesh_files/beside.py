"""Files that a mesh file references: only those in its folder; every failure is noted."""

from __future__ import annotations

import os
import re
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from glshadow.errors import SceneError
from glshadow.files import inside
from glshadow.image import header, read
from glshadow.io.limits import Budget

MOST_NOTED = 20  # missing files that are named one by one; further ones are only counted
LONGEST = 4095  # characters of a path


class Beside:
    """Finds, reads and decodes referenced files, each once.

    Parameters
    ----------
    folder : Path, optional
        Nothing outside it is read; None, for data in memory: nothing at all.
    notes : list of str
        Gets a note for each file that is missing, cannot be decoded, or has a slightly different name.
    budget : Budget
    """

    def __init__(self, folder: Path | None, notes: list[str], budget: Budget) -> None:
        self.nowhere = folder is None
        self.folder = Path() if folder is None else folder
        self.notes = notes
        self.budget = budget
        self._found: dict[str, Path | None] = {}
        self._pictures: dict[Path, NDArray[np.uint8] | None] = {}
        self._listed: dict[str, dict[str, str]] = {}
        self._missing = 0

    def text(self, name: str) -> bytes | None:
        """Bytes of the file `name`; None if it does not exist."""
        path = self.path(name)
        if path is None:
            return None
        return self.budget.read(path, f"the file {name!r}")

    def picture(self, name: str) -> NDArray[np.uint8] | None:
        """RGBA bytes (H, W, 4) of the image `name`; None if it does not exist or cannot be decoded."""
        path = self.path(name)
        if path is None:
            return None
        if path not in self._pictures:
            self._pictures[path] = self._decoded(path, name)
        return self._pictures[path]

    def _decoded(self, path: Path, name: str) -> NDArray[np.uint8] | None:
        self.budget.check_time("its images")
        self.budget.announce(path, f"the image {name!r}")
        try:
            stated = header(path)
        except SceneError as error:
            self._undecodable(name, error)
            return None
        self.budget.take_image(stated, f"the image {name!r}")
        try:
            return read(path)
        except SceneError as error:
            self._undecodable(name, error)
            return None

    def _undecodable(self, name: str, error: SceneError) -> None:
        self.notes.append(f"the image {name!r} cannot be decoded ({error}): drawn without it")

    def path(self, name: str) -> Path | None:
        """The referenced file. Backslashes become slashes, an absolute path is reduced to its last part, and if no name
        matches exactly, one that differs only by case is used."""
        if name not in self._found:
            self._found[name] = self._look(name)
        return self._found[name]

    def has(self, name: str) -> bool:
        """Whether the file exists; adds no note."""
        return not self.nowhere and self._resolved(_local(name)) is not None

    def _look(self, name: str) -> Path | None:
        local = _local(name)
        if self.nowhere:
            self._note(name, "cannot be found, as data in memory has no folder")
            return None
        found = None if _leaves(local) else self._resolved(local)
        if found is None:
            outside = _leaves(local) or _is_absolute(name)
            self._note(name, "is outside the model's folder" if outside else "is missing")
            return None
        path = self.folder / found
        self.budget.files |= {path, self.folder / local}
        if not inside(path, self.folder):
            self._note(name, "is a link out of the model's folder")
            return None
        if found != local:
            self.notes.append(f"the file {name!r} that it names exists as {found!r}: used")
        return path

    def _note(self, name: str, reason: str) -> None:
        self._missing += 1
        if self._missing <= MOST_NOTED:
            self.notes.append(f"the file {name!r} that it names {reason}: drawn without it")
        elif self._missing == MOST_NOTED + 1:
            self.notes.append("more files that it names are missing: drawn without them")

    def _resolved(self, local: str) -> str | None:
        """A path in the folder with the file system's case; None if no such file exists."""
        if not local or _leaves(local) or "\0" in local or len(local) > LONGEST:
            return None
        found = ""
        for part in Path(local).parts:
            if found in self._listed or not os.path.lexists(self.folder / found / part):
                names = self._names(found)
                if part not in names and part.casefold() not in names:
                    self.budget.files.add(self.folder / local)  # missing: if it appears later, the scene changes
                    return None
                part = names.get(part) or names[part.casefold()]
            found = f"{found}/{part}" if found else part
        return found if (self.folder / found).is_file() else None

    def _names(self, folder: str) -> dict[str, str]:
        """Names in a folder below the model's, by exact name and by lower case."""
        if folder not in self._listed:
            place = self.folder / folder
            names = sorted((entry.name for entry in place.iterdir()), reverse=True) if place.is_dir() else []
            self._listed[folder] = {name.casefold(): name for name in names} | {name: name for name in names}
        return self._listed[folder]


def _plain(name: str) -> str:
    return name.strip().strip('"').replace("\\", "/")


def _is_absolute(name: str) -> bool:
    return _plain(name).startswith("/") or re.match(r"[A-Za-z]:", _plain(name)) is not None


def _leaves(local: str) -> bool:
    """Whether a normal relative path leads out of the folder that it begins in."""
    return local.split("/", 1)[0] == os.pardir


def _local(name: str) -> str:
    wanted = _plain(name)
    if _is_absolute(name):
        wanted = wanted.rsplit("/", 1)[-1]  # a path on the author's machine
    return os.path.normpath(wanted) if wanted else ""
