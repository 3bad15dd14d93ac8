"""Which bodies can darken anything at all."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from glshadow.core.spaces import Array
from glshadow.lights import Light

_ROUNDED = 2.0**-21
"""Of a coordinate: what lies less than this behind a plane lies on it. `core.lists.distance_bound` of float32 vertices is larger."""
_EDGE_ON = 1e-12
"""Cosine between a triangle's plane and a ray below which float64 cannot tell the sides of the plane."""


@dataclass(frozen=True, eq=False)
class Convex:
    """The outer half-spaces of a closed convex body.

    Parameters
    ----------
    normals, offsets : (F, 3), (F,) float64
        Unit, outward: outside where normals @ p > offsets for some face.
    slack : float
        World units that rounding may take away.
    """

    normals: Array
    offsets: Array
    slack: float

    def excludes(self, points: Array) -> bool:
        """Whether one face has all points (K, 3) before it: their convex hull then lies outside."""
        return bool((points @ self.normals.T - self.offsets > self.slack).all(axis=0).any())


def darkens(triangles: Array, targets: Array, light: Light, origin: Array | None = None) -> bool:
    """Whether triangles may come between a light and any point of some bodies.

    A triangle darkens what lies behind its plane, seen from the light, and between the three planes through an edge and the light.
    A body's convex hull is out of its reach if all its corners lie outside one of these four half-spaces, for each of the points whose
    hull is the light: the side of a plane through an edge on which a corner lies is an affine function of the light's point.

    Parameters
    ----------
    triangles : (T, 3, 3) float64
        Corners, world space.
    targets : (K, C, 3) float64
        Corners of the bodies' hulls: boxes, or triangles.
    light : Light
        Not one whose points no finite hull holds (the sky).
    origin : (3,) float64, optional
        What float32 coordinates are relative to; the world's if None.

    Returns
    -------
    bool
        False only if it is certain.
    """
    normals = _normals(triangles)
    solid = (normals != 0.0).any(axis=1)
    triangles, normals = triangles[solid], normals[solid]
    slack = slack_of(triangles, origin)
    parts = light.extremes()
    return any(_reaches(*each, targets, parts, slack) for each in zip(triangles, normals, strict=True))


def convex(triangles: Array, origin: Array | None = None) -> Convex | None:
    """The half-spaces of a closed body's triangles (T, 3, 3), if no vertex lies outside any of them; None: it is not convex.

    No triangle of a convex body stands between the outer side of another and a light before that.
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
    for sign in (1.0, -1.0):  # -1: mirrored by its matrix
        if (sign * heights < slack).all():
            return Convex(sign * normals, sign * offsets, slack)
    return None


def slack_of(triangles: Array, origin: Array | None) -> float:
    """By how much float32 may move vertices, world units."""
    return _ROUNDED * float(np.abs(triangles - (0.0 if origin is None else origin)).max(initial=0.0))


def _normals(triangles: Array) -> Array:
    return np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])


def _reaches(triangle: Array, normal: Array, targets: Array, parts: Sequence[Light], slack: float) -> bool:
    """Whether one triangle (3, 3) may darken a target: half-space after half-space, each for those that are left."""
    normal = normal / np.linalg.norm(normal)
    rays = np.stack([part.rays_to(triangle) for part in parts])  # (P, 3, 3)
    along = rays[:, 0] @ normal
    sides = np.where(np.abs(along) > _EDGE_ON * np.linalg.norm(rays[:, 0], axis=1), np.sign(along), 0.0)
    height = (targets - triangle[0]) @ normal
    if (sides > 0.0).any() and (sides < 0.0).any():  # parts of the light lie on either side
        return bool((np.abs(height) > slack).any())
    side = sides[np.argmax(np.abs(sides))]
    targets = targets[(side * height > slack).any(axis=1)]  # none for a light that sees the triangle edge-on
    if not sides.all():  # planes through an edge and a light in the triangle's plane are that plane, and bound nothing
        return len(targets) > 0
    for k in range(3):
        start, end = triangle[k], triangle[(k + 1) % 3]
        inward = -side * np.cross(end - start, rays[:, k])
        inward /= np.linalg.norm(inward, axis=1, keepdims=True)
        targets = targets[((targets - start) @ inward.T > slack).any(axis=(1, 2))]
    return len(targets) > 0
