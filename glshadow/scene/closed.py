"""Whether a mesh is closed: vertices welded by position, every edge met by its twin, every part turned outward."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from glshadow.core.spaces import Array
from glshadow.core.welding import DOWN, ends, packed_edges, welded

_AT_ONCE = 1 << 14  # triangles: what is known of them then stays in the cache


def is_closed(positions: Array, triangles: NDArray[np.int32]) -> bool:
    """Whether triangles (T, 3) are watertight once welded, consistently wound, and every part of them turned outward."""
    if len(triangles) < 4:  # a tetrahedron has four
        return False
    number = welded(positions)
    corners = np.ascontiguousarray(triangles.T)
    if number.max() + 1 < len(number):  # else each position is one vertex's
        corners = number.astype(np.int32)[corners]
    a, b, c = corners
    whole = (a != b) & (b != c) & (c != a)
    if not whole.all():
        triangles, corners = triangles[whole], corners[:, whole]
    if corners.size == 0 or corners.size % 2:  # every edge has its twin
        return False
    edges = packed_edges(corners)
    edges.sort()
    upward, downward = edges[::2], edges[1::2]
    # each upward once, and after it its twin
    if not np.array_equal(upward | DOWN, downward) or (upward & DOWN).any():
        return False
    low, high = ends(upward)
    del edges, upward, downward
    return _turned_outward(positions, triangles, _parts(low, high, len(number))[corners[0]])


def _parts(low: NDArray[np.int32], high: NDArray[np.int32], count: int) -> NDArray[np.int32]:
    """For each of `count` vertices one of its connected part, the same for all of it; edges lead from `low` to `high` > `low`.

    Every vertex hangs on a lower neighbour, if it has one, and is moved up to the root of what it hangs on; edges between different
    roots, a few per cent of them, are left for the next round.
    """
    root = np.arange(count, dtype=np.int32)
    while len(low):
        root[high] = low
        above = root[root]
        while not np.array_equal(above, root):
            root, above = above, above[above]
        low, high = root[low], root[high]
        apart = low != high
        low, high = low[apart], high[apart]
        low, high = np.minimum(low, high), np.maximum(low, high)
    return root


def _turned_outward(positions: Array, triangles: NDArray[np.int32], part: NDArray[np.int32]) -> bool:
    """Whether every connected part, not only the sum of them, has a positive volume; `part` (T,): which a triangle belongs to."""
    middle = positions - positions.mean(axis=0)
    volume = np.zeros(len(triangles))
    for k in range(0, len(triangles), _AT_ONCE):
        points = middle.take(triangles[k : k + _AT_ONCE], axis=0)
        (ax, ay, az), (bx, by, bz), (cx, cy, cz) = points.transpose(1, 2, 0)
        volume[k : k + _AT_ONCE] = ax * (by * cz - bz * cy) + ay * (bz * cx - bx * cz) + az * (bx * cy - by * cx)
    total = np.bincount(part, volume)
    return bool((total[part] > 0.0).all())
