"""Which vertices lie at one place, and which edges of triangles are one: sorted as numbers of 64 bits."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

_MIX = np.uint64(0x9E3779B97F4A7C15)  # 2^64 over the golden ratio, odd
_HALF = np.uint64(32)
_AT_ONCE = 1 << 14  # triangles: what is known of them then stays in the cache
DOWN = np.uint64(1)
"""Of a packed edge that goes from its greater vertex to its lesser one."""


def welded(positions: NDArray[np.floating[Any]]) -> NDArray[np.int64]:
    """For each vertex (V,) the number of its position: bit-equal positions share one (and -0 equals 0).

    Parameters
    ----------
    positions : (V, 3) float32 or float64
    """
    unsigned = np.uint32 if positions.dtype == np.float32 else np.uint64
    key = np.zeros(len(positions), dtype=np.uint64)
    for column in positions.T:  # a hash: sorting rows takes ten times as long
        key ^= (column + column.dtype.type(0.0)).view(unsigned)
        key ^= key >> _HALF
        key *= _MIX
    key ^= key >> _HALF
    ordered = np.sort(key)
    if not (ordered[1:] == ordered[:-1]).any():
        return np.arange(len(key))
    order = np.argsort(key)
    first = _first(key[order, None])
    if not np.array_equal(first, _first(positions[order])):  # two positions with one hash
        order = np.lexsort((positions + positions.dtype.type(0.0)).T)
        first = _first(positions[order])
    number = np.zeros(len(order), dtype=np.int64)
    number[order] = np.cumsum(first) - 1
    return number


def packed_edges(corners: NDArray[np.integer[Any]]) -> NDArray[np.uint64]:
    """The edges (3 T,) of triangles (3, T), all ab, then all bc, then all ca: the lesser vertex, the greater one, and DOWN or not."""
    edges = np.zeros(corners.shape, dtype=np.uint64)
    for k in range(0, corners.shape[1], _AT_ONCE):
        start = corners[:, k : k + _AT_ONCE]
        end = start[[1, 2, 0]]
        low, high = np.minimum(start, end).astype(np.uint64), np.maximum(start, end).astype(np.uint64)
        edges[:, k : k + _AT_ONCE] = low << _HALF | high << DOWN | (start > end)
    return edges.ravel()


def ends(edges: NDArray[np.uint64]) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """The lesser and the greater vertex of packed edges."""
    return (edges >> _HALF).astype(np.int32), (edges.astype(np.uint32) >> np.uint32(1)).astype(np.int32)


def _first(rows: NDArray[Any]) -> NDArray[np.bool_]:
    """Which rows differ from the one before."""
    first = np.ones(len(rows), dtype=bool)
    first[1:] = (rows[1:] != rows[:-1]).any(axis=1)
    return first
