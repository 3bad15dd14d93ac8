"""Reads Wavefront OBJ: lines are classified by their key for a whole block at once; statements between them one by one."""

from __future__ import annotations

import re
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from glshadow.core.spaces import Array
from glshadow.errors import SceneError
from glshadow.io.clouds import Loose
from glshadow.io.imported import WHITE, srgb_colors
from glshadow.io.limits import Budget
from glshadow.io.mesh_files.beside import Beside
from glshadow.io.mesh_files.loose import ObjLoose
from glshadow.io.mesh_files.mtl import Library
from glshadow.io.mesh_files.obj_parts import Statement, assign
from glshadow.io.mesh_files.soup import Soup, Table
from glshadow.io.mesh_files.words import (
    COMMENT,
    NEWLINE,
    Indices,
    blocks,
    first_letters,
    name_of,
    numbers,
    per_line,
    rows,
    shown,
    text_of,
    whole_numbers,
)

INDENT = re.compile(rb"^[ \t]+", re.MULTILINE)
NO_INDEX = re.compile(rb"/(?=[/\s])")  # "1//2", "1/"
NO_COLOR = -1.0
CURVES = (b"curv", b"curv2", b"surf")
NOWHERE = 1 << 40  # an index behind all
# numbers that are read; a vertex with 6 has a colour, one with 4 a weight, which is ignored
WIDTHS = {
    "v": 6,
    "vt": 2,
    "vn": 3,
}


@dataclass
class Lines:
    """Content read so far.

    `tables`: numbers of `v`, `vt` and `vn`, block by block; `indices` (3, C) from 0, -1 for none; `statements`: the number of faces
    before each `usemtl`, `o`, `g` and `s`, with the name that follows; `broken`: what is not drawn, once for each kind.
    """

    tables: dict[str, list[Array]] = field(default_factory=lambda: {"v": [], "vt": [], "vn": []})
    totals: dict[str, int] = field(default_factory=lambda: {"v": 0, "vt": 0, "vn": 0})
    indices: list[Indices] = field(default_factory=list)
    counts: list[Indices] = field(default_factory=list)
    faces: int = 0
    statements: list[Statement] = field(default_factory=list)
    libraries: list[str] = field(default_factory=list)
    broken: dict[str, str] = field(default_factory=dict)


def read_obj(data: bytes, beside: Beside, notes: list[str], budget: Budget) -> Soup:
    """Read the polygons of an OBJ file; a part per object, group and material; and its points and lines. Vertices alone are points.

    Vertex colours (`v x y z r g b`) are sRGB, as in trimesh and Blender; values above 1 are bytes.

    Raises
    ------
    SceneError
        If numbers or indices cannot be read.
    """
    found, loose = Lines(), ObjLoose()
    for block in blocks(text_of(data).replace(b"\\\n", b" ")):
        budget.check_time("its lines")
        budget.take(8 * len(block), "its lines")  # numbers, indices and triangles per byte of text (measured: 6)
        loose.read(block, found.totals["v"])
        _read_block(INDENT.sub(b"", block), found)
    positions = _joined(found.tables["v"])
    indices = np.concatenate([np.zeros((3, 0), dtype=np.int64), *found.indices], axis=1)
    soup = Soup(
        positions[:, :3],
        indices[0],
        np.concatenate([np.zeros(0, dtype=np.int64), *found.counts]),
        colors=_colors(positions, notes),
        uv=Table(_joined(found.tables["vt"]), indices[1]),
        normals=Table(_joined(found.tables["vn"]), indices[2]),
    )
    library = Library(beside, notes)
    for statement in dict.fromkeys(found.libraries):
        library.add(statement)
    assign(soup, found.statements, library)
    soup.loose = loose.made(lambda name: library.part(name).material if name else WHITE)
    if found.faces == 0 and not soup.loose and len(positions):  # a point cloud
        soup.loose = [Loose(points=np.arange(len(positions)))]
    notes += found.broken.values()
    library.note_left_out()
    return soup


def _joined(tables: list[Array]) -> Array:
    """Tables concatenated by rows; narrower ones are filled with NO_COLOR."""
    width = max((table.shape[1] for table in tables), default=3)
    wide = [np.pad(table, ((0, 0), (0, width - table.shape[1])), constant_values=NO_COLOR) for table in tables]
    return np.concatenate([np.zeros((0, width)), *wide])


def _colors(vertices: Array, notes: list[str]) -> Array | None:
    """Linear RGBA (V, 4) of vertices (V, 3 or 6): sRGB from 0 to 1, or bytes if a value is larger; white where there is none."""
    given = vertices[:, 3:]
    if given.shape[1] == 0:
        return None
    colored = given[:, 0] != NO_COLOR
    steps = 255.0 if float(np.fmax.reduce(given, axis=None)) > 1.0 + 1e-6 else 1.0
    return srgb_colors(np.where(colored[:, None], given / steps, 1.0), "its vertices", notes)


