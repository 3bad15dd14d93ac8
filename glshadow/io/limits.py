"""Limits: what loading one file may cost."""

from __future__ import annotations

import time
from dataclasses import dataclass, field, fields
from pathlib import Path

from glshadow.core.setting import Settings, number, setting, whole
from glshadow.errors import SceneError
from glshadow.image import Header

_MOST = 2**62
IMAGES = 4
"""Limit on all images of a file together, in multiples of the largest allowed image."""


class OverLimit(SceneError):
    """A file costs more than is allowed: not a reason to leave a part of it out, but to stop."""


@dataclass(frozen=True)
class Limits(Settings):
    """What loading one file may cost; checked before memory is allocated.

    Parameters
    ----------
    texture_pixels : int
        Pixels of one decoded image; all images of a file together may have four times as many.
    triangles : int
        Triangles of all nodes, instances included.
    nodes : int
        Nodes with meshes, instances included; separately, nodes of the file's hierarchy.
    lights : int
        Lights in the scene.
    draws : int
        Nodes with meshes times lights.
    file_bytes : int
        Bytes of the file and of the files that it references, as far as they are read.
    expansion : float
        Bytes of memory per byte read, above the first 128 MiB.
    seconds : float
        Time for reading.
    """

    texture_pixels: int = setting(whole(1, _MOST), 2**26, help="pixels of one decoded image")
    triangles: int = setting(whole(1, _MOST), 2 * 10**7, help="triangles of all nodes")
    nodes: int = setting(whole(1, _MOST), 10**5, help="nodes with meshes, and nodes of the hierarchy")
    lights: int = setting(whole(1, _MOST), 256, help="lights")
    draws: int = setting(whole(1, _MOST), 3 * 10**5, help="nodes with meshes times lights")
    file_bytes: int = setting(whole(1, _MOST), 2**31, help="bytes of the file and of the files that it references")
    expansion: float = setting(number(1.0, 1e12), 200.0, help="bytes of memory per byte read, above the first 128 MiB")
    seconds: float = setting(number(0.0, 1e9, above=True), 300.0, help="seconds of reading")

    def check(self, limit: str, value: float, what: str) -> None:
        """Raise an error if `value` is above the limit of that name.

        Raises
        ------
        SceneError
            Names the limit, the value, and how to raise the limit.
        """
        allowed = getattr(self, limit)
        if value > allowed:
            unit = next(each.metadata["help"] for each in fields(self) if each.name == limit)
            raise OverLimit(
                f"{what}: {value:g} {unit}; the limit is {allowed:g}; if you trust the file, raise it with "
                f"glshadow.load(..., limits=glshadow.Limits({limit}=...))"
            )


@dataclass
class Budget:
    """The limits of one file while it is read: remaining memory, and the end time.

    Parameters
    ----------
    limits : Limits
    read_bytes : int
        Bytes read from the file and from files that it references.
    files : set of Path
        Files that were read, and files that were not found.
    """

    limits: Limits = field(default_factory=Limits)
    read_bytes: int = 0
    files: set[Path] = field(default_factory=set)
    taken_bytes: int = 0
    taken_pixels: int = 0
    started: float = field(default_factory=time.monotonic)

    FREE = 128 * 2**20

    def read(self, path: Path, what: str, most: int | None = None) -> bytes:
        """The bytes of a file, or the first `most` of a longer one; checked against the limits before reading."""
        count = self.announce(path, what, most)
        with path.open("rb") as file:
            return file.read(count)

    def announce(self, path: Path, what: str, most: int | None = None) -> int:
        """Check a file against the limits before reading; returns its bytes."""
        self.files.add(path)
        size = path.stat().st_size
        count = size if most is None else min(size, most)
        self.limits.check("file_bytes", self.read_bytes + count, what)
        self.read_bytes += count
        return count

    def take(self, count_bytes: int, what: str) -> None:
        """Check an allocation against the limits."""
        self.taken_bytes += count_bytes
        over = (self.taken_bytes - self.FREE) / max(self.read_bytes, 1)
        self.limits.check("expansion", over, what)

    def take_image(self, header: Header, what: str) -> None:
        """Check an image against the limits before decoding."""
        pixels = header.size[0] * header.size[1]
        self.limits.check("texture_pixels", pixels, what)
        self.taken_pixels += pixels
        self.limits.check("texture_pixels", self.taken_pixels / IMAGES, f"{what}: one of {IMAGES} parts of all images")
        self.take(header.decoded_bytes, what)

    def check_time(self, what: str) -> None:
        """Raise an error if reading has taken too long."""
        self.limits.check("seconds", time.monotonic() - self.started, what)
