"""Tangents of triangles from their texture coordinates, in float64."""

from __future__ import annotations

import numpy as np

from glshadow.core.spaces import Array


def face_tangents(corners: Array, uv: Array) -> tuple[Array, Array]:
    """Frames in which a normal map is given.

    Parameters
    ----------
    corners : (T, 3, 3) float64
    uv : (T, 3, 2) float64
        Texture coordinates of the corners, v up.

    Returns
    -------
    tangents : (T, 4) float64
        Unit vectors in which u grows and v does not change, and the sign (1 or -1) of cross(normal, tangent) in which v grows; zero where
        the coordinates have no area.
    normals : (T, 3) float64
        Unit normals; zero where the triangle has no area.
    """
    e, f = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    a, b = uv[:, 1] - uv[:, 0], uv[:, 2] - uv[:, 0]
    area = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    sign = np.sign(area)
    along = (e * b[:, 1:] - f * a[:, 1:]) * sign[:, None]
    normal = np.cross(e, f)
    tangents = np.concatenate([_unit(along), sign[:, None]], axis=1)
    return tangents, _unit(normal)


def _unit(vectors: Array) -> Array:
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.asarray(vectors / np.where(length > 0.0, length, 1.0))
