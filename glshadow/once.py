"""render: one frame by a renderer of its own, with the image saved."""

from __future__ import annotations

from os import PathLike
from typing import Any, Unpack

from glshadow.arguments import USUAL_SIZE, as_scene
from glshadow.core.cameras import Camera
from glshadow.core.setting import optional
from glshadow.frame import Frame
from glshadow.image import image_path
from glshadow.lights import Lights
from glshadow.renderer import Renderer, RenderOptions


def render(
    scene: Any,
    camera: Camera | None = None,
    lights: Lights = None,
    size: tuple[int, int] = USUAL_SIZE,
    path: str | PathLike[str] | None = None,
    ground: bool | str = False,
    **options: Unpack[RenderOptions],
) -> Frame:
    """One frame by a renderer of its own.

    Parameters
    ----------
    scene : Scene, path, trimesh.Trimesh, trimesh.Scene or pyrender.Scene
        Whatever `glshadow.load` takes.
    camera, lights, size
        As in Renderer.render.
    path : optional
        Also save the image there. Its ending and its folder are checked before anything is rendered.
    ground : bool or "catcher"
        As in `glshadow.load`.
    **options
        Further arguments of Renderer.render.
    """
    target = optional(image_path, "it is not saved")("path", path)
    scene = as_scene(scene, ground)
    with Renderer() as renderer:
        frame = renderer.render(scene, camera, lights, size, **options)
    if target is not None:
        frame.save(target)
    return frame
