"""What translucent casters let through of each light to the image, and the transmittance output, that of every pixel's centre."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from glshadow.gl.driver.program import Program
from glshadow.gl.driver.targets import SurfaceTargets, release, released_on_error
from glshadow.gl.frame_context import FrameContext
from glshadow.gl.passes.readback import pixels
from glshadow.gl.passes.screen import camera_uniforms, draw_over
from glshadow.gl.passes.translucent import Tint
from glshadow.lights import Light

Tinted = Sequence[tuple[Light, Tint | None]]


def tint_program(
    frame: FrameContext, light: Light, tint: Tint, fragment: str, dialect: str, aside: tuple[float, float] = (0.0, 0.0)
) -> Program:
    """A pass over the image that samples a light's translucent casters. `aside`: see `camera_uniforms`."""
    scene, view = frame.scene, frame.camera_view
    world = light.frame((), scene.origin)
    axes, offset = world[:3, :3], world[:3, 3] + world[:3, :3] @ scene.origin
    program = frame.programs.get(
        "pass/resolve.vert", fragment, dialect,
        defines={"GLS_ORTHO": int(not view.camera.is_perspective), "GLS_AT_INFINITY": int(light.at_infinity), **tint.defines},
    )  # fmt: skip
    program.set(**camera_uniforms(scene, view, axes, offset, aside), **tint.uniforms(axes, offset, scene.origin))
    program.bind(u_tint=tint.texture)
    return program


def read_transmittance(frame: FrameContext, surface: SurfaceTargets, lights: Tinted) -> NDArray[np.float32]:
    """(lights, H, W, 3), row 0 at the top; NaN where there is no surface.

    Parameters
    ----------
    surface : SurfaceTargets
        One sample per pixel.
    lights : sequence
        Each light with its translucent casters.
    """
    scene, view, ctx = frame.scene, frame.camera_view, frame.context.ctx
    width, height = view.size
    nothing = pixels(surface.depth, np.float32)[..., 0] == view.clip.clear_depth
    found = np.ones((len(lights), height, width, 3), dtype=np.float32)
    found[:, nothing] = np.nan
    if not any(tint for _, tint in lights):
        return found
    texture = ctx.texture(view.size, 4, dtype="f4")
    with released_on_error([texture]):
        frame.context.check_errors(f"allocating the transmittance, {width} x {height}")
        framebuffer = ctx.framebuffer([texture], surface.depth)
    framebuffer.depth_mask = False
    for plane, (light, tint) in zip(found, lights, strict=True):
        if tint is None:
            continue
        program = tint_program(frame, light, tint, "pass/transmittance.frag", "core330")
        program.bind(
            u_surface=surface.surface, u_camera_depth=(surface.depth, frame.samplers.plain), u_planes=scene.planes
        )
        framebuffer.use()
        draw_over(frame.context, program, view)
        program.unbind()
        plane[~nothing] = pixels(texture, np.float32)[~nothing, :3]
    surface.framebuffer.use()
    release(framebuffer, texture)
    return found
