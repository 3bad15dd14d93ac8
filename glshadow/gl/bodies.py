"""What a light makes of a scene's bodies: which darken anything, and whose back faces may be left out."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from glshadow.core.casting import darkens
from glshadow.core.lights import DirectionalLight, Light
from glshadow.core.shadow import Faces
from glshadow.core.spaces import transform
from glshadow.gl.geometry import GpuScene

_FEW = 12  # triangles of a body that is asked whether it darkens anything
_ASKED = 64  # bodies that are asked: each question goes to all others
_KEPT = 64  # places of lights for which the answers are kept


def casters_on_others(scene: GpuScene, light: Light) -> NDArray[np.bool_]:
    """Which nodes (N,) darken anything: not a floor under everything, whose rasterising would cost as much as all the rest."""
    place = (True, light.direction) if isinstance(light, DirectionalLight) else (False, light.position)
    kept = scene.casting.get(place)
    if kept is not None:
        return kept
    casting = scene.casts.copy()
    size = np.linalg.norm(np.ptp(scene.corners, axis=1), axis=1)
    whole = float(np.linalg.norm(np.ptp(scene.corners.reshape(-1, 3), axis=0)))
    for i in np.flatnonzero(casting & (size > 0.5 * whole))[:_ASKED]:
        mesh = scene.nodes[i].mesh
        if len(mesh.triangles) <= _FEW and len(scene.nodes) > 1:
            triangles = transform(scene.nodes[i].world_from_mesh, mesh.positions)[mesh.triangles]
            casting[i] = darkens(triangles, np.delete(scene.corners, i, axis=0), light)
    if len(scene.casting) >= _KEPT:
        scene.casting.clear()
    scene.casting[place] = casting
    return casting


def hides_back_faces(scene: GpuScene, light: Light, faces: Faces | None) -> NDArray[np.bool_]:
    """Which nodes (N,) may be drawn without their back faces: closed ones that do not contain the light."""
    closed = scene.closed
    if faces is not None or isinstance(light, DirectionalLight):
        return closed
    position = np.asarray(light.position)
    boxes = scene.corners
    inside = ((boxes.min(axis=1) <= position) & (position <= boxes.max(axis=1))).all(axis=1)
    return np.asarray(closed & ~inside)
