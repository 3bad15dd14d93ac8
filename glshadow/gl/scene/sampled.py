"""Corners of triangles, and ends of points and lines, from all over a scene."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from glshadow.core.spaces import Array
from glshadow.gl.scene.matrices import placed

if TYPE_CHECKING:
    from glshadow.gl.scene.geometry import GpuScene


def sampled_corners(scene: GpuScene, count: int) -> Array:
    """World places (about `count` or one per node, 3)."""
    step = max(1, scene.count // count)
    corners = []
    for group in scene.groups():
        meshes, of_node = scene.different(group)
        points = np.stack([mesh.positions.take(mesh.triangles[::step, 0], axis=0) for mesh in meshes])
        corners.append(placed(scene.world_from_mesh[group], points[of_node]))
    for node in np.flatnonzero(scene.round).tolist():
        corners.append(placed(scene.world_from_mesh[[node]], scene.nodes[node].mesh.positions[None, ::step]))
    return np.concatenate([each.reshape(-1, 3) for each in corners])
