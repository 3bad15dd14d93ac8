"""One frame, or the visibility of given points, with a temporary renderer."""

from __future__ import annotations

from os import PathLike
from typing import Any, Unpack

import numpy as np
from numpy.typing import ArrayLike, NDArray

from glshadow.arguments import DEFAULT_SIZE, as_scene
from glshadow.core.cameras import Camera
from glshadow.core.outputs import holds_arrays
from glshadow.core.setting import optional
from glshadow.frame import Frame
from glshadow.image import frame_path
from glshadow.lights import Lights
from glshadow.point_arguments import Progress
from glshadow.renderer import Renderer, RenderOptions


def render(
    scene: Any,
    camera: Camera | None = None,
    lights: Lights = None,
    size: tuple[int, int] = DEFAULT_SIZE,
    path: str | PathLike[str] | None = None,
    ground: bool | str | None = None,
    look: str | None = None,
    **options: Unpack[RenderOptions],
) -> Frame:
    """Render one frame with a temporary renderer.

    Parameters
    ----------
    scene : Scene, path, trimesh.Trimesh, trimesh.Scene or pyrender.Scene
        Any scene that `glshadow.load` takes.
    camera, lights, size
        As for Renderer.render.
    path : optional
        Also save the image here. The suffix and the folder are checked before anything is rendered.
    ground : bool, "catcher" or None
        None: as None of `glshadow.load`, for the image alone, that is unless `outputs` are given, the background is transparent or `path`
        is a file of arrays. A Scene stays as it is.
    look : {None, "studio", "plain", "outdoor"}
        As for `glshadow.load`.
    **options
        Further arguments of Renderer.render.
    """
    target = optional(frame_path, "not saved")("path", path)
    if ground is None and (holds_arrays(target) or "outputs" in options or options.get("background", "look") is None):
        ground = False
    scene = as_scene(scene, ground, look)
    with Renderer() as renderer:
        frame = renderer.render(scene, camera, lights, size, **options)
    if target is not None:
        frame.save(target)
    return frame


def visibility(
    scene: Any,
    points: ArrayLike,
    lights: Lights = None,
    normals: ArrayLike | None = None,
    triangles: ArrayLike | None = None,
    light_samples: int | None = None,
    progress: Progress | None = None,
) -> NDArray[np.float32]:
    """The share of each light that given points see, by rays against the scene's triangles, with a temporary renderer.

    A point on a triangle is moved into the triangle's plane, and its own triangle never darkens it: no offset is needed. It receives light
    on one side: the front (counter-clockwise, as the node's matrix places it), or the side to which its normal points. Where that
    side faces away from the light, visibility is 0. A smooth mesh is shaded as in images, by its vertex normals. A free point has no
    triangle; with a normal it receives light on that side, without one from all around.

    A light without size is seen or not: 1 or 0. Of a light that has a size, the share of its sample points that are above the horizon and
    not occluded. Of a sky or an environment, the share of the light that an unoccluded point with that normal receives, as in images; a
    free point without a normal weighs all directions alike. Beyond a spot's outer angle and behind a RectLight it is 0; range, falloff and
    strength do not count. Of a light with `shadow=None` only the horizon counts. Translucent casters do not block light, as in
    `Frame.visibility`. All lights are tested exactly: settings of shadow maps do not apply.

    Rounding is that of images: a triangle blocks a point's light if the point is behind the triangle's plane by more than
    2^-24 (2 sqrt(3) w + 3 sqrt(3) l), where w is the largest coordinate of the scene's vertices relative to the scene's own origin and l
    the largest in the light's frame: about a millionth of the scene's size. The answer of a point depends on no other point.

    Parameters
    ----------
    scene : Scene, path, trimesh.Trimesh, trimesh.Scene or pyrender.Scene
        Any scene that `glshadow.load` takes.
    points : (N, 3) floats
        World positions.
    lights : optional
        None: the scene's own.
    normals : (N, 3) floats, optional
        World normals of any length; (0, 0, 0): none.
    triangles : (N,) ints, optional
        Scene-wide number of the triangle that each point is on, as in `Frame.triangle`; -1: a free point. None: a point is on a triangle if
        it is within twice the rounding above of it; of several on the one that faces along its normal best, then the nearest, then the
        first.
    light_samples : int, optional
        Sample points of lights that have a size, 16 to 1024. None: that of the light's filter, or 64.
    progress : callable, optional
        Called as (done, total, text).

    Returns
    -------
    (L, N) float32

    Raises
    ------
    SettingsError
        If points, normals or triangles have a wrong shape, are not finite or out of range, or a triangle's number is that of a ball
        or a tube.
    SceneError
        If the scene is not a scene, or has nothing to draw.
    ResourceError
        If there is not enough memory, or the triangle lists do not fit into the driver's buffers; of points and lines below OpenGL 4.3.

    References
    ----------
    Wyman, Hoetzlein, Lefohn 2015, "Frustum-Traced Raster Shadows: Revisiting Irregular Z-Buffers", I3D; for the lists.
    """
    scene = as_scene(scene)
    with Renderer() as renderer:
        return renderer.visibility(scene, points, lights, normals, triangles, light_samples, progress)
