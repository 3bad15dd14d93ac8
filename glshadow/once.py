"""render: one frame with a temporary renderer, optionally saved."""

from __future__ import annotations

from os import PathLike
from typing import Any, Unpack

from glshadow.arguments import DEFAULT_SIZE, as_scene
from glshadow.core.cameras import Camera
from glshadow.core.outputs import holds_arrays
from glshadow.core.setting import optional
from glshadow.frame import Frame
from glshadow.image import frame_path
from glshadow.lights import Lights
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
