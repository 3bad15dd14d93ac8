"""Reads OFF with its variants: counts on the first line, colours, normals, texture coordinates, polygons."""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np

from glshadow.core.spaces import Array
from glshadow.errors import SceneError
from glshadow.io.clouds import Loose
from glshadow.io.imported import srgb_colors
from glshadow.io.limits import Budget
from glshadow.io.mesh_files.beside import Beside
from glshadow.io.mesh_files.soup import Soup, Table
from glshadow.io.mesh_files.words import COMMENT, Indices, all_numbers, rows, text_of, words_per_line

# letters before OFF are vertex attributes: ST texture coordinates, C colour, N normal; 4 and n are other dimensions than three
HEADER = re.compile(rb"\s*(?:([A-Za-z0-9]*?)OFF(?![A-Za-z])(?:[ \t]+(BINARY)\b)?)?")
VARIANT = re.compile(rb"(ST)?(C)?(N)?\Z")
COUNTS = re.compile(rb"\s*(\d{1,18})\s+(\d{1,18})(?:[ \t]+\d+)?(?=\s|\Z)")
WIDEST = 12  # numbers per vertex: position, normal, colour with alpha, texture coordinates


def read_off(data: bytes, _: Beside, notes: list[str], budget: Budget) -> Soup:
    """Read the polygons of an OFF file; vertices alone are points.

    Colours are sRGB: bytes if all of them are integers and one is above 1, otherwise numbers from 0 to 1.

    Raises
    ------
    SceneError
        If it is not a three-dimensional OFF file, or declares more than it contains.
    """
    text = COMMENT.sub(b"", text_of(data)) if b"#" in data else text_of(data)
    head = HEADER.match(text)
    found = COUNTS.match(text, head.end() if head else 0)
    if head is None or found is None:
        raise SceneError("not an OFF file: it must begin with 'OFF' and the numbers of vertices, faces and edges")
    variant = VARIANT.match(head.group(1) or b"")
    if variant is None or head.group(2):
        raise SceneError(
            f"OFF of the kind {head.group().decode().strip()!r} is not read: only three dimensions, as text"
        )
    vertices, faces = int(found.group(1)), int(found.group(2))
    if 6 * vertices + 4 * faces - 1 > len(data):  # "0 0 0\n", and "1 0\n" for the smallest face
        raise SceneError(
            f"its header declares more than the file can hold: {vertices} vertices and {faces} faces in {len(data)} bytes; "
            "it is cut off or broken"
        )
    budget.take(10 * len(text), "its numbers")  # a number of two letters: as float64 and as a word (measured: 8)
    lines = _lines(text[found.end() :])
    return _soup(lines, (vertices, faces), variant.group(3) is not None, variant.group(1) is not None, notes)


@dataclass
class _Numbers:
    """All numbers (N,) after the header, and their count on each line that is not empty (L,)."""

    values: Array
    counts: Indices


def _lines(text: bytes) -> _Numbers:
    return _Numbers(all_numbers(text, "a line"), words_per_line(text))


def _soup(lines: _Numbers, size: tuple[int, int], has_normal: bool, has_uv: bool, notes: list[str]) -> Soup:
    vertices, faces = size
    if len(lines.counts) < vertices + faces or (lines.counts[:vertices] < 3).any():
        lines = _unwrapped(lines.values, size)  # numbers that continue over the ends of lines
    of_vertices = lines.counts[:vertices]
    end = int(of_vertices.sum())
    width = min(int(of_vertices.max()), WIDEST) if vertices else 3
    table = rows(lines.values[:end], of_vertices, width)
    normals = Table(table[:, 3:6]) if has_normal and width >= 6 else None
    at = 6 if normals is not None else 3
    uv = Table(table[:, -2:]) if has_uv and width >= at + 2 else None
    colors = _colors(table[:, at : width - 2 if uv is not None else width], "its vertices", notes)
    counts = lines.counts[vertices : vertices + faces]
    values = lines.values[end : end + int(counts.sum())]
    starts = np.cumsum(counts) - counts
    with np.errstate(invalid="ignore"):  # NaN as a number of corners is refused below
        corners = values[starts].astype(np.int64)
    if not (corners == values[starts]).all() or (corners < 0).any() or (corners >= counts).any():
        raise SceneError("a face does not have as many corners as it declares; it is cut off or broken")
    column = np.arange(len(values)) - np.repeat(starts, counts)
    of_face = np.repeat(corners, counts)
    indices = values[(column >= 1) & (column <= of_face)]
    if not (np.abs(indices) < 2**53).all() or (indices != np.floor(indices)).any():
        raise SceneError("a face refers to a vertex index that is not an integer")
    behind = counts - 1 - corners
    rest = rows(values[column > of_face], behind, 4 if behind.any() else 0)
    return Soup(
        table[:, :3],
        indices.astype(np.int64),
        corners,
        colors=colors,
        face_colors=_colors(rest, "its faces", notes),
        normals=normals,
        uv=uv,
        loose=[] if faces else [Loose(points=np.arange(vertices))],
    )


def _unwrapped(values: Array, size: tuple[int, int]) -> _Numbers:
    """The same numbers in lines: three per vertex, and for each face its declared count."""
    vertices, faces = size
    counts, at = [3] * vertices, 3 * vertices
    for _ in range(faces):
        if at >= len(values) or not 0 <= values[at] < len(values) - at:
            raise SceneError(
                f"it declares {faces} faces, but ends within them, or one has {_shown(values, at)} corners"
            )
        counts.append(1 + int(values[at]))
        at += counts[-1]
    return _Numbers(values, np.array(counts, dtype=np.int64))


def _shown(values: Array, at: int) -> str:
    return f"{values[at]:g}" if at < len(values) else "no"


def _colors(columns: Array, where: str, notes: list[str]) -> Array | None:
    """Linear RGBA of rows (N, K), with NaN for missing numbers. Fewer than three numbers are an index into a table that does not exist."""
    if columns.shape[1] < 3 or np.isnan(columns[:, :3]).any(axis=1).all():
        return None
    missing = np.isnan(columns[:, :3]).any(axis=1)
    stored = columns[~missing, :4]
    whole = bool((np.nan_to_num(stored) == np.floor(np.nan_to_num(stored))).all()) and bool(np.nanmax(stored) > 1.0)
    given = columns[:, :4] / (255.0 if whole else 1.0)
    given[missing] = 1.0
    if given.shape[1] == 4:
        given[np.isnan(given[:, 3]), 3] = 1.0
    return srgb_colors(given, where, notes)
