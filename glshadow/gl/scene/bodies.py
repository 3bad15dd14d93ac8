"""Caster culling per light: which bodies can darken anything, and whose back faces can be culled."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from glshadow.core.spaces import Array, transform
from glshadow.derive.casting import Convex, convex, darkens
from glshadow.gl.passes.camera import CameraView
from glshadow.gl.scene.geometry import GpuScene
from glshadow.lights import Light
from glshadow.scene.mesh import Mesh
from glshadow.shadows.shadow import Faces

_FEW = 12  # triangles: larger bodies are not tested, they always cast
_FLAT = 1e-9  # of its size: a thinner body counts as a plane
_TESTED = 64  # most bodies tested, since each is tested against all others
_KEPT = 64  # lights whose results are kept


@dataclass(frozen=True, eq=False)
class Casters:
    """Which bodies darken anything that a camera may see.

    Attributes
    ----------
    always : (N,) bool
        Bodies that cast whatever the camera sees.
    inside : dict of int to Convex
        Closed convex bodies that darken only their own inside, which is visible only to a camera inside.
    """

    always: NDArray[np.bool_]
    inside: dict[int, Convex]


def casters_seen(scene: GpuScene, light: Light, camera_view: CameraView | None) -> NDArray[np.bool_]:
    """Which nodes (N,) darken anything that a camera sees, or any camera if None. A floor under everything does not, and drawing it would
    cost as much as all the rest.
    """
    key = light.geometry
    casters = scene.casting.get(key)
    if casters is None:
        if len(scene.casting) >= _KEPT:
            scene.casting.clear()
        casters = scene.casting[key] = _casters(scene, light.extremes())
    casting = casters.always.copy()
    for i, body in casters.inside.items():
        if camera_view is None or camera_view.anywhere:
            casting[i] = True
        else:
            casting[i] = not (camera_view.outside[i] or body.excludes(camera_view.near_corners))
    return casting


def casters_among(scene: GpuScene, lights: Sequence[Light]) -> NDArray[np.bool_]:
    """Which nodes (N,) darken anything that some camera sees, in light from within the hull of hard lights."""
    casters = _casters(scene, lights)
    casting = casters.always.copy()
    casting[list(casters.inside)] = True
    return casting


def _casters(scene: GpuScene, parts: Sequence[Light]) -> Casters:
    """Cull large bodies of few triangles that certainly darken neither another body nor themselves."""
    casting, inside = scene.casts.copy(), {}
    size = np.linalg.norm(np.ptp(scene.corners, axis=1), axis=1)
    whole = float(np.linalg.norm(np.ptp(scene.corners.reshape(-1, 3), axis=0)))
    # rays from smooth surfaces start outside their triangles, which may then lie between
    large = casting & (size > 0.5 * whole) & (scene.lifts == 0.0) & ~scene.round
    for i in np.flatnonzero(large)[:_TESTED] if len(scene.nodes) > 1 else ():
        mesh = scene.nodes[i].mesh
        triangles = _outline(mesh)
        if triangles is None:
            continue
        placed = transform(scene.nodes[i].world_from_mesh, triangles)
        if darkens(placed, np.delete(scene.corners, i, axis=0), parts, scene.origin):
            continue
        body = convex(placed, scene.origin) if mesh.closed and not scene.meshes[i].cut_out else None
        if body is not None:
            inside[int(i)] = body
        elif darkens(placed, placed, parts, scene.origin):
            continue
        casting[i] = False
    return Casters(casting, inside)


def _outline(mesh: Mesh) -> Array | None:
    """Few triangles (T, 3, 3) that darken all that a mesh darkens: its own, or the bounding rectangle of a flat mesh; None: too many."""
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
    """Which nodes (N,) can be drawn without their back faces: closed ones that do not contain the light.

    On its way from the light to a receiver, wherever it lies and whatever side of the body it sees, a ray enters a closed
    body before it leaves it: where it meets a back face it has met a front face before.
    """
    closed = scene.closed
    if faces is not None or light.at_infinity:
        return closed
    return np.asarray(closed & ~light.touches(scene.corners.min(axis=1), scene.corners.max(axis=1)))
