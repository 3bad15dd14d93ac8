"""Receivers in float64: points on surfaces, moved to the rounded surface if a mesh is smooth."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from glshadow.core.spaces import Array, Bools
from glshadow.geometry.smooth import heights, lift, unit_vectors
from glshadow.reference.embree import Ints, dot
from glshadow.reference.rays import PLANE_BOUND, Rays

Lowest = Callable[[Array, Array], Array]
"""From points (N, 3) and unit normals (N, 3) to the cosines (N,) of the light's lowest point."""


@dataclass(frozen=True, eq=False)
class Receivers:
    """Points that receive light.

    Attributes
    ----------
    own : (N,) int32
        Indices of their triangles.
    points : (N, 3) float64
        Relative to the rays' origin.
    normals : (N, 3) float64
        Unit normals of the shaded surface: interpolated for a smooth mesh.
    faces : (N, 3) float64
        Unit normals of the triangles, on the same side.
    lifted : (N,) bool
        Whether the point is off its triangle by more than rounding: the triangle can then block like any other.
    """

    own: Ints
    points: Array
    normals: Array
    faces: Array
    lifted: Bools

    @classmethod
    def of(cls, rays: Rays, own: Ints, points: Array, side: Array, lowest: Lowest | None = None) -> Receivers:
        """Points (N, 3) on triangles (N,), on the side that vectors (N, 3) point to: see `geometry.smooth`.

        Without `lowest`, points are not moved.
        """
        faces = rays.facing(own, points)
        faces = np.where((dot(faces, side) < 0.0)[:, None], -faces, faces)
        normals, lifted = faces.copy(), np.zeros(len(own), dtype=bool)
        round_normals = rays.round_normals
        rows = np.flatnonzero(rays.round[own]) if round_normals is not None else np.zeros(0, dtype=np.int64)
        if round_normals is None or len(rows) == 0:
            return cls(own, points, normals, faces, lifted)
        triangles = own[rows]
        corner_normals = round_normals[triangles] * np.sign(dot(faces[rows], rays.normals[triangles]))[:, None, None]
        weights = rays.barycentric(triangles, points[rows])
        normals[rows] = unit_vectors(np.einsum("nk,nkj->nj", weights, corner_normals))
        if lowest is None:
            return cls(own, points, normals, faces, lifted)
        share = heights(rays.corners[triangles], corner_normals)[1]
        cosine = lowest(points[rows], faces[rows])
        offset = lift(weights, points[rows], rays.corners[triangles], corner_normals, share, cosine)
        off = dot(offset, faces[rows]) > 2.0 * PLANE_BOUND * rays.reach[triangles]
        points = points.copy()
        points[rows[off]] += offset[off]
        lifted[rows] = off
        return cls(own, points, normals, faces, lifted)

    def open_to(self, directions: Array) -> Bools:
        """Whether unit directions (N, 3) are above the horizon."""
        return (dot(self.normals, directions) > 0.0) & (self.lifted | (dot(self.faces, directions) > 0.0))

    def blocked(
        self, rays: Rays, directions: Array, length: Array, rows: NDArray[np.int64] | Bools | slice = slice(None)
    ) -> Bools:
        """Whether segments of given lengths along unit directions, from some of the points, are blocked."""
        return rays.blocked(self.own[rows], self.points[rows], directions, length, self.lifted[rows])[0]

    def tiled(self, count: int) -> Receivers:
        """The receivers repeated `count` times."""
        return Receivers(
            np.tile(self.own, count), np.tile(self.points, (count, 1)), np.tile(self.normals, (count, 1)),
            np.tile(self.faces, (count, 1)), np.tile(self.lifted, count),
        )  # fmt: skip
