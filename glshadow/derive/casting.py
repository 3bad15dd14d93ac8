"""Which bodies can darken anything at all, proved with half-spaces."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from glshadow.core.spaces import Array
from glshadow.lights import Light

_ROUNDED = 2.0**-21
"""Relative to a coordinate: a point less than this behind a plane lies on it. `derive.lists.distance_bound` of float32 vertices is
larger."""
_EDGE_ON = 1e-12
"""Cosine between a triangle's plane and a ray below which float64 cannot tell the side of the plane."""


@dataclass(frozen=True, eq=False)
class Convex:
    """The outer half-spaces of a closed convex body.

    Parameters
    ----------
    normals, offsets : (F, 3), (F,) float64
        Unit, outward: outside where normals @ p > offsets for some face.
    slack : float
        World units of rounding error to allow for.
    """

    normals: Array
    offsets: Array
    slack: float

    def excludes(self, points: Array) -> bool:
        """Whether all points (K, 3) lie in front of one face: their convex hull is then outside."""
        return bool((points @ self.normals.T - self.offsets > self.slack).all(axis=0).any())


def darkens(triangles: Array, targets: Array, parts: Sequence[Light], origin: Array | None = None) -> bool:
    """Whether triangles may lie between a light and any point of some bodies.

    A triangle darkens the region behind its plane, seen from the light, bounded by the three planes through an edge and the light.
    A body's convex hull is outside this region if all its corners are outside one of these four half-spaces, for each of the points whose
    hull is the light: the side of a plane through an edge on which a corner lies is an affine function of the light's point.

    Parameters
    ----------
    triangles : (T, 3, 3) float64
        Corners, world space.
    targets : (K, C, 3) float64
        Corners of the bodies' hulls: boxes, or triangles.
    parts : sequence of Light
        Hard lights in whose convex hull the light lies: its `extremes`, if these are exact, or all its directions.
    origin : (3,) float64, optional
        Origin of float32 coordinates; the world's if None.

    Returns
    -------
    bool
        False only if that is certain.
    """
    normals = _normals(triangles)
    solid = (normals != 0.0).any(axis=1)
    triangles, normals = triangles[solid], normals[solid]
    slack = slack_of(triangles, origin)
    return any(_reaches(*each, targets, parts, slack) for each in zip(triangles, normals, strict=True))


def convex(triangles: Array, origin: Array | None = None) -> Convex | None:
    """The half-spaces of a closed body's triangles (T, 3, 3) if no vertex lies outside any of them; None: the body is not convex.

    Between the outer side of a triangle of a convex body and a light in front of it lies no other triangle of the body.
    """
    normals = _normals(triangles)
    solid = (normals != 0.0).any(axis=1)
    triangles, normals = triangles[solid], normals[solid]
    if not len(triangles):
        return None
    normals = normals / np.linalg.norm(normals, axis=1, keepdims=True)
    offsets = np.einsum("ij,ij->i", triangles[:, 0], normals)
    heights = triangles.reshape(-1, 3) @ normals.T - offsets
    slack = slack_of(triangles, origin)
    for sign in (1.0, -1.0):  # -1: the matrix mirrors
        if (sign * heights < slack).all():
            return Convex(sign * normals, sign * offsets, slack)
    return None


def slack_of(triangles: Array, origin: Array | None) -> float:
    """By how much float32 rounding may move vertices, world units."""
    return _ROUNDED * float(np.abs(triangles - (0.0 if origin is None else origin)).max(initial=0.0))


def _normals(triangles: Array) -> Array:
    return np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])


def _reaches(triangle: Array, normal: Array, targets: Array, parts: Sequence[Light], slack: float) -> bool:
    """Whether one triangle (3, 3) may darken a target; each half-space excludes some of the targets that are left."""
    normal = normal / np.linalg.norm(normal)
    rays = np.stack([part.rays_to(triangle) for part in parts])  # (P, 3, 3)
    along = rays[:, 0] @ normal
    sides = np.where(np.abs(along) > _EDGE_ON * np.linalg.norm(rays[:, 0], axis=1), np.sign(along), 0.0)
    height = (targets - triangle[0]) @ normal
    if (sides > 0.0).any() and (sides < 0.0).any():  # the light extends to both sides
        return bool((np.abs(height) > slack).any())
    side = sides[np.argmax(np.abs(sides))]
    targets = targets[(side * height > slack).any(axis=1)]  # no targets for a light that sees the triangle edge-on
    if (
        not sides.all()
    ):  # for a light in the triangle's plane the planes through the edges are that plane and bound nothing
        return len(targets) > 0
    for k in range(3):
        start, end = triangle[k], triangle[(k + 1) % 3]
        inward = -side * np.cross(end - start, rays[:, k])
        inward /= np.linalg.norm(inward, axis=1, keepdims=True)
        targets = targets[((targets - start) @ inward.T > slack).any(axis=(1, 2))]
    return len(targets) > 0
