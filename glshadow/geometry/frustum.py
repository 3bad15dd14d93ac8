"""Which clusters a view may show: not those beyond its sides.

It is answered for what the GPU draws, not for what is true: float32 moves what is drawn, and a cluster is left out only where that
cannot bring back any of it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from glshadow.core.spaces import Array
from glshadow.geometry.clusters import Placed, combined

Bools = NDArray[np.bool_]

_FLOAT = 2.0**-20
"""Of the sum of what is added up for a clip coordinate: 16 times what float32 rounds in matrix, products and sums."""
_SIDES = np.array([(-1.0, 0, 0, 1), (1, 0, 0, 1), (0, -1, 0, 1), (0, 1, 0, 1), (0, 0, 0, 1)])
"""w - x, w + x, w - y, w + y, w: negative for what lies beyond a side, or behind the eye."""


@dataclass(frozen=True, eq=False)
class Extents:
    """Of each cluster in clip coordinates (4, C): middle, reach, and what float32 may add to it."""

    middle: Array
    reach: Array
    slack: Array


def extents(placed: Placed, clip_from_origin: Array, clip_from_mesh: Array) -> Extents:
    """Bounds of clip coordinates.

    Parameters
    ----------
    clip_from_origin : (4, 4) float64
        From the world relative to the scene's origin.
    clip_from_mesh : (N, 4, 4) float64
        Per body, as it is drawn: rounding goes by its numbers.
    """
    size = np.einsum("nij,jn->in", np.abs(clip_from_mesh[:, :, :3]), placed.size) + np.abs(clip_from_mesh[:, :, 3]).T
    return Extents(
        placed.middle(clip_from_origin), placed.reach(clip_from_origin), (_FLOAT * size).take(placed.body, axis=1)
    )


def in_frustum(placed: Placed, clip_from_origin: Array, bounds: Extents) -> Bools:
    """Which clusters (C,) may lie in a view, whatever their depth: what is nearer or farther may be clamped to its planes."""
    rows = _SIDES @ clip_from_origin
    most = placed.middle(rows) + placed.reach(rows) + combined(np.abs(_SIDES), bounds.slack)
    return np.asarray((most >= 0.0).all(axis=0))
