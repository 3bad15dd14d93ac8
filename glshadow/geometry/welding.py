"""Finds vertices at equal positions by sorting hashes."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

MIX = np.uint64(0x9E3779B97F4A7C15)
"""2^64 over the golden ratio, odd: the upper bits of a product with it are a good hash."""
_HALF = np.uint64(32)


def welded(positions: NDArray[np.floating[Any]]) -> NDArray[np.int64]:
    """For each vertex (V,) the index of its position: bit-equal positions share one (and -0 equals 0).

    Parameters
    ----------
    positions : (V, 3) float32 or float64
    """
    unsigned = np.uint32 if positions.dtype == np.float32 else np.uint64
    key = np.zeros(len(positions), dtype=np.uint64)
    for column in positions.T:  # a hash: sorting rows takes ten times as long
        key ^= (column + column.dtype.type(0.0)).view(unsigned)
        key ^= key >> _HALF
        key *= MIX
    key ^= key >> _HALF
    ordered = np.sort(key)
    if not (ordered[1:] == ordered[:-1]).any():
        return np.arange(len(key))
    del ordered
    # numpy sorts integers far faster than it computes an argsort: the lower bits hold the vertex of a hash
    index = np.uint64((1 << len(key).bit_length()) - 1)
    key &= ~index
    key |= np.arange(len(key), dtype=np.uint64)
    key.sort()
    order = (key & index).astype(np.int64)
    key &= ~index
    alike = key[1:] == key[:-1]  # has the same hash as the previous one
    first = _first(positions[order])
    mixed = alike & first[1:]
    if mixed.any():  # several positions with one hash: sorted exactly
        run = np.cumsum(np.append(False, ~alike))
        members = np.flatnonzero(np.isin(run, run[1:][mixed]))
        vertices = order[members]
        rows = positions[vertices] + positions.dtype.type(0.0)
        order[members] = vertices[np.lexsort((*rows.T, run[members]))]
        first = _first(positions[order])
    number = np.zeros(len(order), dtype=np.int64)
    number[order] = np.cumsum(first) - 1
    return number


def welded_corners(positions: NDArray[np.floating[Any]], triangles: NDArray[np.int32]) -> NDArray[np.int32]:
    """Triangles (T, 3) over indices of positions: equal positions get one index."""
    number = welded(positions)
    if number.max(initial=-1) + 1 == len(number):  # each vertex has its own position
        return triangles
    return number.astype(np.int32)[triangles]


def _first(rows: NDArray[Any]) -> NDArray[np.bool_]:
    """Which rows differ from the previous one."""
    first = np.zeros(len(rows), dtype=bool)
    first[:1] = True
    for column in rows.T:
        first[1:] |= column[1:] != column[:-1]
    return first
