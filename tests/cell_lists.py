"""Per-cell triangle lists read back from the GPU: the triangles of each cell, and the cell that a receiver reads."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from glshadow.derive.lists import RATIO, ListGrid
from glshadow.shadows.view import FACES


@dataclass(frozen=True, eq=False)
class Walked:
    """All entries of all lists.

    Parameters
    ----------
    fine : (F,) uint64, sorted
        Cell of all faces' fine cells, row by row, in the upper 32 bits; triangle in the lower ones.
    coarse : (C,) uint64, sorted
        The same of coarse cells.
    depth : dict
        Least depth of each pair (face, triangle).
    masks : dict
        Mask of each triangle.
    """

    fine: NDArray[np.uint64]
    coarse: NDArray[np.uint64]
    depth: dict[tuple[int, int], float]
    masks: dict[int, int]


def pairs(cell: NDArray[np.int64], triangle: NDArray[np.int64]) -> NDArray[np.uint64]:
    """A unique number for each pair of cell and triangle."""
    return cell.astype(np.uint64) << np.uint64(32) | triangle.astype(np.uint64)


def walked(grid: ListGrid, heads: NDArray[np.uint32], links: NDArray[np.uint32]) -> Walked:
    """Follow every list in the order of glsl/exact/lists.glsl."""
    rows, columns = np.nonzero(heads)
    link = heads[rows, columns].astype(np.int64)
    found = []
    while len(link):
        entry = links[link - 1]
        found.append(np.stack([rows, columns, entry[:, 0], entry[:, 2], entry[:, 3]], axis=1).astype(np.int64))
        link = entry[:, 1].astype(np.int64)
        rows, columns, link = rows[link > 0], columns[link > 0], link[link > 0]
    row, column, item, depth, mask = np.concatenate([*found, np.zeros((0, 5), dtype=np.int64)]).T
    top, coarse = grid.faces * grid.cells, grid.cells // RATIO
    fine = row < top
    face = np.where(fine, row // grid.cells, (row - top) // coarse)
    depths = depth.astype(np.uint32).view(np.float32)
    sorted_pairs = (
        np.sort(pairs((row[chosen] - first) * side + column[chosen], item[chosen]))
        for chosen, first, side in ((fine, 0, grid.cells), (~fine, top, coarse))
    )
    return Walked(
        *sorted_pairs,
        dict(zip(zip(face.tolist(), item.tolist(), strict=True), depths.tolist(), strict=True)),
        dict(zip(item.tolist(), mask.tolist(), strict=True)),
    )


def held(
    lists: Walked,
    grid: ListGrid,
    face: NDArray[np.int64],
    x: NDArray[np.int64],
    y: NDArray[np.int64],
    triangle: NDArray[np.int64],
) -> NDArray[np.bool_]:
    """Whether a receiver in a face's fine cell (x, y) finds the triangle in its fine or its coarse list."""
    coarse = grid.cells // RATIO
    fine_cell = (face * grid.cells + y) * grid.cells + x
    coarse_cell = (face * coarse + y // RATIO) * coarse + x // RATIO
    return np.isin(pairs(fine_cell, triangle), lists.fine) | np.isin(pairs(coarse_cell, triangle), lists.coarse)


def receiver_cells(
    grid: ListGrid, receivers: NDArray[np.float32]
) -> tuple[NDArray[np.bool_], NDArray[np.int64], NDArray[np.int64], NDArray[np.int64], NDArray[np.float32]]:
    """glsl/receiver/exact.glsl's float32 lookup for receivers (N, 3) in the light's frame: inside, face, column, row, depth."""
    face = np.zeros(len(receivers), dtype=np.int64)
    local = receivers
    if grid.projection == "cube":
        axis = np.abs(receivers).argmax(axis=1)
        face = 2 * axis + (receivers[np.arange(len(receivers)), axis] < 0.0)
        local = np.einsum("nij,nj->ni", FACES.astype(np.float32)[face], receivers)
    depth = -local[:, 2]
    place = local[:, :2]
    if grid.projection != "orthographic":
        place = place / np.maximum(depth, np.float32(1e-30))[:, None]
    scale = np.array(grid.cells_from_window, dtype=np.float32)
    cell = place * scale[:2] + scale[2:]
    inside = ((cell >= 0.0) & (cell < grid.cells)).all(axis=1) & ((depth > 0.0) | (grid.projection == "orthographic"))
    inside |= grid.projection == "cube"
    x, y = np.clip(cell, 0, grid.cells - 1).astype(np.int64).T
    return inside, face, x, y, depth
