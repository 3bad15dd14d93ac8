"""Tests whether a mesh is closed: vertices welded by position, every edge shared by two triangles, every part turned outward."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from glshadow.core.spaces import Array
from glshadow.geometry.adjacency import TURNED, neighbours
from glshadow.geometry.parts import representatives
from glshadow.geometry.welding import welded_corners

_AT_ONCE = 1 << 14  # triangles per block: their data stays in the cache
_PAIRS = 1 << 14
"""Triangles that are tested for self-intersecting parts turned inside out: all of up to 128, a sample of more."""


def connected(positions: Array, triangles: NDArray[np.int32]) -> tuple[NDArray[np.uint32], bool]:
    """The triangles across the edges of triangles (T, 3), welded by exact position, and whether the mesh is closed.

    A mesh is closed if it is watertight, consistently wound, and turned outward in every connected part. A self-intersecting part may be
    inside out in places (a bow tie). The winding number at the centres of triangles detects this: all triangles of small meshes, a sample
    of larger ones.

    Returns
    -------
    across : (T, 3) uint32
        See `geometry.adjacency.neighbours`.
    closed : bool
    """
    corners = welded_corners(positions, triangles)
    across = neighbours(corners)
    a, b, c = corners.T
    whole = (a != b) & (b != c) & (c != a)
    if whole.all():
        return across, _is_closed(positions, triangles, corners, across)
    corners = corners[whole]
    return across, _is_closed(positions, triangles[whole], corners, neighbours(corners))


def _is_closed(
    positions: Array, triangles: NDArray[np.int32], corners: NDArray[np.int32], across: NDArray[np.uint32]
) -> bool:
    if len(triangles) < 4:  # a tetrahedron has four
        return False
    if across.max() >= TURNED:  # or NONE
        return False
    if not _turned_outward(
        positions,
        triangles,
        representatives(corners[:, :2].T.ravel(), corners[:, 1:].T.ravel(), len(positions))[corners[:, 0]],
    ):
        return False
    return not _inside_out(positions[triangles])


def _inside_out(corners: Array) -> bool:
    """Whether a triangle (T, 3, 3) has a winding number below 0 on its outer side, at its centre.

    References
    ----------
    Van Oosterom, Strackee 1983, "The solid angle of a plane triangle", IEEE Trans. Biomed. Eng. 30.
    """
    step = -(-(len(corners) ** 2) // _PAIRS)
    tested = np.arange(step // 2, len(corners), step)
    middles = corners[tested].mean(axis=1)
    a, b, c = (corners[None, :, k] - middles[:, None] for k in range(3))
    sizes = [np.sqrt((each * each).sum(axis=-1)) for each in (a, b, c)]
    volume = (a * np.cross(b, c)).sum(axis=-1)
    rest = sizes[0] * sizes[1] * sizes[2] + (a * b).sum(axis=-1) * sizes[2] + (b * c).sum(axis=-1) * sizes[0]
    rest += (c * a).sum(axis=-1) * sizes[1]
    angle = 2.0 * np.arctan2(volume, rest)
    angle[np.arange(len(tested)), tested] = 0.0  # the triangle itself is seen edge-on: half of its side's 1 is missing
    return bool((angle.sum(axis=1) < 0.0).any())


def _turned_outward(positions: Array, triangles: NDArray[np.int32], part: NDArray[np.int32]) -> bool:
    """Whether every connected part, not only their sum, has a positive volume; `part` (T,): the part of each triangle."""
    middle = positions - positions.mean(axis=0)
    volume = np.zeros(len(triangles))
    for k in range(0, len(triangles), _AT_ONCE):
        points = middle.take(triangles[k : k + _AT_ONCE], axis=0)
        (ax, ay, az), (bx, by, bz), (cx, cy, cz) = points.transpose(1, 2, 0)
        volume[k : k + _AT_ONCE] = ax * (by * cz - bz * cy) + ay * (bz * cx - bx * cz) + az * (bx * cy - by * cx)
    total = np.bincount(part, volume)
    return bool((total[part] > 0.0).all())
