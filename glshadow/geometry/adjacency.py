"""Which triangles lie across each other's edges, by the places of their vertices."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from glshadow.geometry.welding import DOWN, ends, packed_edges, welded

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
    edges = packed_edges(welded(positions).astype(np.uint32)[triangles.T])
    order = np.argsort(edges)
    edges = edges[order]
    same = (edges[1:] | DOWN) == (edges[:-1] | DOWN)
    # runs of exactly two
    first = np.flatnonzero(same & ~np.append(same[1:], False) & ~np.append(False, same[:-1]))
    turned = np.where(edges[first] == edges[first + 1], TURNED, 0)
    low, high = ends(edges[first])
    count = len(triangles)  # edge k of triangle t is number k T + t
    one, other = order[first], order[first + 1]
    keep = (low != high) & (one % count != other % count)
    one, other, turned = one[keep], other[keep], turned[keep]
    across = np.full((count, 3), NONE, dtype=np.uint32)
    across[one % count, one // count] = other % count | turned
    across[other % count, other // count] = one % count | turned
    return across
