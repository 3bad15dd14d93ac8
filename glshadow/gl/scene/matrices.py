"""Matrices of many nodes at once: points and normals that they transform, and their layout in GL."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from glshadow.core.spaces import Array
from glshadow.scene.box import box_corners


def placed(matrices: Array, points: Array) -> Array:
    """Points (T, 3) transformed by the matrices (N, 4, 4) of instances: (N, T, 3)."""
    return np.asarray(points @ matrices[:, :3, :3].transpose(0, 2, 1) + matrices[:, None, :3, 3])


def normal_matrices(linear: Array) -> Array:
    """Matrices (N, 3, 3) that transform normals: cofactors, det * inverse transpose, also for singular ones; scaled to size 1."""
    rows = np.stack([np.cross(linear[:, (i + 1) % 3], linear[:, (i + 2) % 3]) for i in range(3)], axis=1)
    size = np.abs(rows).max(axis=(1, 2), keepdims=True)
    return np.asarray(rows / np.where(size > 0.0, size, 1.0))


def pack_matrices(matrices: Array) -> NDArray[np.float32]:
    """float64 matrices (N, k, k) as float32 in GL's column order, one per draw."""
    return np.ascontiguousarray(matrices.transpose(0, 2, 1), dtype=np.float32)


def raised(bounds: Array, matrices: Array, lifts: Array) -> Array:
    """World corners (N, 8, 3) of boxes (N, 2, 3) with matrices (N, 4, 4), grown by world distances (N,)."""
    inverse = np.linalg.pinv(matrices[:, :3, :3])
    margin = lifts[:, None] * np.linalg.norm(inverse, axis=2)  # in mesh space, along each axis
    return box_corners(np.stack([bounds[:, 0] - margin, bounds[:, 1] + margin], axis=1), matrices)
