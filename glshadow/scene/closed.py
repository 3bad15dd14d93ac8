"""Whether a mesh is closed: vertices welded by position, every edge met by its twin, every part turned outward."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from glshadow.core.spaces import Array


def is_closed(positions: Array, triangles: NDArray[np.int32]) -> bool:
    """Whether triangles (T, 3) are watertight once welded, consistently wound, and every part of them turned outward."""
    if len(triangles) < 4:  # a tetrahedron has four
        return False
    corners = welded(positions)[triangles]
    whole = (corners[:, 0] != corners[:, 1]) & (corners[:, 1] != corners[:, 2]) & (corners[:, 2] != corners[:, 0])
    corners = corners[whole]
    if len(corners) == 0:
        return False
    start, end = corners.ravel().astype(np.int64), corners[:, [1, 2, 0]].ravel().astype(np.int64)
    forward = np.sort((start << 32) | end)
    if (forward[1:] == forward[:-1]).any():  # an edge used twice in one direction
        return False
    if not np.array_equal(forward, np.sort((end << 32) | start)):  # an edge without its twin
        return False
    return _turned_outward(positions, triangles[whole], corners)


def _turned_outward(positions: Array, triangles: NDArray[np.int32], corners: NDArray[np.int64]) -> bool:
    """Whether every connected part, not only the sum of them, has a positive volume; `corners`: the triangles of welded vertices."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    start, end = corners[:, :2].ravel(), corners[:, 1:].ravel()  # two edges of a triangle connect it
    graph = coo_array((np.ones(len(start), dtype=np.int8), (start, end)), shape=(int(corners.max()) + 1,) * 2)
    _, part = connected_components(graph, directed=False)
    a, b, c = ((positions - positions.mean(axis=0))[triangles[:, k]] for k in range(3))
    volumes = np.bincount(part[corners[:, 0]], np.einsum("ij,ij->i", a, np.cross(b, c)), minlength=1)
    return bool((volumes[np.unique(part[corners[:, 0]])] > 0.0).all())


def welded(positions: Array) -> NDArray[np.int64]:
    """For each vertex (V,) the number of its position: bit-equal positions share one (and -0 equals 0)."""
    columns = positions + 0.0
    order = np.lexsort(columns.T)
    ordered = columns[order]
    first = np.ones(len(order), dtype=bool)
    first[1:] = (ordered[1:] != ordered[:-1]).any(axis=1)
    number = np.zeros(len(order), dtype=np.int64)
    number[order] = np.cumsum(first) - 1
    return number
