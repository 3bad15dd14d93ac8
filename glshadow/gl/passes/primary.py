"""Primary-visibility passes: in each pixel or sample show the triangle that its ray meets, where GL's snapped vertices show another."""

from __future__ import annotations

import math
from typing import Any

import moderngl
import numpy as np

from glshadow.errors import ResourceError
from glshadow.gl.driver.program import Program
from glshadow.gl.driver.targets import SurfaceTargets
from glshadow.gl.frame_context import FrameContext
from glshadow.gl.passes.camera import Rays, draw_surface
from glshadow.gl.passes.capsules import draw_capsules
from glshadow.gl.passes.screen import camera_uniforms, draw_over, pixel_axes

NOT_FOUND = "pixels show the triangles that GL drew, not those that their rays meet: {}"
"""The fallback where the passes cannot run."""


def find_primary(frame: FrameContext, targets: SurfaceTargets, samples: int = 1) -> str:
    """Correct the content of `targets`. Returns why it is left as it is if the driver's buffers do not hold the scene's triangles.

    First pass/primary.frag discards the pixels that may show another triangle than their ray meets. Then all triangles are drawn again,
    slightly enlarged (pass/surface.geom), into the discarded pixels and in front of the others; their fragments test the pixel's ray.

    `samples`: per pixel; each is one texel of the targets.
    """
    scene, camera_view, context = frame.scene, frame.camera_view, frame.context
    ctx = context.ctx
    try:
        world = scene.world.textures
    except ResourceError as error:
        if scene.capsules:  # only drawn from these buffers
            raise
        return NOT_FOUND.format(error)
    width, height = targets.surface.size
    unit = math.ldexp(1.0, -math.frexp(camera_view.reach)[1])
    camera = camera_uniforms(scene, camera_view, np.eye(3), np.zeros(3))
    modern = frame.caps.version_code >= 400
    rays = Rays(
        dialect="core400" if modern else "core330",
        defines={
            "GLS_ORTHO": int(not camera_view.camera.is_perspective),
            "GLS_CONSERVATIVE": 1,
            "GLS_DOUBLE": int(modern and frame.caps.doubles),
        },
        uniforms={
            **camera,
            **{f"u_{name}_rest": _rest(camera[f"u_{name}_l"]) for name in ("ray", "eye", "forward")},
            **pixel_axes(camera, targets.surface.size),
            "u_near": (camera_view.near if camera_view.camera.is_perspective else 0.0)
            * unit,  # an orthographic camera's rays start there
            "u_unit": unit,
            "u_least_w": 0.5 * camera_view.near if camera_view.camera.is_perspective else 0.5,
            "u_nudge": -1e-6 if camera_view.clip.reversed else 1e-6,
            "u_half_size": (0.5 * width, 0.5 * height),
        },
        textures=dict(world),
    )
    program = frame.programs.get(
        "pass/resolve.vert", "pass/primary.frag", rays.dialect,
        defines={"GLS_ORTHO": rays.defines["GLS_ORTHO"]},
    )  # fmt: skip
    program.set(**rays.uniforms)
    program.bind(u_surface=targets.surface, **rays.textures)
    targets.depth_alone.use()
    draw_over(context, program, camera_view)
    program.unbind()
    program = _background(frame, targets)
    targets.framebuffer.use()
    ctx.depth_func = "=="
    program.vertex_array().render(moderngl.TRIANGLES, vertices=3)
    ctx.depth_clamp_range = (0.0, 1.0)  # the ends of an enlarged triangle seen edge-on may have any depth
    draw_surface(context, frame.programs, scene, camera_view, targets.framebuffer, samples, rays)
    if scene.capsules:
        draw_capsules(frame, targets)
    ctx.depth_clamp_range = None
    context.gl.call(
        "glUseProgram", 0
    )  # Mesa 22.3 never deletes the program used after one with a geometry shader otherwise
    return ""


def count_surface(frame: FrameContext, targets: SurfaceTargets) -> None:
    """Draw, for an occlusion query, where the depth buffer holds a surface; writes nothing."""
    ctx, program = frame.context.ctx, _background(frame, targets)
    targets.depth_alone.depth_mask = False
    targets.depth_alone.use()
    ctx.enable_only(moderngl.DEPTH_TEST)
    ctx.depth_func = "!="
    program.vertex_array().render(moderngl.TRIANGLES, vertices=3)
    targets.depth_alone.depth_mask = True


def _background(frame: FrameContext, targets: SurfaceTargets) -> Program:
    """A program that covers the image at the far plane and writes that there is no surface."""
    program = frame.programs.get(
        "pass/resolve.vert", "pass/nothing.frag", defines={"GLS_SURFACE": targets.surface.components}
    )
    program.set(**camera_uniforms(frame.scene, frame.camera_view, np.eye(3), np.zeros(3)))
    return program


def _rest(value: Any) -> Any:
    """What float32 cuts off of a vector or matrix."""
    exact = np.asarray(value, dtype=np.float64)
    rest = exact - exact.astype(np.float32)
    return tuple(rest.tolist()) if rest.ndim == 1 else rest
