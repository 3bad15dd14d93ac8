"""A model file on disk or in memory, and how its format is recognised."""

from __future__ import annotations

import io
import re
import struct
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from glshadow.core.setting import shown
from glshadow.errors import SceneError
from glshadow.io.limits import Budget
from glshadow.io.mesh_files import SUFFIXES
from glshadow.io.mesh_files.words import without_mark

GLTF = (".glb", ".gltf")
TERRAIN = (".tif", ".tiff")
FORMATS = (*GLTF, *SUFFIXES, *TERRAIN)
NAMES = tuple(suffix[1:] for suffix in FORMATS)

BLOCK = 1 << 20  # bytes that are read from a file object at a time

_BLENDER = "for example with Blender: File, Export, glTF 2.0"
_CAD = (
    "triangulate it to .stl or .glb, for example with FreeCAD (File, Export) or Gmsh (`gmsh -2 part.step -o part.stl`)"
)
_TRIMESH = "read it by `trimesh.load(path)`, which `glshadow.load` takes, or convert it to .glb"
ADVICE = {
    **dict.fromkeys(
        (".usd", ".usda", ".usdc", ".usdz"),
        ("USD", f"convert it to .glb, {_BLENDER}, after File, Import, Universal Scene Description"),
    ),
    **dict.fromkeys((".step", ".stp"), ("STEP", f"it holds surfaces, not triangles: {_CAD}")),
    **dict.fromkeys((".iges", ".igs"), ("IGES", f"it holds surfaces, not triangles: {_CAD}")),
    ".fbx": ("FBX", f"convert it to .glb, with FBX2glTF, or {_BLENDER}"),
    ".dae": ("COLLADA", f"{_TRIMESH}, {_BLENDER}"),
    ".3mf": ("3MF", f"{_TRIMESH}, {_BLENDER}"),
    ".blend": ("a Blender file", f"convert it to .glb, {_BLENDER}"),
}
"""Suffix -> the format's name and how to convert it, for common formats that are not read."""

_FOREIGN = (
    (b"PXR-USDC", ".usdc"),
    (b"#usda", ".usda"),
    (b"ISO-10303-21", ".step"),
    (b"Kaydara FBX Binary", ".fbx"),
    (b"BLENDER", ".blend"),
    (b"; FBX", ".fbx"),
)

_TIFF = (b"II*\0", b"MM\0*", b"II+\0", b"MM\0+")  # in both byte orders; + is BigTIFF


@dataclass(frozen=True)
class ModelFile:
    """One model file.

    Parameters
    ----------
    suffix : str
        Its format, as a suffix in lower case: one of FORMATS.
    folder : Path, optional
        Where files that it names are looked for; None: nowhere, for data in memory.
    path : Path, optional
        None: `data` has its content.
    data : bytes
    """

    suffix: str
    folder: Path | None
    path: Path | None = None
    data: bytes = b""

    @property
    def size(self) -> int:
        """Bytes."""
        return len(self.data) if self.path is None else self.path.stat().st_size

    def head(self, count: int) -> bytes:
        """The first bytes."""
        if self.path is None:
            return self.data[:count]
        with self.path.open("rb") as file:
            return file.read(count)

    def read(self, budget: Budget, most: int | None = None) -> bytes:
        """The content, or its first `most` bytes, checked against the limits before a file is read."""
        if self.path is not None:
            return budget.read(self.path, "the file", most)
        budget.limits.check("file_bytes", budget.read_bytes + len(self.data), "the file")
        budget.read_bytes += len(self.data)
        return self.data[:most]


def model_file(source: Path | ModelFile) -> ModelFile:
    """A file on disk, by its path, or the file itself."""
    return source if isinstance(source, ModelFile) else on_disk(source, None)


