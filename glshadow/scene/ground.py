"""The plane under a model."""

from __future__ import annotations

import numpy as np

from glshadow.core.spaces import Array
from glshadow.scene.mesh import Material, Mesh

CLEARANCE = 1e-4
"""Distance from the model over the bounds' diagonal, a tenth of a pixel: a floor of the model's own is before the ground."""


def ground_plane(
    bounds: Array, lowest: float, color: tuple[float, float, float], size: float, clearance: float = 0.0
) -> tuple[Mesh, Array]:
    """A square plane under a model with these bounds (2, 3), and its world_from_mesh; side and clearance are over the bounds' diagonal."""
    low, high = bounds.copy()
    low[1] = lowest
    diagonal = float(np.linalg.norm(high - low))
    half = 0.5 * size * diagonal
    x, y, z = 0.5 * (low[0] + high[0]), low[1] - clearance * diagonal, 0.5 * (low[2] + high[2])
    corners = np.array([[-half, 0, half], [half, 0, half], [half, 0, -half], [-half, 0, -half]])
    ground = Mesh(corners, np.array([[0, 1, 2], [0, 2, 3]], dtype=np.int32), material=Material(color=(*color, 1.0)))
    matrix = np.eye(4)
    matrix[:3, 3] = (x, y, z)
    return ground, matrix