def _read_block(block: bytes, found: Lines) -> None:
    letters = np.frombuffer(block, dtype=np.uint8).copy()
    ends = np.flatnonzero(letters == NEWLINE)
    starts = np.concatenate([[0], ends[:-1] + 1])
    first, second, third = (letters[np.minimum(starts + k, ends)] for k in range(3))
    kinds = {
        "v": (first == ord("v")) & (second <= 32),
        "vt": (first == ord("v")) & (second == ord("t")) & (third <= 32),
        "vn": (first == ord("v")) & (second == ord("n")) & (third <= 32),
        "f": (first == ord("f")) & (second <= 32),
    }
    lengths = ends - starts + 1
    before = {key: found.totals[key] + np.cumsum(kinds[key])[kinds["f"]] for key in WIDTHS}
    for key, kind in kinds.items():
        at = starts[kind]
        letters[at] = 32
        if len(key) == 2:
            letters[at + 1] = 32
        text = letters[np.repeat(kind, lengths)].tobytes()
        if not text:
            continue
        text = COMMENT.sub(b"", text) if b"#" in text else text
        counts = per_line(text)
        if key == "f":
            found.indices.append(_corners(text, counts, before, found.broken))
            found.counts.append(counts)
        else:
            colored = counts >= WIDTHS["v"] if key == "v" else counts < 0
            table = rows(
                numbers(text, f"a line that begins with {key!r}"),
                counts,
                WIDTHS[key] if colored.any() or key != "v" else 3,
            )
            table[~colored, 3:] = NO_COLOR
            found.tables[key].append(table)
            found.totals[key] += len(counts)
    _read_statements(block, (first, starts, ends), found.faces + np.cumsum(kinds["f"]), found)
    found.faces += int(kinds["f"].sum())


def _corners(text: bytes, counts: Indices, before: dict[str, Indices], broken: dict[str, str]) -> Indices:
    """Indices (3, C) into `v`, `vt` and `vn`, from 0, -1 for none, of the corners of faces with `counts` (N,) corners; of a `v` that is
    not there -1, of others NOWHERE."""
    total = int(counts.sum())
    found = np.zeros((3, total), dtype=np.int64)
    if b"/" in text:
        text = NO_INDEX.sub(b"/0", text)
        corner = np.cumsum(first_letters(text)) - 1
        slashes = np.bincount(corner[np.frombuffer(text, dtype=np.uint8) == ord("/")], minlength=total)
        values = whole_numbers(text.replace(b"/", b" "), "a face")
        if len(values) != total + int(slashes.sum()):
            raise SceneError("a face has a corner without a vertex")
        place = np.cumsum(slashes + 1) - (slashes + 1)
        for k in range(3):
            has = slashes >= k
            found[k, has] = values[place[has] + k]
    else:
        found[0] = whole_numbers(text, "a face")
    if (found[0] == 0).any():
        line = _line(text, counts, int((found[0] == 0).argmax()))
        broken.setdefault("zero", f"the face {line} uses index 0; indices of OBJ begin at 1")
    relative = found < 0
    if relative.any():  # relative indices count back from their line
        totals = np.stack([np.repeat(before[key], counts) for key in WIDTHS])
        found = np.where(relative, totals + found + 1, found)
        beyond = relative & (found < 1)
        if beyond.any():
            kind, at = np.argwhere(beyond)[0].tolist()
            line = _line(text, counts, at)
            broken.setdefault(
                "relative", f"the face {line} counts back beyond the first of {int(totals[kind, at])} elements"
            )
            found = np.where(beyond, np.array([0, NOWHERE, NOWHERE])[:, None], found)
    return found - 1


def _line(text: bytes, counts: Indices, corner: int) -> str:
    """The line of a corner, for messages."""
    number = int(np.searchsorted(np.cumsum(counts), corner, side="right"))
    return shown(b"f " + text.split(b"\n")[number].strip())


def _read_statements(
    block: bytes, lines: tuple[NDArray[np.uint8], Indices, Indices], faces: Indices, found: Lines
) -> None:
    """Read the statements between elements; `faces` (L,): number of faces before the end of each line."""
    first, starts, ends = lines
    for number in np.flatnonzero(np.isin(first, np.frombuffer(b"umogsc", dtype=np.uint8))).tolist():
        key, _, rest = block[starts[number] : ends[number]].replace(b"\t", b" ").partition(b" ")
        if key in (b"usemtl", b"o", b"g", b"s"):
            found.statements.append((int(faces[number]), key.decode(), name_of(rest.strip())))
        elif key in CURVES:
            found.broken.setdefault("curves", "its curves and surfaces (curv, curv2, surf) are not drawn")
        elif key == b"mtllib":
            found.libraries.append(name_of(rest.strip()))
