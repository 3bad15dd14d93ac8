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
    triangles = triangles[np.linalg.norm(_normals(triangles), axis=1) > 0.0]
    size = float(np.ptp(np.concatenate([triangles.reshape(-1, 3), boxes.reshape(-1, 3)]), axis=0).max())
    slack = _SLACK * size
    if not _convex(triangles, slack):
        return True
    for corners in triangles:
        normals, offsets = _reach(corners, light)
        inside = np.any(boxes @ normals.T - offsets > slack, axis=1)  # (K, 4): some corner of a box
        if np.any(np.all(inside, axis=1)):
            return True
    return False


def _normals(triangles: Array) -> Array:
    return np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])


def _convex(triangles: Array, slack: float) -> bool:
    """Whether no vertex lies before any triangle's plane: then none of them stands between another's front and a light before it."""
    normals = _normals(triangles)
    normals = normals / np.linalg.norm(normals, axis=1, keepdims=True)
    heights = triangles.reshape(-1, 3) @ normals.T - (triangles[:, 0] * normals).sum(axis=1)
    return bool((heights < slack).all() or (heights > -slack).all())


def _reach(corners: Array, light: Light) -> tuple[Array, Array]:
    """Normals (4, 3) and offsets (4,) of the half-spaces that a triangle may darken: inside where n . p > offset."""
    a, b, c = corners
    normal = _normals(corners[None])[0]
    sun = isinstance(light, DirectionalLight)
    along = np.asarray(light.direction) if isinstance(light, DirectionalLight) else a - np.asarray(light.position)
    rows, points = [normal * np.sign(normal @ along)], [a]
    for start, end, other in ((a, b, c), (b, c, a), (c, a, b)):
        ray = along if sun else start - np.asarray(light.position)  # type: ignore[union-attr]
        side = np.cross(end - start, ray)
        rows.append(side * np.sign(side @ (other - start)))
        points.append(start)
    normals = np.array(rows)
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    normals = normals / np.where(length > 0.0, length, 1.0)
    return normals, (normals * np.array(points)).sum(axis=1)
