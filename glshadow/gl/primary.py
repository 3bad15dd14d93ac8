"""The primary passes: for each pixel or sample what its own ray meets, where GL's snapped vertices show something else."""

from __future__ import annotations

import math

import moderngl
import numpy as np

from glshadow.errors import ResourceError
from glshadow.gl.camera import Rays, draw_surface
from glshadow.gl.screen import camera_uniforms, pixel_axes
from glshadow.gl.targets import SurfaceTargets
from glshadow.gl.work import Work

NOT_FOUND = "pixels show the triangles that GL drew, not those that their rays meet: {}"
"""The fallback where the passes cannot run."""


def find_primary(work: Work, targets: SurfaceTargets, samples: int = 1) -> str:
    """Fill `targets.surface` and its depth from what was drawn; why it is just that, where the driver's buffers do not hold the
    scene's triangles.

    First pass/primary.frag keeps the pixels that surely show what their rays meet. Then all triangles are drawn again, a little larger
    (pass/surface.geom): where nothing was kept, or they lie before it, their fragments test the pixel's own ray.

    `samples`: in a pixel, each of them a texel of the targets.
    """
    scene, sight, context = work.scene, work.sight, work.context
    ctx = context.ctx
    try:
        world = scene.world.textures
    except ResourceError as error:
        ctx.copy_framebuffer(targets.framebuffer, targets.drawing)
        return NOT_FOUND.format(error)
    width, height = targets.surface.size
    unit = math.ldexp(1.0, -math.frexp(sight.reach)[1])
    camera = camera_uniforms(scene, sight, np.eye(3), np.zeros(3))
    rays = Rays(
        dialect="core400" if work.caps.version_code >= 400 else "core330",
        defines={"GLS_ORTHO": int(not sight.camera.is_perspective), "GLS_CONSERVATIVE": 1},
        uniforms={
            **camera,
            **pixel_axes(camera, targets.surface.size),
            "u_near": (sight.near if sight.camera.is_perspective else 0.0) * unit,  # an orthographic camera's rays start there
            "u_unit": unit,
            "u_clear_depth": sight.clip.clear_depth,
            "u_nudge": -1e-6 if sight.clip.reversed else 1e-6,
            "u_half_size": (0.5 * width, 0.5 * height),
        },
        textures=dict(world),
    )
    program = work.programs.get(
        "pass/resolve.vert", "pass/primary.frag", rays.dialect,
        defines={"GLS_ORTHO": rays.defines["GLS_ORTHO"], "GLS_SURFACE": targets.surface.components},
    )  # fmt: skip
    program.set(**rays.uniforms)
    depth = (targets.drawn_depth, work.samplers.plain)
    program.bind(u_surface=targets.drawn, u_camera_depth=depth, **rays.textures)
    targets.framebuffer.use()
    if context.caps.clip_control:
        context.gl.clip_control(sight.clip.zero_to_one)
    ctx.enable_only(moderngl.DEPTH_TEST)  # else no depth is written
    ctx.depth_func = "1"
    program.vertex_array().render(moderngl.TRIANGLES, vertices=3)
    program.unbind()
    ctx.depth_clamp_range = (0.0, 1.0)
    draw_surface(context, work.programs, scene, sight, targets.framebuffer, samples, rays)
    ctx.depth_clamp_range = None
    return ""
