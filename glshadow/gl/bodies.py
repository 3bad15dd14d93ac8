"""What a light makes of a scene's bodies: which darken anything, and whose back faces may be left out."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from glshadow.core.area import extremes, radius_of
from glshadow.core.casting import darkens
from glshadow.core.lights import DirectionalLight, Light
from glshadow.core.shadow import Faces
from glshadow.core.spaces import Array, transform
from glshadow.gl.geometry import GpuScene
from glshadow.scene.mesh import Mesh

_FEW = 12  # triangles of a body that is asked whether it darkens anything
_FLAT = 1e-9  # of its size: thickness up to which a body is a plane
_ASKED = 64  # bodies that are asked: each question goes to all others
_KEPT = 64  # places of lights for which the answers are kept


def casters_on_others(scene: GpuScene, light: Light) -> NDArray[np.bool_]:
    """Which nodes (N,) darken anything: not a floor under everything, whose rasterising would cost as much as all the rest."""
    sun = isinstance(light, DirectionalLight)
    place = (sun, light.direction if isinstance(light, DirectionalLight) else light.position, radius_of(light))
    kept = scene.casting.get(place)
    if kept is not None:
        return kept
    casting = scene.casts.copy()
    size = np.linalg.norm(np.ptp(scene.corners, axis=1), axis=1)
    whole = float(np.linalg.norm(np.ptp(scene.corners.reshape(-1, 3), axis=0)))
    # smooth surfaces ask from outside their triangles, which may then lie between
    for i in np.flatnonzero(casting & (size > 0.5 * whole) & (scene.lifts == 0.0))[:_ASKED]:
        triangles = _outline(scene.nodes[i].mesh)
        if triangles is not None and len(scene.nodes) > 1:
            placed = transform(scene.nodes[i].world_from_mesh, triangles)
            others = np.delete(scene.raised_corners, i, axis=0)
            casting[i] = any(darkens(placed, others, part) for part in extremes(light))
    if len(scene.casting) >= _KEPT:
        scene.casting.clear()
    scene.casting[place] = casting
    return casting


def _outline(mesh: Mesh) -> Array | None:
    """Few triangles (T, 3, 3) that darken all that a mesh darkens: its own, or of a flat one the rectangle round it; None: many."""
    if len(mesh.triangles) <= _FEW:
        return np.asarray(mesh.positions[mesh.triangles])
    low, high = mesh.bounds
    thin = int(np.argmin(high - low))
    if high[thin] - low[thin] > _FLAT * (high - low).max():
        return None
    x, y = ((thin + k) % 3 for k in (1, 2))
    corners = np.tile(low, (4, 1))
    corners[[1, 2], x], corners[[2, 3], y] = high[x], high[y]
    return corners[[[0, 1, 2], [0, 2, 3]]]


def hides_back_faces(scene: GpuScene, light: Light, faces: Faces | None) -> NDArray[np.bool_]:
    """Which nodes (N,) may be drawn without their back faces: closed ones that do not contain the light."""
    closed = scene.closed
    if faces is not None or isinstance(light, DirectionalLight):
        return closed
    position = np.asarray(light.position)
    low, high = scene.corners.min(axis=1) - radius_of(light), scene.corners.max(axis=1) + radius_of(light)
    inside = ((low <= position) & (position <= high)).all(axis=1)
    return np.asarray(closed & ~inside)
