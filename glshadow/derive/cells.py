"""Per-cell triangle lists, built on the CPU: the twin of glsl/lib/cells.glsl and glsl/pass/lists.comp, in float64."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from glshadow.core.spaces import Array
from glshadow.derive.lists import MOST, RATIO, ListGrid, facets
from glshadow.shadows.view import FACES

# Flags of a triangle, as in glsl/lib/traits.glsl.
CULL_BACK, CULL_FRONT, CASTS, CUT_OUT, ROUND = 1, 2, 4, 8, 16

# As in glsl/lib/cells.glsl, where the receiver's cell is rounded to float32; needed whatever precision the lists are built with.
_MARGIN, _WIDE_MARGIN = 1.0 / 64.0, 0.25  # cells
_FAR_OUT = 16.0  # sides of the grid
_SLACK = 0.25  # cells
_EDGE_ON = 1e-5  # cosine
_TOGETHER = 1 << 14  # triangles per batch, so that their arrays stay in the CPU cache

Indices = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class CellLists:
    """Lists of all cells, in the layout that glsl/exact/lists.glsl walks.

    Parameters
    ----------
    heads : (rows, cells) uint32
        First link + 1 of a cell's list, 0: empty. For each face its fine cells; after them the coarse cells of all faces.
    links : (L, 4) uint32
        Triangle, next link + 1, bits of its least depth (float32, world units), mask. The links of a list are consecutive, by triangle.
    facets : (T, 3, 4) float32
        `derive.lists.facets` of all triangles.
    count : int
        L; if it exceeds the limit, the links are omitted.
    """

    heads: NDArray[np.uint32]
    links: NDArray[np.uint32]
    facets: NDArray[np.float32]
    count: int


def cell_lists(
    grid: ListGrid,
    vertices: NDArray[np.float32],
    world: NDArray[np.float32],
    axes: Array,
    triangles: NDArray[np.integer],
    flags: NDArray[np.integer],
    masks: NDArray[np.integer],
    most: int,
) -> CellLists:
    """Sort triangles into the cells that they may overlap, seen from the light: fine cells, or coarse cells if these would be many.

    Conservative: a triangle that a ray from a receiver to the light hits is in the list of the receiver's fine or coarse cell. Cells
    are enlarged by more than the rounding error of the receiver's position in float32.

    Parameters
    ----------
    vertices : (V, 3) float32
        In the light's frame.
    world : (V, 3) float32
        The same relative to the scene's origin, world axes.
    axes : (3, 3) float64
        World axes to light axes; float32 values.
    triangles : (T, 3) ints
        Vertices of each.
    flags : (T,) ints
        CASTS, and which sides are culled.
    masks : (T,) ints
        1 + index among masked triangles; 0: not alpha-tested.
    most : int
        Limit of links.

    References
    ----------
    Wyman, Hoetzlein, Lefohn 2015, "Frustum-Traced Raster Shadows: Revisiting Irregular Z-Buffers", I3D.
    """
    made = np.zeros((len(triangles), 3, 4), dtype=np.float32)
    nearest = np.zeros((grid.faces, len(triangles)), dtype=np.float32)
    parts: list[NDArray[np.uint64]] = []
    count = 0
    for first in range(0, len(triangles), _TOGETHER):
        rows = slice(first, first + _TOGETHER)
        corners = vertices[triangles[rows]].astype(np.float64)
        made[rows] = facets(corners, world[triangles[rows]].astype(np.float64), axes)
        chosen = _casting(grid, corners, made[rows, :, 3].astype(np.float64), flags[rows])
        corners = np.ascontiguousarray(corners[chosen].transpose(2, 1, 0))
        for face in range(grid.faces):
            seen = np.tensordot(FACES[face], corners, 1) if grid.projection == "cube" else corners
            near = _near_window(grid, seen)
            items = first + chosen[near]
            shape = _footprint(grid, seen[:, :, near])
            nearest[face, items] = shape.nearest
            for cell, item in _cells(grid, shape, face):
                count += len(cell)
                if count <= most:
                    parts.append(cell.astype(np.uint64) << np.uint64(32) | items[item].astype(np.uint64))
    if count > most:
        return CellLists(np.zeros((0, 0), dtype=np.uint32), np.zeros((0, 4), dtype=np.uint32), made, count)
    return CellLists(*_linked(grid, parts, nearest, masks), made, count)


def _linked(
    grid: ListGrid, parts: list[NDArray[np.uint64]], nearest: NDArray[np.float32], masks: NDArray[np.integer]
) -> tuple[NDArray[np.uint32], NDArray[np.uint32]]:
    """Heads and links from pairs, which are consumed: a cell in the upper 32 bits, a triangle in the lower ones."""
    pairs = np.concatenate([*parts, np.zeros(0, dtype=np.uint64)])
    parts.clear()
    pairs.sort()
    cell, item = (pairs >> np.uint64(32)).astype(np.uint32), pairs.astype(np.uint32)
    del pairs
    side = grid.cells // RATIO
    heads = np.zeros((grid.faces * (grid.cells + side), grid.cells), dtype=np.uint32)
    begins = np.ones(len(cell), dtype=bool)
    begins[1:] = cell[1:] != cell[:-1]
    starts = np.flatnonzero(begins)
    heads.ravel()[cell[starts]] = starts + 1
    rows = np.repeat([grid.cells, side], grid.faces)  # of each face: fine cells, then coarse ones
    ends = np.searchsorted(cell, np.cumsum(rows) * grid.cells)
    face = np.repeat(np.tile(np.arange(grid.faces, dtype=np.uint8), 2), np.diff(ends, prepend=0))
    links = np.zeros((len(cell), 4), dtype=np.uint32)
    links[:, 0] = item
    links[:-1, 1] = np.where(begins[1:], 0, np.arange(2, len(cell) + 1))
    links[:, 2] = nearest[face, item].view(np.uint32)
    links[:, 3] = masks[item]
    return heads, links


def _casting(grid: ListGrid, corners: Array, normals: Array, flags: NDArray[np.integer]) -> Indices:
    """Which triangles (T, 3, 3) cast: those with an area that are not culled. Edge-on ones are kept, since rounding decides their side."""
    if grid.projection == "orthographic":
        side = normals[:, 2]  # > 0: the front faces the light
    else:
        away = np.sqrt((corners[:, 0] ** 2).sum(axis=1))
        side = -(normals * corners[:, 0]).sum(axis=1) / np.where(away > 0.0, away, 1.0)
    culled = ((flags & CULL_BACK) != 0) & (side < -_EDGE_ON) | ((flags & CULL_FRONT) != 0) & (side > _EDGE_ON)
    return np.flatnonzero(normals.any(axis=1) & ~culled & ((flags & CASTS) != 0))


def _near_window(grid: ListGrid, corners: Array) -> Indices:
    """Which triangles (xyz, corner, T) may lie between the window and the light: not those beyond one side of it, or behind the light."""
    if grid.projection == "orthographic":
        return np.arange(corners.shape[2])
    scale_x, scale_y, shift_x, shift_y = grid.cells_from_window
    depth = -corners[2]
    x, y = corners[0] * scale_x + depth * shift_x, corners[1] * scale_y + depth * shift_y
    slack = _SLACK * np.abs(depth)
    end = depth * grid.cells + slack
    near = (depth >= 0.0).any(axis=0)
    for at in (x, y):
        near &= (at >= -slack).any(axis=0) & (at <= end).any(axis=0)
    return np.flatnonzero(near)


@dataclass(frozen=True, eq=False)
class _Footprint:
    """Triangles projected into one face of the grid.

    Parameters
    ----------
    corners : (3, 3, T) float64
        xyz, corner; in the face's frame, z backward.
    x, y : (3, T) float64
        Corners in fine cells.
    nearest : (T,) float64
        Least depth.
    crosses : (T,) bool
        Triangles that cross the light's plane, or nearly: their corners' cells are infinite or very large and stored as 0.
    """

    corners: Array
    x: Array
    y: Array
    nearest: Array
    crosses: NDArray[np.bool_]

    def part(self, chosen: Indices) -> _Footprint:
        """The footprints of some of the triangles."""
        return _Footprint(
            self.corners[:, :, chosen], self.x[:, chosen], self.y[:, chosen], self.nearest[chosen], self.crosses[chosen]
        )

    @property
    def estimate(self) -> Array:
        """Expected number of fine cells (T,) that each overlaps, over all positions: area + width + height + 1 (Minkowski sum)."""
        x, y = self.x, self.y
        area = 0.5 * np.abs((x[1] - x[0]) * (y[2] - y[0]) - (y[1] - y[0]) * (x[2] - x[0]))
        estimate = area + x.max(axis=0) - x.min(axis=0) + y.max(axis=0) - y.min(axis=0) + 1.0
        return np.where(self.crosses, np.inf, estimate)


def _footprint(grid: ListGrid, corners: Array) -> _Footprint:
    scale_x, scale_y, shift_x, shift_y = grid.cells_from_window
    depth = -corners[2]
    nearest = depth.min(axis=0)
    if grid.projection == "orthographic":
        x, y = corners[0] * scale_x + shift_x, corners[1] * scale_y + shift_y
        return _Footprint(corners, x, y, nearest, np.zeros(len(nearest), dtype=bool))
    ahead, far = np.where(depth > 0.0, depth, np.inf), _FAR_OUT * grid.cells
    with np.errstate(over="ignore"):
        x, y = corners[0] / ahead * scale_x + shift_x, corners[1] / ahead * scale_y + shift_y
    crosses = (nearest <= 0.0) | (np.abs(x) > far).any(axis=0) | (np.abs(y) > far).any(axis=0)
    return _Footprint(corners, np.where(crosses, 0.0, x), np.where(crosses, 0.0, y), np.maximum(nearest, 0.0), crosses)


def _cells(grid: ListGrid, shape: _Footprint, face: int) -> Iterator[tuple[Indices, Indices]]:
    """Pairs of a cell, numbered as heads are, and a triangle that may overlap it: fine cells, then coarse ones."""
    fine, coarse = grid.cells, grid.cells // RATIO
    small = shape.estimate <= MOST
    for chosen, scale, top in ((small, 1, face * fine), (~small, RATIO, grid.faces * fine + face * coarse)):
        items = np.flatnonzero(chosen)
        if len(items):
            row, column, item = _touched(_blocks(grid, shape.part(items), scale))
            yield (top + row) * fine + column, items[item]


@dataclass(frozen=True, eq=False)
class _Blocks:
    """Cells that triangles may overlap: columns and rows (2, T), first to last, where offset + slope . cell >= 0 for edges (3, T)."""

    first: Indices
    last: Indices
    slope_x: Array
    slope_y: Array
    offset: Array


def _blocks(grid: ListGrid, shape: _Footprint, scale: int) -> _Blocks:
    """The blocks of triangles, in cells that are `scale` fine cells wide."""
    x, y, crosses = shape.x / scale, shape.y / scale, shape.crosses
    turned = (x[1] - x[0]) * (y[2] - y[0]) - (y[1] - y[0]) * (x[2] - x[0])
    turn = np.where(turned < 0.0, -1.0, 1.0)
    slope_x, slope_y = turn * (y - np.roll(y, -1, axis=0)), turn * (np.roll(x, -1, axis=0) - x)
    offset = -(slope_x * x + slope_y * y)
    place, end = np.stack([x, y]), grid.cells // scale - 1
    low = np.where(crosses, 0.0, np.floor(place.min(axis=1) - _MARGIN))
    high = np.where(crosses, end, np.floor(place.max(axis=1) + _MARGIN))
    if crosses.any():
        scale_x, scale_y, shift_x, shift_y = grid.cells_from_window
        sides = _sides(shape.corners[:, :, crosses])
        # a cell's corner lies in direction ((scale cell - shift) / cells_from_window, -1)
        slope_x[:, crosses], slope_y[:, crosses] = sides[0] * (scale / scale_x), sides[1] * (scale / scale_y)
        offset[:, crosses] = -sides[0] * (shift_x / scale_x) - sides[1] * (shift_y / scale_y) - sides[2]
    margin = np.where(crosses, _WIDE_MARGIN, _MARGIN)
    # test the corner of the enlarged cell that is farthest inside
    offset += np.maximum(slope_x, 0.0) + np.maximum(slope_y, 0.0) + margin * (np.abs(slope_x) + np.abs(slope_y))
    first, last = np.maximum(low, 0.0).astype(np.int64), np.minimum(high, end).astype(np.int64)
    return _Blocks(first, last, slope_x, slope_y, offset)


def _sides(corners: Array) -> Array:
    """Inward normals (xyz, edge, T) of the pyramids from the light through triangles (xyz, corner, T)."""
    along = np.roll(corners, -1, axis=1) - corners
    sides = np.stack([corners[i - 2] * along[i - 1] - corners[i - 1] * along[i - 2] for i in range(3)])
    return np.asarray(sides * np.where((sides[:, 0] * corners[:, 2]).sum(axis=0) < 0.0, -1.0, 1.0))


def _touched(blocks: _Blocks) -> tuple[Indices, Indices, Indices]:
    """Row, column and triangle of every cell in the blocks."""
    item, row = _runs(blocks.first[1], np.maximum(blocks.last[1] - blocks.first[1] + 1, 0))
    slope = blocks.slope_x[:, item]
    rest = blocks.offset[:, item] + blocks.slope_y[:, item] * row
    with np.errstate(divide="ignore", invalid="ignore"):
        end = -rest / slope
    low = np.ceil(np.where(slope > 0.0, end, -np.inf).max(axis=0))
    high = np.floor(np.where(slope < 0.0, end, np.inf).min(axis=0))
    high = np.where(((slope == 0.0) & (rest < 0.0)).any(axis=0), -1.0, high)
    first, last = blocks.first[0, item], blocks.last[0, item]
    low, high = np.clip(low, first, last + 1), np.minimum(high, last)
    span, column = _runs(low.astype(np.int64), np.maximum(high - low + 1.0, 0.0).astype(np.int64))
    return row[span], column, item[span]


def _runs(first: Indices, lengths: Indices) -> tuple[Indices, Indices]:
    """For each of several runs the numbers first, first + 1, ..., `count` of them: the run's index, and the number."""
    run = np.repeat(np.arange(len(lengths)), lengths)
    return run, np.arange(len(run)) - np.repeat(np.cumsum(lengths) - lengths - first, lengths)
