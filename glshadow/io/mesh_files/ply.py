"""Reads PLY, text and binary: vertices, faces, triangle strips, colours, normals, texture coordinates, edges, and points."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from glshadow.core.spaces import Array
from glshadow.errors import SceneError
from glshadow.io.clouds import Loose
from glshadow.io.imported import WHITE, srgb_colors
from glshadow.io.limits import Budget
from glshadow.io.mesh_files.beside import Beside
from glshadow.io.mesh_files.ply_rows import Columns, Element, Field, Ragged, read_elements, without_surplus
from glshadow.io.mesh_files.soup import Part, Soup, Table
from glshadow.io.mesh_files.words import Indices, all_numbers, name_of, text_of, words_per_line

TYPES = {"char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4", "float": "f4"}
TYPES |= {"int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2", "int32": "i4", "uint32": "u4", "int64": "i8"}
TYPES |= {"uint64": "u8", "float16": "f2", "float32": "f4", "float64": "f8", "double": "f8"}
ORDERS = {"ascii": "<", "binary_little_endian": "<", "binary_big_endian": ">"}
INDICES = ("vertex_indices", "vertex_index")
UVS = (("s", "t"), ("u", "v"), ("texture_u", "texture_v"))
COLORS = (
    ("red", "green", "blue", "alpha"),
    ("diffuse_red", "diffuse_green", "diffuse_blue", "diffuse_alpha"),
    ("r", "g", "b", "a"),
)
SPLATS = ("f_dc_0", "f_dc_1", "f_dc_2")
PICTURE = re.compile(r"comment\s+TextureFile\s+(.+)", re.IGNORECASE)
SURFACES = ("face", "tristrips")
"""Elements of which a file with triangles has some, even if it is cut off before they begin: its vertices are then no points."""
HEADER = re.compile(rb"ply[ \t]*(\r\n|\r|\n)(?:.*?\1)?end_header[ \t]*(?:\1|(?P<rest>\r\n|\n)|\Z)", re.DOTALL)
STATEMENTS = ("format", "element", "property", "end_header", "ply")
LONGEST = 1 << 20  # bytes of a header


def read_ply(data: bytes, beside: Beside, notes: list[str], budget: Budget) -> Soup:
    """Read the polygons of a PLY file: its faces, then its strips.

    Colours are sRGB: integers scaled by the range of 8 or 16 bits, others from 0 to 1.

    Of a file that is cut off, what is there is read.

    Raises
    ------
    SceneError
        If its header cannot be read.
    """
    found = HEADER.match(data[:LONGEST])
    if found is None:
        raise SceneError("not a PLY file: it must begin with 'ply' and have a header that ends with 'end_header'")
    header = name_of(text_of(found.group())).splitlines()
    elements, text = _elements(header, notes)
    # as float64 and int64, from numbers of four bytes or two letters (measured: 6)
    budget.take(8 * len(data), "its numbers")
    if text:
        body = text_of(data[found.end() :])
        values, misread = without_surplus(all_numbers(body, "a row"), words_per_line(body), elements, notes)
        rows = [replace(element, fields=tuple(_as_text(field) for field in element.fields)) for element in elements]
        columns = read_elements(values.view(np.uint8), rows, notes, budget)
        for element, name in misread:
            columns[element].pop(name, None)  # gone already if two elements have that name
    else:
        columns = read_elements(np.frombuffer(data, dtype=np.uint8)[found.end() :], elements, notes, budget)
    declared = {element.name: {field.name: field.kind for field in element.fields} for element in elements}
    soup = _soup(columns, declared, notes)
    if len(soup.corners) == 0 and not soup.loose and not any(each.count for each in elements if each.name in SURFACES):
        soup.loose.append(Loose(points=np.arange(len(soup.positions))))
    _assign_pictures(
        soup, [m.group(1).strip() for m in map(PICTURE.match, header) if m], columns.get("face", {}), beside
    )
    return soup


def _as_text(field: Field) -> Field:
    """In text, all numbers have the same type once they are read."""
    double = np.dtype(np.float64)
    return Field(field.name, double, None if field.length is None else double)


def _elements(header: list[str], notes: list[str]) -> tuple[list[Element], bool]:
    """The header's elements, and whether the rows are text. A line with an unknown first word is skipped with a note."""
    order: str | None = None
    found: list[tuple[str, int, list[Field]]] = []
    for line in header[1:-1]:
        words = line.split()
        try:
            match words:
                case ["format", name, *_]:
                    order = name
                case ["element", name, count]:
                    found.append((name, int(count), []))
                case ["property", "list", length, kind, name]:
                    found[-1][2].append(Field(name, _kind(order, kind), _kind(order, length)))
                case ["property", kind, name]:
                    found[-1][2].append(Field(name, _kind(order, kind)))
                case []:
                    pass
                case [word, *_] if word in STATEMENTS:
                    raise ValueError
                case [word, *_] if word not in ("comment", "obj_info"):
                    notes.append(f"the line {line[:60]!r} of its header is not a statement of PLY: skipped")
        except (KeyError, ValueError, IndexError):
            raise SceneError(f"the line {line[:60]!r} of its header cannot be understood") from None
    if order not in ORDERS or any(count < 0 for _, count, _ in found):
        raise SceneError(
            f"its header must name one of the formats {', '.join(ORDERS)}, and no negative number of elements"
        )
    return [Element(name, count, tuple(fields)) for name, count, fields in found], order == "ascii"


def _kind(order: str | None, name: str) -> np.dtype[np.generic]:
    return np.dtype(ORDERS[order or ""] + TYPES[name])


