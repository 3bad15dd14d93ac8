"""Frustum culling of clusters, against the sides of a view.

The test applies to what the GPU draws in float32, not to the exact positions: a cluster is culled only if rounding cannot bring any part
of it into view.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from glshadow.core.spaces import Array
from glshadow.geometry.clusters import Placed, combined

Bools = NDArray[np.bool_]

_FLOAT = 2.0**-20
"""Share of the sum of terms of a clip coordinate: 16 times float32's rounding in matrix, products and sums."""
_SIDES = np.array([(-1.0, 0, 0, 1), (1, 0, 0, 1), (0, -1, 0, 1), (0, 1, 0, 1), (0, 0, 0, 1)])
"""w - x, w + x, w - y, w + y, w: negative for points beyond a side, or behind the eye."""


@dataclass(frozen=True, eq=False)
class Extents:
    """For each cluster in clip coordinates (4, C): middle, half extent, and a bound on float32's rounding."""

    middle: Array
    reach: Array
    slack: Array


def extents(placed: Placed, clip_from_origin: Array, clip_from_mesh: Array) -> Extents:
    """Bounds of clusters in clip coordinates.

    Parameters
    ----------
    clip_from_origin : (4, 4) float64
        From world space relative to the scene's origin.
    clip_from_mesh : (N, 4, 4) float64
        Per body, as drawn: rounding depends on its values.
    """
    size = np.einsum("nij,jn->in", np.abs(clip_from_mesh[:, :, :3]), placed.size) + np.abs(clip_from_mesh[:, :, 3]).T
    return Extents(
        placed.middle(clip_from_origin), placed.reach(clip_from_origin), (_FLOAT * size).take(placed.body, axis=1)
    )


def in_frustum(placed: Placed, clip_from_origin: Array, bounds: Extents) -> Bools:
    """Which clusters (C,) may be in a view, at any depth: geometry outside the depth range may be clamped to its planes."""
    rows = _SIDES @ clip_from_origin
    most = placed.middle(rows) + placed.reach(rows) + combined(np.abs(_SIDES), bounds.slack)
    return np.asarray((most >= 0.0).all(axis=0))
