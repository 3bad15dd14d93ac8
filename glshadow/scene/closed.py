"""Whether a mesh is closed: vertices welded by position, every edge met by its twin, every part turned outward."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from glshadow.core.spaces import Array

_MIX = np.uint64(0x9E3779B97F4A7C15)  # 2^64 over the golden ratio, odd
_HALF = np.uint64(32)
_DOWN = np.uint64(1)
_AT_ONCE = 1 << 14  # triangles: what is known of them then stays in the cache


def is_closed(positions: Array, triangles: NDArray[np.int32]) -> bool:
    """Whether triangles (T, 3) are watertight once welded, consistently wound, and every part of them turned outward."""
    if len(triangles) < 4:  # a tetrahedron has four
        return False
    number = welded(positions)
    corners = np.empty((3, len(triangles)), dtype=np.int32)
    for column, own in zip(corners, triangles.T, strict=True):
        column[:] = number[own]
    a, b, c = corners
    whole = (a != b) & (b != c) & (c != a)
    if not whole.all():
        triangles, corners = triangles[whole], corners[:, whole]
    if corners.size == 0 or corners.size % 2:  # every edge has its twin
        return False
    edges = _edges(corners)
    edges.sort()
    upward, downward = edges[::2], edges[1::2]
    # each upward once, and after it its twin
    if not np.array_equal(upward | _DOWN, downward) or (upward & _DOWN).any():
        return False
    low, high = (upward >> _HALF).astype(np.int32), (upward.astype(np.uint32) >> np.uint32(1)).astype(np.int32)
    del edges, upward, downward
    return _turned_outward(positions, triangles, _parts(low, high, len(number))[corners[0]])


def _edges(corners: NDArray[np.int32]) -> NDArray[np.uint64]:
    """Of each edge of triangles (3, T) its lesser vertex in the upper 32 bits, then its greater; the lowest bit of those that go down."""
    keys = np.empty(corners.shape, dtype=np.uint64)
    for k in range(0, corners.shape[1], _AT_ONCE):
        start = corners[:, k : k + _AT_ONCE]
        end = start[[1, 2, 0]]
        low, high = np.minimum(start, end).astype(np.uint64), np.maximum(start, end).astype(np.uint64)
        keys[:, k : k + _AT_ONCE] = low << _HALF | high << _DOWN | (start > end)
    return keys.ravel()


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
    volume = np.empty(len(triangles))
    for k in range(0, len(triangles), _AT_ONCE):
        points = middle.take(triangles[k : k + _AT_ONCE], axis=0)
        (ax, ay, az), (bx, by, bz), (cx, cy, cz) = points.transpose(1, 2, 0)
        volume[k : k + _AT_ONCE] = ax * (by * cz - bz * cy) + ay * (bz * cx - bx * cz) + az * (bx * cy - by * cx)
    total = np.bincount(part, volume)
    return bool((total[part] > 0.0).all())


def welded(positions: Array) -> NDArray[np.int64]:
    """For each vertex (V,) the number of its position: bit-equal positions share one (and -0 equals 0)."""
    key = np.zeros(len(positions), dtype=np.uint64)
    for axis in range(positions.shape[1]):  # a hash: sorting rows takes ten times as long
        key ^= (positions[:, axis] + 0.0).view(np.uint64)
        key ^= key >> _HALF
        key *= _MIX
    key ^= key >> _HALF
    ordered = np.sort(key)
    if not (ordered[1:] == ordered[:-1]).any():
        return np.arange(len(key))
    order = np.argsort(key)
    first = _first(key[order, None])
    if not np.array_equal(first, _first(positions[order])):  # two positions with one hash
        order = np.lexsort((positions + 0.0).T)
        first = _first(positions[order])
    number = np.zeros(len(order), dtype=np.int64)
    number[order] = np.cumsum(first) - 1
    return number


def _first(rows: NDArray[np.generic]) -> NDArray[np.bool_]:
    """Which rows differ from the one before."""
    first = np.ones(len(rows), dtype=bool)
    first[1:] = (rows[1:] != rows[:-1]).any(axis=1)
    return first
