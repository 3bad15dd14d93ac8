"""Which bodies can darken anything at all."""

from __future__ import annotations

import numpy as np

from glshadow.core.lights import DirectionalLight, Light
from glshadow.core.spaces import Array

_SLACK = 1e-6  # of the scene's size: what touches a plane does not lie behind it


def darkens(triangles: Array, boxes: Array, light: Light) -> bool:
    """Whether a body of few triangles may darken one of some boxes, or itself.

    A triangle darkens what lies behind its plane, seen from the light, and between the three planes through an edge and the light.
    A box is out of its reach if all corners lie on the wrong side of one of the four. A convex body does not darken its own lit side.

    Parameters
    ----------
    triangles : (T, 3, 3) float64
        Corners of the body's triangles, world space.
    boxes : (K, 8, 3) float64
        Corners of the others' boxes.

    Returns
    -------
    bool
        False only if it certainly does not.
    """
    normals = _normals(triangles)
    solid = (normals != 0.0).any(axis=1)
    if not solid.any():
        return False
    triangles, normals = triangles[solid], normals[solid]
    corners = boxes.reshape(-1, 3)
    slack = _SLACK * max(float(np.ptp(each.reshape(-1, 3), axis=0).max()) for each in (triangles, corners))
    if not _convex(triangles, normals, slack):
        return True
    sides, offsets = _reach(triangles, normals, light)
    inside = corners @ sides.reshape(-1, 3).T - offsets.ravel() > slack
    some_corner = inside.reshape(len(boxes), 8, len(triangles), 4).any(axis=1)
    return bool(some_corner.all(axis=-1).any())


def _normals(triangles: Array) -> Array:
    return np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])


def _convex(triangles: Array, normals: Array, slack: float) -> bool:
    """Whether no vertex lies before any triangle's plane: then none of them stands between another's front and a light before it."""
    unit = normals / np.linalg.norm(normals, axis=1, keepdims=True)
    heights = triangles.reshape(-1, 3) @ unit.T - (triangles[:, 0] * unit).sum(axis=1)
    return bool((heights < slack).all() or (heights > -slack).all())


def _reach(triangles: Array, normals: Array, light: Light) -> tuple[Array, Array]:
    """Unit normals (T, 4, 3) and offsets (T, 4) of the half-spaces that triangles may darken: inside where n . p > offset."""
    if isinstance(light, DirectionalLight):
        rays = np.broadcast_to(np.asarray(light.direction), triangles.shape)
    else:
        rays = triangles - np.asarray(light.position)
    following = triangles[:, [1, 2, 0]]
    edges = np.cross(following - triangles, rays)
    inwards = np.sign(np.einsum("ijk,ijk->ij", edges, triangles[:, [2, 0, 1]] - triangles))
    away = normals * np.sign(np.einsum("ij,ij->i", normals, rays[:, 0]))[:, None]
    sides = np.concatenate([away[:, None], edges * inwards[..., None]], axis=1)
    length = np.linalg.norm(sides, axis=-1, keepdims=True)
    sides = sides / np.where(length > 0.0, length, 1.0)
    return sides, np.einsum("ijk,ijk->ij", sides, triangles[:, [0, 0, 1, 2]])
