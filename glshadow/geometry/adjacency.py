"""Adjacent triangles across edges: found by sorting keys that contain an edge's vertices and index."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from glshadow.geometry.welding import MIX

NONE = 0xFFFFFFFF
"""No triangle, or several triangles."""
TURNED = 0x80000000
"""Flag: both triangles go along the edge in the same direction, so one shows its back where the other shows its front."""

_THREE = np.uint32(3)
_AT_ONCE = 3 << 14  # edges per block: their data stays in the cache


def neighbours(corners: NDArray[np.int32]) -> NDArray[np.uint32]:
    """The triangle (T, 3) across each edge ab, bc, ca, with or without the flag TURNED; NONE unless there is exactly one.

    Parameters
    ----------
    corners : (T, 3) int32
        Index of the position of each corner, see `geometry.welding.welded_corners`.
    """
    vertices = np.ascontiguousarray(
        corners
    ).ravel()  # edge k of triangle t has index 3 t + k, and starts at that vertex
    across = np.full(len(vertices), NONE, dtype=np.uint32)
    keys, numbers = _keys(vertices)
    keys.sort()
    alike = np.zeros(len(keys) + 2, dtype=bool)  # has the same vertices as the previous edge
    for k in range(1, len(keys), _AT_ONCE):
        some = keys[k - 1 : k + _AT_ONCE]
        alike[k : k + len(some) - 1] = (some[1:] ^ some[:-1]) <= numbers
    for k in range(0, len(keys), _AT_ONCE):
        first = k + _pairs(alike[k : k + _AT_ONCE + 2])
        _join(vertices, across, *((keys[each] & numbers).astype(np.uint32) for each in (first, first + 1)))
    # of three or more: several triangles meet, or several edges share a key
    middle = np.flatnonzero(alike[:-1] & alike[1:])
    if len(middle):
        crowded = (keys[np.unique(middle[:, None] + (-1, 0, 1))] & numbers).astype(np.uint32)
        ends = np.sort(_ends(vertices, crowded, crowded // _THREE), axis=0)
        order = np.lexsort(ends)
        crowded, ends = crowded[order], ends[:, order]
        alike = np.zeros(len(crowded) + 2, dtype=bool)
        alike[1:-2] = (ends[:, 1:] == ends[:, :-1]).all(axis=0)
        pairs = _pairs(alike)
        _join(vertices, across, crowded[pairs], crowded[pairs + 1])
    return across.reshape(-1, 3)


def _keys(vertices: NDArray[np.int32]) -> tuple[NDArray[np.uint64], np.uint64]:
    """Key per edge: its lower vertex, its higher one (hashed if 64 bits are too few) and, in the bits also returned, its index.

    numpy sorts 64-bit integers eight times as fast as it computes an argsort.
    """
    number_bits = len(vertices).bit_length()
    vertex_bits = int(vertices.max(initial=0)).bit_length()
    rest = min(64 - number_bits - vertex_bits, vertex_bits)
    keys = np.arange(len(vertices), dtype=np.uint64)
    for k in range(0, len(vertices), _AT_ONCE):
        some = np.ascontiguousarray(vertices[k : k + _AT_ONCE].reshape(-1, 3).T)
        for side, start, end in zip(range(3), some, some[[1, 2, 0]], strict=True):
            high = np.maximum(start, end).astype(np.uint64)
            if rest < vertex_bits:
                high = high * MIX >> np.uint64(64 - rest)
            key = np.minimum(start, end).astype(np.uint64) << np.uint64(rest) | high
            keys[k + side : k + _AT_ONCE : 3] |= key << np.uint64(number_bits)
    return keys, np.uint64((1 << number_bits) - 1)


def _pairs(alike: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Starts of runs of exactly two; `alike` has two more entries at its end, which are false."""
    return np.flatnonzero(~alike[:-2] & alike[1:-1] & ~alike[2:])


def _ends(
    vertices: NDArray[np.int32], edges: NDArray[np.uint32], triangles: NDArray[np.uint32]
) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """First and last vertex of edges (E,) of these triangles."""
    following = edges + np.uint32(1)
    following -= _THREE * (following == _THREE * (triangles + np.uint32(1)))
    return vertices.take(edges), vertices.take(following)


def _join(
    vertices: NDArray[np.int32], across: NDArray[np.uint32], one: NDArray[np.uint32], other: NDArray[np.uint32]
) -> None:
    """Store the triangles of edge pairs (P,) across each other's edge, if they are two different triangles with the same edge."""
    of_one, of_other = one // _THREE, other // _THREE
    (start, end), (there, back) = _ends(vertices, one, of_one), _ends(vertices, other, of_other)
    turned = (start == there) & (end == back)
    met = (turned | ((start == back) & (end == there))) & (start != end) & (of_one != of_other)
    mark = turned * np.uint32(TURNED)
    across[one[met]] = (of_other | mark)[met]
    across[other[met]] = (of_one | mark)[met]
