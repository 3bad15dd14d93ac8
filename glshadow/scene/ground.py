"""The plane under a model."""

from __future__ import annotations

import numpy as np

from glshadow.core.spaces import Array
from glshadow.scene.mesh import Material, Mesh


def ground_plane(bounds: Array, lowest: float, color: tuple[float, float, float], size: float) -> tuple[Mesh, Array]:
    """A square plane under a model with these bounds (2, 3), and its world_from_mesh; `size`: its side over the bounds' diagonal."""
    low, high = bounds.copy()
    low[1] = lowest
    half = 0.5 * size * float(np.linalg.norm(high - low))
    x, y, z = 0.5 * (low[0] + high[0]), low[1], 0.5 * (low[2] + high[2])
    corners = np.array([[-half, 0, half], [half, 0, half], [half, 0, -half], [-half, 0, -half]])
    ground = Mesh(corners, np.array([[0, 1, 2], [0, 2, 3]], dtype=np.int32), material=Material(color=(*color, 1.0)))
    matrix = np.eye(4)
    matrix[:3, 3] = (x, y, z)
    return ground, matrix
