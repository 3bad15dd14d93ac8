"""OBJ, PLY, STL and OFF: checked against the file's size, then read by trimesh's parsers without its processing."""

from __future__ import annotations

import io
import logging
import os
import re
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from glshadow.errors import SceneError
from glshadow.scene.builder import Builder
from glshadow.scene.imported import Imported, blended
from glshadow.scene.limits import Budget
from glshadow.scene.mesh import Node

PLY_SIZES = {"char": 1, "uchar": 1, "short": 2, "ushort": 2, "int": 4, "uint": 4, "float": 4, "double": 8}
PLY_SIZES |= {"int8": 1, "uint8": 1, "int16": 2, "uint16": 2, "int32": 4, "uint32": 4, "int64": 8, "uint64": 8}
PLY_SIZES |= {"float16": 2, "float32": 4, "float64": 8}
RELATIVE_FACE = re.compile(rb"^f[ \t][^\n#]*-\d", re.MULTILINE)
SHORT_FACE = re.compile(rb"^f[ \t]+[^\s#]+(?:[ \t]+[^\s#]+)?[ \t\r]*$", re.MULTILINE)
ZERO_FACE = re.compile(rb"^f[ \t](?:[^\n#]*[ \t])?0(?=[/\s]|\Z)[^\n]*", re.MULTILINE)


def read_mesh_file(path: Path, budget: Budget) -> Imported:
    """Read a .obj, .ply, .stl or .off file.

    Raises
    ------
    SceneError
        If it is broken, or declares more than it holds.
    """
    kind = path.suffix.lower()[1:]
    data = path.read_bytes()
    budget.read_bytes += len(data)
    builder = Builder()
    data = {"obj": _check_obj, "ply": _check_ply, "stl": _check_stl, "off": _check_off}[kind](data, builder.notes)
    beside = Beside(path.parent, builder.notes)
    parts = _parse(kind, data, beside)
    found = Imported(notes=builder.notes)
    for name, part in parts:
        if kind == "stl":
            _drop_broken_facets(part, builder.notes)
        if "faces" not in part or part["faces"] is None:
            continue
        mesh = builder.mesh(
            part["vertices"],
            part["faces"],
            name=name,
            normals=part.get("vertex_normals"),
            visual=part.get("visual"),
            colors=part.get("vertex_colors"),
            face_colors=part.get("face_colors") if part.get("vertex_colors") is None else None,
        )
        if mesh is not None:
            found.nodes.append(Node(name, mesh, np.eye(4)))
    if kind == "stl":
        _check_facets(data, sum(len(part.get("faces", ())) for _, part in parts), builder.notes)
    if not found.nodes and any(len(part.get("vertices", ())) for _, part in parts):
        raise SceneError("nothing to render: it holds only points or lines, and no triangles")
    found.notes += blended(found.nodes)
    return found


def _parse(kind: str, data: bytes, beside: Beside) -> list[tuple[str, dict[str, Any]]]:
    """(name, arrays) of every part, by trimesh's parser alone: its Trimesh would merge vertices and drop faces."""
    from trimesh.exchange.load import mesh_loaders

    with _quiet():
        try:
            parser: Callable[..., dict[str, Any]] = mesh_loaders[kind]
            loaded = parser(file_obj=io.BytesIO(data), file_type=kind, resolver=beside)
        except IndexError as error:
            raise SceneError(f"a face refers to a vertex that does not exist ({error})") from error
    if "geometry" in loaded:
        parts = loaded["geometry"]
        return [(name if name != "geometry" else "mesh", parts[name]) for name in parts]
    return [("mesh", loaded)]


@contextmanager
def _quiet() -> Iterator[None]:
    """No log lines or warnings of trimesh; numpy's warning that a text was read only in part becomes an error."""
    logger = logging.getLogger("trimesh")  # parent of one logger per module; a parent's level does not stop them
    before, logger.propagate = logger.propagate, False
    silent = logging.NullHandler()  # without any handler, logging itself prints to stderr
    logger.addHandler(silent)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            warnings.filterwarnings("error", message="string or file could not be read")
            yield
    finally:
        logger.propagate = before
        logger.removeHandler(silent)


class Beside:
    """trimesh's resolver for files that the model names: only those in its folder, and every failure is noted."""

    def __init__(self, folder: Path, notes: list[str]) -> None:
        self.folder = folder
        self.notes = notes

    def __getitem__(self, name: str) -> bytes:
        return self.get(name)

    def get(self, name: str) -> bytes:
        """Bytes of the file `name`."""
        wanted = name.strip().strip('"').replace("\\", "/")
        if wanted.startswith("-"):
            wanted = wanted.split()[-1]  # options of map_Kd come first
        if wanted.startswith("/") or re.match(r"[A-Za-z]:", wanted):
            wanted = wanted.rsplit("/", 1)[-1]  # a path on its author's machine
        local = os.path.normpath(wanted)
        path = self.folder / local
        if Path(local).parts[:1] == (os.pardir,) or not path.is_file():
            reason = "is outside the model's folder" if local.startswith("..") else "is missing"
            self.notes.append(f"the file {name!r} that it names {reason}: drawn without it")
            raise FileNotFoundError(name)
        data = path.read_bytes()
        if path.suffix.lower() == ".mtl":
            return _utf8(data)
        self._check_image(name, data)
        return data

    def _check_image(self, name: str, data: bytes) -> None:
        from PIL import Image, UnidentifiedImageError

        try:
            Image.open(io.BytesIO(data))
        except (UnidentifiedImageError, OSError, ValueError) as error:
            self.notes.append(f"the image {name!r} cannot be decoded: drawn without it")
            raise FileNotFoundError(name) from error


