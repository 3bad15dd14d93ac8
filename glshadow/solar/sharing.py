"""Suns that are near each other in the sky share one direction."""

from __future__ import annotations

import heapq
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from glshadow.core.spaces import Array
from glshadow.solar.path import SunPath


@dataclass(frozen=True, eq=False)
class SharedSuns:
    """Directions that stand for the suns of a path.

    Attributes
    ----------
    directions : (G, 3) float64
        World unit vectors: each is that of a sun of the path.
    group : (N,) int64
        Index of each step's direction; -1 where the sun is below the horizon.
    error : float
        The largest angle between a sun and its direction, degrees.
    """

    directions: Array
    group: NDArray[np.int64]
    error: float


def shared_suns(path: SunPath, within: float) -> SharedSuns:
    """Few directions, with every sun above the horizon within an angle of one of them.

    A greedy cover: the sun that has the most others within the angle becomes a direction, and so on with those that are left. Each
    sun is then given to its nearest direction.

    Parameters
    ----------
    path : SunPath
    within : float
        Degrees. 0: no sun is shared.
    """
    rows = np.flatnonzero(path.is_up)
    group = np.full(len(path.hours), -1, dtype=np.int64)
    aims = path.directions[rows]
    if within == 0.0 or len(rows) == 0:
        group[rows] = np.arange(len(rows))
        return SharedSuns(aims, group, 0.0)
    from scipy.spatial import cKDTree  # slow to import

    tree = cKDTree(aims)
    chord = 2.0 * np.sin(0.5 * np.radians(within))
    near = tree.query_ball_point(aims, chord, return_sorted=True)
    chosen = _cover(near)
    distance, group[rows] = cKDTree(aims[chosen]).query(aims)
    error = float(np.degrees(2.0 * np.arcsin(min(0.5 * np.max(distance), 1.0))))
    return SharedSuns(aims[chosen], group, error)


def _cover(near: NDArray[np.object_]) -> NDArray[np.int64]:
    """Sorted indices of lists that together hold every index; the longest first, of equal ones the first."""
    left = np.ones(len(near), dtype=bool)
    waiting = [(-len(each), index) for index, each in enumerate(near)]
    heapq.heapify(waiting)
    chosen = []
    while waiting:
        claimed, index = heapq.heappop(waiting)
        count = -int(left[near[index]].sum())
        if count == 0:
            continue
        if count != claimed:  # some were covered in the meantime
            heapq.heappush(waiting, (count, index))
            continue
        chosen.append(index)
        left[near[index]] = False
    return np.array(sorted(chosen), dtype=np.int64)
