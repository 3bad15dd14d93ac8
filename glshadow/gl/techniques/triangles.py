"""What all techniques that test shadow rays against triangles share: the light's frame, cache keys, and the receiver."""

from __future__ import annotations

from collections.abc import Hashable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshadow.core.spaces import Array
from glshadow.derive.lists import HUGE_SHARE, MOST, RATIO, ListGrid, distance_bound
from glshadow.errors import ResourceError
from glshadow.gl.frame_context import FrameContext
from glshadow.gl.passes.camera import CameraView
from glshadow.gl.passes.receiver import Receiver
from glshadow.gl.scene.geometry import GpuScene
from glshadow.lights import Light
from glshadow.shader.slots import exact_defines, exact_slots, projection_defines


def made_for(scene: GpuScene, light: Light, casting: NDArray[np.bool_]) -> tuple[Hashable, ...]:
    """Cache key of a light's triangle lists: all that they depend on."""
    faces = light.shadow.faces if light.shadow else None
    return (scene.identity, light.geometry, casting.tobytes(), faces)


def casting_corners(scene: GpuScene, casting: NDArray[np.bool_]) -> Array:
    """Corners (K, 3) of all casters; if nothing casts, of all bodies, since an empty grid may lie anywhere."""
    return scene.corners[casting if casting.any() else slice(None)].reshape(-1, 3)


def light_frame(grid: ListGrid, scene: GpuScene) -> tuple[Array, Array]:
    """Axes (3, 3) and origin (3,) of a light's frame, the origin relative to the scene's; rounded to float32, so that CPU and GPU agree."""
    axes = grid.view_from_world[:3, :3].astype(np.float32).astype(np.float64)
    origin = -grid.view_from_world[:3, :3].T @ grid.view_from_world[:3, 3] - scene.origin
    return axes, origin.astype(np.float32).astype(np.float64)


def cell_defines(grid: ListGrid, cells: int) -> dict[str, int | str]:
    """Defines of lib/cells.glsl for a grid with this many fine cells along a side."""
    return {
        **projection_defines(grid.projection),
        "GLS_CELLS": cells,
        "GLS_RATIO": RATIO,
        "GLS_MOST": MOST,
    }


def head_size(grid: ListGrid, cells: int) -> tuple[int, int]:
    """Columns and rows of the list heads of all faces' fine and coarse cells."""
    return (cells, grid.faces * (cells + cells // RATIO))


def check_facets(scene: GpuScene, limit: int) -> None:
    """Raise if the scene's triangles need more texels than a texture buffer holds: lib/facet.glsl reads three for each."""
    if 3 * scene.count > limit:
        raise ResourceError(
            f"Exact() needs 3 texels for each of the scene's {scene.count} triangles, a texture buffer of this driver holds {limit}, "
            f"those of {limit // 3} triangles: split the scene, or use another filter"
        )


def eye_in_light(scene: GpuScene, camera_view: CameraView, grid: ListGrid) -> Array:
    """The camera's position (3,) in the light's frame."""
    axes, origin = light_frame(grid, scene)
    return np.asarray(axes @ (camera_view.eye - scene.origin) - axes @ origin)


def rounding_bound(scene: GpuScene, camera_view: CameraView, grid: ListGrid) -> tuple[float, float]:
    """`derive.lists.distance_bound` of a scene seen by a camera."""
    eye = eye_in_light(scene, camera_view, grid)
    return distance_bound(
        scene.world.reach, max(usual_reach(scene, grid), float(np.abs(eye).max()) + camera_view.start_distance)
    )


_ROUGH = 1e-4
"""Share of the scene's size by which rounding may displace shadows before a fallback is reported."""


def far_away(frame: FrameContext, grid: ListGrid) -> tuple[str, ...]:
    """The fallback of a camera or a light so far away that float32 represents positions in the scene coarsely."""
    size = float(np.linalg.norm(np.ptp(frame.scene.corners.reshape(-1, 3), axis=0)))
    bound = rounding_bound(frame.scene, frame.camera_view, grid)[0]
    if bound <= _ROUGH * size:
        return ()
    return (f"camera or light is so far from a scene of {size:g} that shadows are right to {bound:.2g} only",)


def usual_reach(scene: GpuScene, grid: ListGrid) -> float:
    """Largest coordinate of the scene's triangles in the light's frame, without the huge ones."""
    axes, origin = light_frame(grid, scene)
    if scene.world.huge:
        return float(np.abs(axes @ origin).max() + np.sqrt(3.0) * scene.world.reach + scene.lifts.max())
    local = (scene.raised_corners.reshape(-1, 3) - scene.origin) @ axes.T - axes @ origin
    return float(np.abs(local).max())


def triangle_receiver(
    frame: FrameContext, light: Light, grid: ListGrid, masked: bool, textures: Mapping[str, Any]
) -> Receiver:
    """A receiver that tests its ray against the triangles of per-cell lists.

    Parameters
    ----------
    masked : bool
        Whether some casters have alpha-tested textures.
    textures : mapping
        Heads, links and facets, by sampler name.
    """
    scene = frame.scene
    axes, origin = light_frame(grid, scene)
    return Receiver(
        exact_slots(light),
        axes,
        -axes @ origin,
        exact_defines(grid.projection, grid.cells, RATIO, masked, scene.world.huge),
        "core400" if frame.caps.version_code >= 400 else "core330",
        {
            "u_eye_l": tuple(eye_in_light(scene, frame.camera_view, grid)),
            "u_cells": grid.cells_from_window,
            "u_bound": rounding_bound(scene, frame.camera_view, grid),
            "u_huge": (usual_reach(scene, grid), HUGE_SHARE),
        },
        {**textures, **scene.world.mask_textures},
    )
