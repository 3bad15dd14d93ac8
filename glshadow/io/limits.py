"""Limits: what one file may cost before it is refused."""

from __future__ import annotations

import time
from dataclasses import dataclass, field, fields
from pathlib import Path

from glshadow.core.setting import Settings, number, setting, whole
from glshadow.errors import SceneError
from glshadow.image import Header

_MOST = 2**62
IMAGES = 4
"""How many of the largest images all of a file's together may make up."""


@dataclass(frozen=True)
class Limits(Settings):
    """What loading one file may cost; checked before memory is taken.

    Parameters
    ----------
    texture_pixels : int
        Of one image once decoded, and of all images of a file together four times as many.
    triangles : int
        Of all placed meshes, instances counted.
    nodes : int
        Placed meshes, instances counted, and, by themselves, nodes of the file's tree.
    lights : int
        Placed lights.
    draws : int
        Placed meshes times lights.
    file_bytes : int
        Of the file and of those beside it, as far as they are read.
    expansion : float
        Bytes of memory per byte read, above the first 128 MiB.
    seconds : float
        Of reading.
    """

    texture_pixels: int = setting(whole(1, _MOST), 2**26, help="pixels of one decoded image")
    triangles: int = setting(whole(1, _MOST), 2 * 10**7, help="triangles of all placed meshes")
    nodes: int = setting(whole(1, _MOST), 10**5, help="placed meshes, and nodes of the tree")
    lights: int = setting(whole(1, _MOST), 256, help="placed lights")
    draws: int = setting(whole(1, _MOST), 3 * 10**5, help="placed meshes times lights")
    file_bytes: int = setting(whole(1, _MOST), 2**31, help="bytes of the file and of those that it names")
    expansion: float = setting(number(1.0, 1e12), 200.0, help="bytes of memory per byte read, above the first 128 MiB")
    seconds: float = setting(number(0.0, 1e9, above=True), 300.0, help="seconds of reading")

    def check(self, limit: str, value: float, what: str) -> None:
        """Refuse `value` where it is above the limit of that name.

        Raises
        ------
        SceneError
            Names limit, value, and how to raise it.
        """
        allowed = getattr(self, limit)
        if value > allowed:
            unit = next(each.metadata["help"] for each in fields(self) if each.name == limit)
            raise SceneError(
                f"{what}: {value:g} {unit}; the limit is {allowed:g}; if you trust the file, raise it with "
                f"glshadow.load(..., limits=glshadow.Limits({limit}=...))"
            )


@dataclass
class Budget:
    """The limits of one file while it is read: how much memory it may still take, and until when.

    Parameters
    ----------
    limits : Limits
    read_bytes : int
        Of the file and of what it refers to.
    files : set of Path
        Those that were read, and those that were looked for and are missing.
    """

    limits: Limits = field(default_factory=Limits)
    read_bytes: int = 0
    files: set[Path] = field(default_factory=set)
    taken_bytes: int = 0
    taken_pixels: int = 0
    started: float = field(default_factory=time.monotonic)

    FREE = 128 * 2**20

    def read(self, path: Path, what: str, most: int | None = None) -> bytes:
        """The bytes of a file, of a longer one the first `most`; announced before they are read."""
        count = self.announce(path, what, most)
        with path.open("rb") as file:
            return file.read(count)

    def announce(self, path: Path, what: str, most: int | None = None) -> int:
        """Bytes of a file that will be read."""
        self.files.add(path)
        size = path.stat().st_size
        count = size if most is None else min(size, most)
        self.limits.check("file_bytes", self.read_bytes + count, what)
        self.read_bytes += count
        return count

    def take(self, count_bytes: int, what: str) -> None:
        """Announce memory before it is taken."""
        self.taken_bytes += count_bytes
        over = (self.taken_bytes - self.FREE) / max(self.read_bytes, 1)
        self.limits.check("expansion", over, what)

    def take_image(self, header: Header, what: str) -> None:
        """Announce an image before it is decoded."""
        pixels = header.size[0] * header.size[1]
        self.limits.check("texture_pixels", pixels, what)
        self.taken_pixels += pixels
        self.limits.check("texture_pixels", self.taken_pixels / IMAGES, f"{what}: one of {IMAGES} parts of all images")
        self.take(header.decoded_bytes, what)

    def check_time(self, what: str) -> None:
        """Stop where reading has taken too long."""
        self.limits.check("seconds", time.monotonic() - self.started, what)