def on_disk(path: Path, suffix: str | None) -> ModelFile:
    """A file on disk; `suffix` replaces its own.

    Raises
    ------
    SceneError
        If its format is not read, or there is no such file, or it is empty.
    """
    own = path.suffix.lower() if suffix is None else suffix
    if own in ADVICE:
        raise foreign(own)
    if own not in FORMATS:
        raise SceneError(f"a model file must end in one of {', '.join(FORMATS)}, got {path.suffix or 'no ending'!r}")
    if not path.is_file():
        raise SceneError(f"file not found: {path}")
    if path.stat().st_size == 0:
        raise SceneError("nothing to render: the file is empty (0 bytes)")
    return ModelFile(own, path.parent, path)


def in_memory(data: bytes, suffix: str | None, folder: Path | None = None) -> ModelFile:
    """Bytes of a file; without a suffix its format is recognised by its beginning.

    Raises
    ------
    SceneError
        If it is empty, or of a format that is not read or not recognised.
    """
    if not data:
        raise SceneError("nothing to render: there are 0 bytes")
    found = suffix or recognised(data)
    if found is None:
        raise SceneError(
            f"its format is not recognised, it begins with {data[:16]!r}; name it: "
            f"glshadow.load(..., format={' or '.join(map(repr, NAMES))})"
        )
    return ModelFile(found, folder, None, data)


def from_stream(stream: Any, suffix: str | None, budget: Budget) -> ModelFile:
    """The rest of a binary file object. Files that it names are looked for next to it if it is a file on disk.

    Raises
    ------
    SceneError
        As `in_memory`; also if it gives text, or more bytes than allowed.
    """
    if getattr(stream, "closed", False) is True:
        raise SceneError("the file object is closed: open it again, or load its path")
    if isinstance(stream, io.TextIOBase):
        raise SceneError("a file object must give bytes, and this one gives text: open it in binary mode, 'rb'")
    data = b"".join(_blocks(stream, budget))
    name = getattr(stream, "name", None)
    path = Path(name) if isinstance(name, str) and name and "\0" not in name else None
    if path is None or not path.is_file():
        return in_memory(data, suffix)
    own = path.suffix.lower()
    if suffix is None and own in ADVICE:
        raise foreign(own)
    return in_memory(data, suffix or (own if own in FORMATS else None), path.parent)


def _blocks(stream: Any, budget: Budget) -> Iterator[bytes]:
    size = 0
    while True:
        block = stream.read(BLOCK)
        if block is None or len(block) == 0:
            return
        if not isinstance(block, bytes | bytearray | memoryview):
            raise SceneError(f"a file object must give bytes, got {shown(block)}: open it in binary mode, 'rb'")
        size += len(block)
        budget.limits.check("file_bytes", size, "the file object")
        yield bytes(block)


def foreign(suffix: str) -> SceneError:
    """The error for a format that is not read but known."""
    name, advice = ADVICE[suffix]
    return SceneError(f"{name} ({suffix}) is not read: {advice}")


def recognised(data: bytes) -> str | None:
    """The format of a file's content, as a suffix; None if it is not recognised.

    Raises
    ------
    SceneError
        If it is of a known format that is not read.
    """
    for magic, suffix in _FOREIGN:
        if data.startswith(magic):
            raise foreign(suffix)
    if data.startswith(b"PK\x03\x04"):
        raise foreign(".usdz" if b".usd" in data[:300] else ".3mf")
    if data.startswith(b"glTF"):
        return ".glb"
    if data[:4] in _TIFF:
        return ".tif"
    if len(data) >= 84 and len(data) == 84 + 50 * struct.unpack_from("<I", data, 80)[0]:
        return ".stl"  # binary; its 80 bytes of header may begin with anything
    text = without_mark(data[:65536]).lstrip()
    if text.startswith(b"{"):
        return ".gltf"
    if b"<COLLADA" in text[:1000]:
        raise foreign(".dae")
    if re.match(rb"ply\s", text, re.IGNORECASE):
        return ".ply"
    if re.match(rb"(ST)?C?N?4?n?OFF\b", text):
        return ".off"
    if re.match(rb"solid\b", text, re.IGNORECASE):
        return ".stl"
    if re.search(rb"^[ \t]*(v|f)[ \t]+[-+.\d]|^[ \t]*(mtllib|usemtl)[ \t]", text, re.MULTILINE):
        return ".obj"
    return None
