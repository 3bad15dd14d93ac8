"""Which triangles lie across each other's edges, by the places of their vertices."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

NONE = 0xFFFFFFFF
"""Nothing lies there, or several triangles."""
TURNED = 0x80000000
"""Set where both go along their edge in the same direction: one of them shows its back where the other shows its front."""


def neighbours(positions: NDArray[np.float32], triangles: NDArray[np.unsignedinteger]) -> NDArray[np.uint32]:
    """The triangle (T, 3) across each edge ab, bc, ca, with TURNED or not; NONE where not exactly one is there.

    Parameters
    ----------
    positions : (V, 3) float32
    triangles : (T, 3) ints
        Vertices; equal places are one vertex, whatever their numbers.
    """
    corners = _places(positions)[triangles]
    start, end = corners, np.roll(corners, -1, axis=1)
    low, high = np.minimum(start, end).astype(np.uint64), np.maximum(start, end).astype(np.uint64)
    key = (low << np.uint64(32) | high).ravel()
    order = np.argsort(key, kind="stable")
    ordered = key[order]
    same = ordered[1:] == ordered[:-1]
    # runs of exactly two
    first = np.flatnonzero(same & ~np.append(same[1:], False) & ~np.append(False, same[:-1]))
    one, other = order[first], order[first + 1]
    keep = (one // 3 != other // 3) & (start.ravel()[one] != end.ravel()[one])
    one, other = one[keep], other[keep]
    turned = np.where(start.ravel()[one] == start.ravel()[other], TURNED, 0)
    across = np.full(corners.size, NONE, dtype=np.uint32)
    across[one] = (other // 3) | turned
    across[other] = (one // 3) | turned
    return across.reshape(-1, 3)


def _places(positions: NDArray[np.float32]) -> NDArray[np.int64]:
    """A number for each vertex, equal where the places are equal."""
    bits = (np.ascontiguousarray(positions, dtype=np.float32) + np.float32(0.0)).view(np.uint32).astype(np.uint64)
    # a hash first: sorting rows takes ten times as long
    factors = np.array([0x9E3779B97F4A7C15, 0xC2B2AE3D27D4EB4F, 0x165667B19E3779F9], dtype=np.uint64)
    mixed = (bits ^ (bits << np.uint64(29))) * factors
    _, first, place = np.unique(mixed[:, 0] ^ mixed[:, 1] ^ mixed[:, 2], return_index=True, return_inverse=True)
    if not (bits[first[place]] == bits).all():  # two places with one hash
        _, place = np.unique(bits, axis=0, return_inverse=True)
    return np.asarray(place.reshape(-1), dtype=np.int64)
