"""Triangles near each cell of a grid over the scene: rays to a sky are tested against them, where texels of maps are too coarse."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from glshadow.core.spaces import Array

CELL = 4.0
"""Edge of a cell, texels of the coarsest map."""
ALL = 4096
"""Triangles of a scene up to which all are listed; of more, those larger than `LARGE`."""
LARGE = 4.0
"""Texels: longest edge."""
_NEAR, _NEAR_OF_MANY = (
    4.0,
    2.75,
)  # texels: farther triangles are left to the maps, which miss what is nearer than slack and half a texel
_MOST, _MOST_OF_MANY = 48, 24  # triangles of a cell, the largest: more are left to the maps
_CELLS = 48  # along the longest side, at most
_PIECES = 40_000  # of all triangles, each no larger than a cell: of more, the largest triangles are listed


@dataclass(frozen=True, eq=False)
class NearCasters:
    """Lists of triangles for cells.

    Parameters
    ----------
    corners : (T, 3, 3) float64
        Triangles.
    heads : (Z Y X, 2) uint32
        First link and number of links of each cell, x fastest; bit 31 of the number: all triangles within `reach` are listed.
    links : (L,) uint32
        Triangles.
    low : (3,) float64
        Corner of the grid.
    cell : float
        Edge of a cell.
    shape : (3,) ints
        Cells along x, y and z.
    reach : float
        Distance up to which triangles are listed.
    complete : bool
        Whether every cell lists all of them.
    """

    corners: Array
    heads: NDArray[np.uint32]
    links: NDArray[np.uint32]
    low: Array
    cell: float
    shape: tuple[int, int, int]
    reach: float
    complete: bool


def near_casters(corners: Array, texel: float, few: bool, alone: bool = True) -> NearCasters | None:
    """Lists of the triangles (T, 3, 3) that are near each cell; None if none is worth it.

    `texel`: edge of a texel of the coarsest map, in their units. `few`: all are listed, not only large ones. `alone`: nothing else casts.
    """
    reach, most = (_NEAR * texel, _MOST) if few else (_NEAR_OF_MANY * texel, _MOST_OF_MANY)
    edges = corners[:, [1, 2, 0]] - corners
    longest = np.sqrt((edges**2).sum(axis=2)).max(axis=1)
    area = np.linalg.norm(np.cross(edges[:, 0], edges[:, 2]), axis=1)
    chosen = np.flatnonzero((area > 0.0) & ((longest > LARGE * texel) | few))
    chosen = chosen[np.argsort(-area[chosen], kind="stable")]
    cell = max(CELL * texel, float(np.ptp(corners.reshape(-1, 3), axis=0).max()) / _CELLS) if len(corners) else 0.0
    pieces = np.cumsum(1.0 + area[chosen] / cell**2 + 2.0 * longest[chosen] / cell)
    fitting = int(np.searchsorted(pieces, _PIECES))
    complete = few and alone and fitting == len(chosen)
    chosen = chosen[:fitting]
    if not len(chosen):
        return None
    corners = corners[chosen]
    low, high = corners.min(axis=(0, 1)), corners.max(axis=(0, 1))
    shape = np.maximum(np.ceil((high - low) / cell).astype(np.int64), 1)
    parts, owners = _divided(corners - low, cell)
    first = np.clip(np.floor((parts.min(axis=1) - reach) / cell).astype(np.int64), 0, shape - 1)
    span = np.clip(np.floor((parts.max(axis=1) + reach) / cell).astype(np.int64), 0, shape - 1) - first + 1
    counts = span.prod(axis=1)
    which = np.repeat(np.arange(len(parts)), counts)
    place = np.arange(len(which)) - np.repeat(np.cumsum(counts) - counts, counts)
    along = span[which]
    x = first[which, 0] + place % along[:, 0]
    y = first[which, 1] + place // along[:, 0] % along[:, 1]
    z = first[which, 2] + place // (along[:, 0] * along[:, 1])
    cells = (z * shape[1] + y) * shape[0] + x
    pairs = np.unique(cells * len(corners) + owners[which])  # by cell, then the largest triangle first
    cells, triangles = pairs // len(corners), pairs % len(corners)
    amounts = np.bincount(cells, minlength=int(shape.prod()))
    starts = np.cumsum(amounts) - amounts
    kept = np.arange(len(pairs)) - starts[cells] < most
    whole = (amounts <= most) & complete
    amounts = np.minimum(amounts, most)
    heads = np.stack([np.cumsum(amounts) - amounts, amounts | whole.astype(np.int64) << 31], axis=1)
    return NearCasters(
        corners, heads.astype(np.uint32), triangles[kept].astype(np.uint32), low, cell,
        (int(shape[0]), int(shape[1]), int(shape[2])), reach, bool(whole.all()),
    )  # fmt: skip


def _divided(corners: Array, size: float) -> tuple[Array, NDArray[np.int64]]:
    """Parts (P, 3, 3) of triangles whose edges are no longer than `size`, and the triangle of each."""
    owners = np.arange(len(corners))
    done: list[Array] = []
    whose: list[NDArray[np.int64]] = []
    while len(corners):
        edges = ((corners[:, [1, 2, 0]] - corners) ** 2).sum(axis=2)
        longest = edges.argmax(axis=1)
        small = edges.max(axis=1) <= size * size
        done.append(corners[small])
        whose.append(owners[small])
        longest, owners, corners = longest[~small], owners[~small], corners[~small]
        row = np.arange(len(corners))
        a, b, c = (corners[row, (longest + k) % 3] for k in range(3))
        middle = 0.5 * (a + b)
        corners = np.concatenate([np.stack([a, middle, c], axis=1), np.stack([middle, b, c], axis=1)])
        owners = np.concatenate([owners, owners])
    return np.concatenate(done), np.concatenate(whose)