def _soup(columns: dict[str, Columns], declared: dict[str, dict[str, np.dtype[np.generic]]], notes: list[str]) -> Soup:
    vertex, face = columns.get("vertex", {}), columns.get("face", {})
    positions = _stacked(vertex, ("x", "y", "z"))
    if positions is None:
        positions = np.zeros((0, 3))
    normals, uv = _stacked(vertex, ("nx", "ny", "nz")), None
    for names in UVS:
        uv = _stacked(vertex, names) if uv is None else uv
    corners, counts = _lists(face)
    soup = Soup(
        positions,
        corners,
        counts,
        colors=_colors(vertex, declared.get("vertex", {}), "its vertices", notes),
        face_colors=_colors(face, declared.get("face", {}), "its faces", notes) if len(counts) else None,
        normals=None if normals is None else Table(normals),
        uv=None if uv is None else Table(uv),
    )
    of_corners = face.get("texcoord")
    if isinstance(of_corners, Ragged) and np.array_equal(of_corners.counts, 2 * counts):
        soup.uv = Table(of_corners.values.reshape(-1, 2).astype(np.float64), np.arange(len(corners)))
    _add_strips(soup, *_lists(columns.get("tristrips", {})))
    splats = _stacked(vertex, SPLATS)
    if splats is not None and soup.colors is None:
        notes.append("its Gaussian splats are drawn as points of their base colours")
        base = np.clip(np.nan_to_num(0.5 + splats / np.sqrt(4.0 * np.pi)), 0.0, 1.0)  # spherical harmonics of degree 0
        soup.colors = srgb_colors(base, "its splats", notes)
    ends = _stacked(columns.get("edge", {}), ("vertex1", "vertex2"))
    if ends is not None and np.isfinite(ends).all():
        soup.loose.append(Loose(segments=ends.astype(np.int64)))
    return soup


def _stacked(columns: Columns, names: tuple[str, ...]) -> Array | None:
    """Columns (N, K) side by side; None if one is missing."""
    found = [columns.get(name) for name in names]
    with np.errstate(invalid="ignore"):  # signalling NaNs are handled like others
        plain = [column.astype(np.float64) for column in found if column is not None and not isinstance(column, Ragged)]
    return np.stack(plain, axis=1) if len(plain) == len(names) else None


def _lists(columns: Columns) -> tuple[Indices, Indices]:
    """Vertex indices of polygons or strips, and the count of each."""
    found = next((columns[name] for name in INDICES if name in columns), None)
    if not isinstance(found, Ragged):
        return np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64)
    if found.values.dtype.kind == "f":
        with np.errstate(invalid="ignore"):
            whole = np.abs(found.values) < 2**53
            whole &= found.values == np.floor(found.values)
        if not whole.all():
            raise SceneError("a face refers to a vertex index that is not an integer")
    return found.values.astype(np.int64), found.counts


def _add_strips(soup: Soup, values: Indices, counts: Indices) -> None:
    """Add the triangles of strips. A negative index, or the end of a row, begins a new strip."""
    if len(values) == 0:
        return
    values = np.insert(values, np.cumsum(counts)[:-1], -1)
    ends = values < 0
    place = np.arange(len(values))
    since = place - np.maximum.accumulate(np.where(ends, place, -1)) - 1
    triangles = np.stack([values[:-2], values[1:-1], values[2:]], axis=1)
    odd = since[:-2] % 2 == 1
    triangles[odd] = triangles[odd][:, [1, 0, 2]]
    a, b, c = triangles.T
    triangles = triangles[(triangles >= 0).all(axis=1) & (a != b) & (b != c) & (c != a)]
    soup.corners = np.concatenate([soup.corners, triangles.ravel()])
    soup.counts = np.concatenate([soup.counts, np.full(len(triangles), 3)])
    if soup.face_colors is not None:
        soup.face_colors = np.concatenate([soup.face_colors, np.ones((len(triangles), 4))])
    if soup.uv is not None and soup.uv.of is not None:
        soup.uv = Table(soup.uv.rows, np.concatenate([soup.uv.of, np.full(triangles.size, -1)]))


def _colors(columns: Columns, kinds: dict[str, np.dtype[np.generic]], where: str, notes: list[str]) -> Array | None:
    """Linear RGBA (N, 4)."""
    for names in COLORS:
        given = _stacked(columns, names[:3])
        if given is None:
            continue
        alpha = _stacked(columns, names[3:])
        color = given if alpha is None else np.concatenate([given, alpha], axis=1)
        return srgb_colors(color / _most(kinds[names[0]], color), where, notes)
    return None


def _most(kind: np.dtype[np.generic], colors: Array) -> float:
    """The value that stands for full colour."""
    if kind.kind == "f":
        return 255.0 if float(np.fmax.reduce(colors, axis=None, initial=0.0)) > 1.0 + 1e-6 else 1.0
    return 65535.0 if kind.itemsize == 2 else 255.0


def _assign_pictures(soup: Soup, names: list[str], face: Columns, beside: Beside) -> None:
    """Assign the textures that comments name: the first one to all faces, or as `texnumber` says."""
    if not names:
        return
    pictures: list[NDArray[np.uint8] | None] = [beside.picture(name) for name in names]
    several = len(names) > 1
    soup.parts = [
        Part(name if several else "mesh", WHITE if picture is None else replace(WHITE, texture=picture))
        for name, picture in zip(names, pictures, strict=True)
    ]
    number = face.get("texnumber")
    if several and number is not None and not isinstance(number, Ragged):
        part = np.zeros(len(soup.counts), dtype=np.int64)
        part[: len(number)] = np.clip(np.nan_to_num(number.astype(np.float64)), 0, len(names) - 1)
        soup.part = part
