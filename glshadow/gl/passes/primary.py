"""The primary pass: for each pixel or sample the triangle that its own ray meets, where GL's snapped vertices show another."""

from __future__ import annotations

import math

import numpy as np

from glshadow.errors import ResourceError
from glshadow.gl.driver.buffers import BufferTexture
from glshadow.gl.driver.targets import SurfaceTargets
from glshadow.gl.frame_context import Work
from glshadow.gl.passes.screen import camera_uniforms, draw_over, pixel_axes

NOT_FOUND = "pixels show the triangles that GL drew, not those that their rays meet: {}"
"""The fallback where the pass cannot run."""


def find_primary(work: Work, targets: SurfaceTargets, samples: int = 1) -> str:
    """Fill `targets.surface` from what was drawn; why it is just that, where the driver's buffers do not hold the scene's triangles.

    `samples`: in a pixel, each of them a texel of the targets.
    """
    scene, sight, context = work.scene, work.sight, work.context
    try:
        world: dict[str, BufferTexture] = {**scene.world.textures, "u_neighbours": scene.world.neighbours}
    except ResourceError as error:
        context.ctx.copy_framebuffer(targets.framebuffer, targets.drawing)
        return NOT_FOUND.format(error)
    program = work.programs.get(
        "pass/resolve.vert",
        "pass/primary.frag",
        dialect="core400" if work.caps.version_code >= 400 else "core330",
        defines={
            "GLS_ORTHO": int(not sight.camera.is_perspective),
            "GLS_SURFACE": targets.surface.components,
            "GLS_SILHOUETTES": int(samples == 1),
        },
    )
    camera = camera_uniforms(scene, sight, np.eye(3), np.zeros(3))
    near = sight.near if sight.camera.is_perspective else 0.0  # an orthographic camera's rays start there
    unit = math.ldexp(1.0, -math.frexp(sight.reach)[1])
    program.set(**camera, **pixel_axes(camera, targets.surface.size), u_near=near * unit, u_unit=unit)
    program.bind(u_surface=targets.drawn, u_camera_depth=(targets.depth, work.samplers.plain), **world)
    targets.framebuffer.use()
    context.gl.clear_unsigned(0, (0, 0, 0, 0))
    draw_over(context, program, sight)
    program.unbind()
    return ""