def _check_obj(data: bytes, notes: list[str]) -> bytes:
    zero = ZERO_FACE.search(data)
    if zero is not None:
        raise SceneError(f"the face {_text(zero.group())} uses index 0; indices of OBJ begin at 1")
    short = len(SHORT_FACE.findall(data))
    if short:
        notes.append(f"{short} face(s) with fewer than 3 corners left out")
    data = _utf8(data)
    return _absolute(data) if RELATIVE_FACE.search(data) else data


def _utf8(data: bytes) -> bytes:
    """Text with names and comments of older exporters in UTF-8; trimesh would want another package to guess their code."""
    try:
        data.decode("utf-8")
    except UnicodeDecodeError:
        return data.decode("latin-1").encode("utf-8")
    return data


def _absolute(data: bytes) -> bytes:
    """The OBJ with relative (negative) indices made absolute: they count back from the line they are on."""
    counts = {b"v": 0, b"vt": 0, b"vn": 0}
    lines = data.replace(b"\\\n", b" ").splitlines()
    for number, line in enumerate(lines):
        key, _, rest = line.strip().partition(b" ")
        if key in counts:
            counts[key] += 1
        elif key == b"f" and b"-" in rest:
            totals = tuple(counts.values())
            corners = (
                b"/".join(_from_start(*pair, line) for pair in zip(corner.split(b"/"), totals, strict=False))
                for corner in rest.partition(b"#")[0].split()
            )
            lines[number] = b"f " + b" ".join(corners)
    return b"\n".join(lines)


def _from_start(index: bytes, total: int, line: bytes) -> bytes:
    if not index.startswith(b"-"):
        return index
    absolute = total + 1 + int(index)
    if absolute < 1:
        raise SceneError(f"the face {_text(line)} counts back beyond the first of {total} elements")
    return str(absolute).encode()


def _text(line: bytes) -> str:
    return repr(line[:60].decode(errors="replace"))


def _check_ply(data: bytes, _: list[str]) -> bytes:
    head, end, body = data.partition(b"end_header")
    if not data.startswith(b"ply") or not end:
        raise SceneError("not a PLY file: it must begin with 'ply' and have a header that ends with 'end_header'")
    lines = [line.split() for line in head.decode("latin-1").splitlines()]
    text = any(line[:2] == ["format", "ascii"] for line in lines)
    needed, length = len(head), 0
    for line in lines:
        if line[:1] == ["element"] and len(line) == 3 and line[2].isdigit():
            length = int(line[2])
        elif line[:1] == ["property"] and len(line) >= 3:
            # a list has at least its count; a number in text at least a digit and a separator
            needed += length * (2 if text else PLY_SIZES.get(line[2 if line[1] == "list" else 1], 1))
    _enough(data, needed - 1)
    return _utf8(head) + end + body


def _check_off(data: bytes, _: list[str]) -> bytes:
    words = re.sub(rb"#[^\n]*", b"", data[:4096]).split()
    head = next((at for at, word in enumerate(words) if word.endswith(b"OFF")), None)
    counts = words[head + 1 : head + 3] if head is not None else []
    if len(counts) < 2 or not all(word.isdigit() for word in counts):
        raise SceneError("not an OFF file: it must begin with 'OFF' and the numbers of vertices, faces and edges")
    vertices, faces = (int(word) for word in counts)
    _enough(data, 6 * vertices + 4 * faces - 1)  # "0 0 0\n", and "1 0\n" for the smallest face
    return _utf8(data)


def _check_stl(data: bytes, _: list[str]) -> bytes:
    if len(data) >= 84:
        facets = int.from_bytes(data[80:84], "little")
        if len(data) == 84 + 50 * facets:
            return data
    text = b"facet" in data[:100_000] or data.lstrip().startswith(b"solid")
    if not text or b"\0" in data.rstrip(b"\0"):
        declared = int.from_bytes(data[80:84], "little") if len(data) >= 84 else 0
        raise SceneError(
            f"broken STL: its header declares {declared} facets, {84 + 50 * declared} bytes, but the file has "
            f"{len(data)}; "
            "export or download it again"
        )
    return _utf8(data)


def _enough(data: bytes, needed: int) -> None:
    if needed > len(data):
        raise SceneError(
            f"its header declares more than the file can hold: at least {needed} bytes, but there are {len(data)}; "
            "it is cut off or broken"
        )


def _drop_broken_facets(part: dict[str, Any], notes: list[str]) -> None:
    """Facets of STL share no vertices: one with a coordinate that is not finite is left out alone."""
    corners = np.asarray(part.get("vertices", np.zeros((0, 3)))).reshape(-1, 3, 3)
    good = np.isfinite(corners).all(axis=(1, 2))
    if good.all():
        return
    notes.append(f"{int((~good).sum())} of {len(good)} facets left out: their coordinates are not finite")
    part["vertices"] = corners[good].reshape(-1, 3)
    part["faces"] = np.arange(3 * int(good.sum())).reshape(-1, 3)


def _check_facets(data: bytes, drawn: int, notes: list[str]) -> None:
    declared = int.from_bytes(data[80:84], "little")
    if len(data) >= 84 and len(data) == 84 + 50 * declared:
        return
    written = len(re.findall(rb"(?i)\bendfacet\b", data))
    if drawn < written and not any("facets left out" in note for note in notes):
        notes.append(f"{written - drawn} of {written} facets left out: they could not be read")
