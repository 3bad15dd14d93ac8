"""Connected parts of a graph, by pointers to lower neighbours."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray


def representatives(start: NDArray[np.integer[Any]], end: NDArray[np.integer[Any]], count: int) -> NDArray[np.int32]:
    """For each of `count` vertices the lowest vertex of its connected part; edges connect `start` (E,) and `end` (E,).

    Every vertex points to a lower neighbour, if it has one, and then to the root of that. Edges between different roots, a few per cent,
    are processed in the next round.
    """
    root = np.arange(count, dtype=np.int32)
    low, high = np.minimum(start, end), np.maximum(start, end)
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
