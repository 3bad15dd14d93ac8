"""Reads PyVista's PolyData and PointSet, grids (by their surface) and MultiBlock as nodes of meshes, points and lines."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshadow.core.spaces import Array
from glshadow.errors import SceneError
from glshadow.io.builder import Builder
from glshadow.io.clouds import chained, existing, lines_of, points_of
from glshadow.io.imported import Imported, srgb_colors
from glshadow.io.limits import Budget, Limits
from glshadow.io.polygons import triangulated
from glshadow.scene.mesh import Mesh
from glshadow.scene.nodes import Node

COLOR_NAMES = ("rgb", "rgba", "color", "colors")
MOST_BLOCKS = 10**6
UNLIMITED = Limits(triangles=2**62, expansion=1e12, seconds=1e9)  # objects in memory are not limited

Indices = NDArray[np.int64]


def read_pyvista(source: Any) -> Imported:
    """Read a PyVista dataset or MultiBlock.

    Colours are arrays of bytes (N, 3 or 4): the active scalars, or an array that is named RGB, RGBA, color or colors; of points, or else
    of cells. Other scalars would need a colour map and are noted. Stored normals and texture coordinates are kept.

    Raises
    ------
    SceneError
        If it has neither polygons nor lines nor points.
    """
    builder = Builder()
    found = Imported(notes=builder.notes)
    for name, block in _blocks(source):
        surface = _surface(block, name)
        mesh = _mesh(builder, surface, name)
        made = [(mesh, name), *_loose(builder, surface, name)]
        found.nodes += [Node(each, np.eye(4), title) for each, title in made if each is not None]
    if not found.nodes:
        raise SceneError("nothing to render: it has no polygons, lines or points")
    return found


def _blocks(source: Any) -> Iterator[tuple[str, Any]]:
    """Datasets of a MultiBlock with their names, joined by slashes; empty blocks are left out."""
    waiting = [("", source)]
    for _ in range(MOST_BLOCKS):
        if not waiting:
            return
        name, block = waiting.pop()
        if hasattr(block, "n_blocks"):
            inner = [(str(block.get_block_name(k) or f"block{k}"), block[k]) for k in range(block.n_blocks)]
            waiting += [(f"{name}/{own}" if name else own, each) for own, each in reversed(inner)]
        elif block is not None:
            yield name or "mesh", block
    raise SceneError(f"a MultiBlock may have at most {MOST_BLOCKS} blocks")


def _surface(block: Any, name: str) -> Any:
    """The block, or of one with cells of volume its surface."""
    if hasattr(block, "faces"):
        return block
    if type(block).__name__ == "PointSet":  # has no cells
        return block.cast_to_polydata(deep=False)
    if not hasattr(block, "extract_surface"):
        raise SceneError(f"{name}: a pyvista.{type(block).__name__} has no surface")
    try:
        return block.extract_surface(algorithm="dataset_surface")
    except TypeError:  # before 0.47 it takes no algorithm
        return block.extract_surface()


def _mesh(builder: Builder, surface: Any, name: str) -> Mesh | None:
    positions = np.asarray(surface.points, dtype=np.float64)
    corners, counts = _cells(surface.faces)
    strips, lengths = _cells(getattr(surface, "strips", ()))
    if len(corners) + len(strips) == 0:
        return None
    _check_range(np.concatenate([corners, strips]), len(positions), name)
    local, polygon = triangulated(positions, corners, counts, builder.notes, Budget(UNLIMITED))
    triangles = [corners[local]]
    owners = [polygon]
    for number, (start, length) in enumerate(zip(np.cumsum(lengths) - lengths, lengths, strict=True)):
        strip = _strip(strips[start : start + length])
        triangles.append(strip)
        owners.append(np.full(len(strip), len(counts) + number))
    colors, face_colors = _colors(builder, surface, name)
    if face_colors is not None:
        before = sum(len(_cells(getattr(surface, kind, ()))[1]) for kind in ("verts", "lines"))
        cells = before + np.concatenate(owners)  # VTK numbers points, lines, polygons, strips
        if len(face_colors) <= cells.max(initial=0):
            raise SceneError(f"{name}: {len(face_colors)} colours of cells for {int(cells.max()) + 1} cells")
        face_colors = face_colors[cells]
    normals = getattr(surface.point_data, "active_normals", None)
    return builder.mesh(
        positions,
        np.concatenate(triangles),
        name=name,
        normals=None if normals is None else np.asarray(normals),
        colors=colors,
        face_colors=face_colors,
        uv=_uv(surface),
    )


def _loose(builder: Builder, surface: Any, name: str) -> list[tuple[Mesh | None, str]]:
    """Cells of points and lines, with their names: those of a dataset without a name are `points` and `lines`."""
    positions = np.asarray(surface.points, dtype=np.float64)
    (points, sizes), (lines, lengths) = (_cells(getattr(surface, kind, ())) for kind in ("verts", "lines"))
    if len(points) + len(lines) == 0:
        return []
    notes: list[str] = []  # that colours cannot be used is noted with the polygons, if there are any
    colors, cell_colors = _colors(replace(builder, notes=notes), surface, name)
    if not len(surface.faces):
        builder.notes += notes
    made: list[tuple[Mesh | None, str]] = []
    for kind, corners, counts, before in (("points", points, sizes, 0), ("lines", lines, lengths, len(sizes))):
        kept = existing(corners[:, None], len(positions), f"{name}: ", kind, builder.notes)[:, 0]
        if kind == "lines" and len(kept) < len(corners):
            raise SceneError(f"{name}: a line refers to a vertex that is not there")
        own = None if colors is None else colors[kept]
        if cell_colors is not None and len(kept) == len(corners):
            own = np.repeat(cell_colors[before : before + len(counts)], counts, axis=0)
        linear = None if own is None else srgb_colors(own, name, builder.notes)
        title = kind if name == "mesh" else name
        if kind == "points":
            made.append((points_of(positions[kept], linear, name, builder.notes), title))
        else:
            made.append((lines_of(positions[kept], chained(counts), linear, name, builder.notes), title))
    return made


def _cells(flat: Any) -> tuple[Indices, Indices]:
    """Vertex indices of cells and the length of each, from VTK's list: length, indices, length, indices, ..."""
    cells = np.asarray(flat, dtype=np.int64).ravel()
    if not len(cells):
        return cells, cells
    first = int(cells[0])
    if first >= 0 and len(cells) % (first + 1) == 0 and (cells[:: first + 1] == first).all():
        return cells.reshape(-1, first + 1)[:, 1:].ravel(), np.full(len(cells) // (first + 1), first)
    starts, at = [], 0
    stored = cells.tolist()
    while at < len(stored):
        starts.append(at)
        at += 1 + max(stored[at], 0)
    inside = np.ones(len(cells), dtype=bool)
    inside[starts] = False
    counts = cells[starts]
    if at != len(stored) or (counts < 0).any():
        raise SceneError("its cells are broken: a length reaches beyond the end")
    return cells[inside], counts


def _strip(corners: Indices) -> Indices:
    triangles = np.stack([corners[:-2], corners[1:-1], corners[2:]], axis=1)
    triangles[1::2] = triangles[1::2][:, [0, 2, 1]]  # every second one is wound the other way
    return triangles


def _check_range(corners: Indices, count: int, name: str) -> None:
    if corners.min() < 0 or corners.max() >= count:
        worst = int(corners.max() if corners.max() >= count else corners.min())
        raise SceneError(f"{name}: a face refers to vertex {worst}, but there are {count}")


def _colors(builder: Builder, surface: Any, name: str) -> tuple[NDArray[Any] | None, NDArray[Any] | None]:
    """Colours of points or of cells, as stored; notes active scalars that are not colours."""
    other = None
    for place, data in enumerate((surface.point_data, surface.cell_data)):
        active = getattr(data, "active_scalars_name", None)
        names = ([] if active is None else [active]) + [each for each in data if str(each).lower() in COLOR_NAMES]
        for each in names:
            values = np.asarray(data[each])
            if _is_color(values, str(each)):
                return (values, None) if place == 0 else (None, values)
        other = other or active
    if other is not None and other == getattr(surface, "active_scalars_name", other):
        builder.notes.append(
            f"{name}: its scalars {other!r} are not colours (bytes, 3 or 4 a point or cell): drawn without them; "
            "map them to colours first, for example with matplotlib"
        )
    return None, None


def _is_color(values: NDArray[Any], name: str) -> bool:
    if values.ndim != 2 or values.shape[1] not in (3, 4):
        return False
    return values.dtype == np.uint8 or (name.lower() in COLOR_NAMES and values.dtype.kind == "f")


def _uv(surface: Any) -> Array | None:
    given = getattr(surface, "active_texture_coordinates", getattr(surface, "active_t_coords", None))
    return None if given is None else np.asarray(given, dtype=np.float64)
