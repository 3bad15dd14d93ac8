"""Antialiased exact shadows: several points in each pixel near a shadow's edge, one elsewhere."""

from __future__ import annotations

import moderngl
import numpy as np

from glshadow.core.kernels import sample_offsets
from glshadow.core.lights import Light
from glshadow.core.metric import Target
from glshadow.gl.camera import Sight
from glshadow.gl.context import GLContext
from glshadow.gl.geometry import GpuScene
from glshadow.gl.lists import Lists
from glshadow.gl.numbers import Numbers
from glshadow.gl.program import UNITS, Program, Programs
from glshadow.gl.receiver import Given, light_uniforms, receiver_defines, receiver_dialect, receiver_slots
from glshadow.gl.resolve import Samplers, bind_candidates, bind_surface, draw_over, place_uniforms
from glshadow.gl.targets import CameraTargets, depth_texture, released_on_error


class Refined:
    """Visibility of one light at a time, between its exact filter and the resolve pass, for one image size."""

    def __init__(self, context: GLContext, targets: CameraTargets) -> None:
        ctx, size = context.ctx, targets.depth.size
        self.size = size
        self._context = context
        self.targets = targets
        what = "the antialiased visibility"
        self._marks = depth_texture(context, size, Target.DEPTH32F, what)
        made = [self._marks]
        with released_on_error(made):
            made.append(ctx.texture(size, 1, dtype="f1"))
            made.append(ctx.texture(size, 1, dtype="f4"))
            context.check_errors(f"allocating {what}, {size[0]} x {size[1]}")
            self._probe, self._sum = made[1], made[2]
            for texture in (self._probe, self._sum):
                texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
            self._first = ctx.framebuffer([self._probe], targets.depth)
            self._first.depth_mask = False
            self._found = ctx.framebuffer([self._sum], self._marks)
            self._rest = ctx.framebuffer([self._sum], self._marks)
            self._rest.depth_mask = False

    def draw(
        self,
        programs: Programs,
        samplers: Samplers,
        scene: GpuScene,
        sight: Sight,
        light: Light,
        shadow: Lists | Numbers,
        samples: int,
    ) -> Given:
        """Ask every pixel once, and those whose neighbours say otherwise `samples` times."""
        context = self._context
        ctx = context.ctx
        one = self._program(programs, scene, sight, light, shadow, False)
        bind_surface(samplers, scene, self.targets)
        bind_candidates(scene, shadow)
        self._first.use()
        context.gl.clear_floats(0, (0.5, 0.5, 0.5, 0.5))
        draw_over(context, one, sight)
        edges = programs.get("pass/resolve.vert", "pass/edges.frag")
        edges.set(u_far_z=0.0)
        ctx.clear_samplers(0, max(UNITS.values()) + 1)
        self._probe.use(UNITS["u_probe"])
        self._found.use()
        ctx.enable_only(moderngl.DEPTH_TEST)
        ctx.depth_func = "1"  # always: writes the marks
        edges.vertex_array().render(moderngl.TRIANGLES, vertices=3)
        many = self._program(programs, scene, sight, light, shadow, True)
        many.set(u_far_z=0.0, u_share=1.0 / samples)  # at depth 0.5, or 0: before marks, and not before others
        bind_surface(samplers, scene, self.targets)
        bind_candidates(scene, shadow)
        self._rest.use()
        ctx.enable_only(moderngl.DEPTH_TEST | moderngl.BLEND)
        ctx.depth_func = "<"
        ctx.blend_func = moderngl.ONE, moderngl.ONE
        axes = place_uniforms(scene, sight, light, shadow)["u_ray_l"]
        for offset in sample_offsets(samples):
            many.set(u_ray_offset=tuple(axes[:, :2] @ (2.0 * offset / np.array(self.size))))
            many.vertex_array().render(moderngl.TRIANGLES, vertices=3)
        ctx.enable_only(moderngl.NOTHING)
        ctx.clear_samplers(0, max(UNITS.values()) + 1)
        return Given(self._sum)

    def _program(
        self, programs: Programs, scene: GpuScene, sight: Sight, light: Light, shadow: Lists | Numbers, subpixel: bool
    ) -> Program:
        caps = self._context.caps
        defines = {**receiver_defines(light, shadow), "GLS_SUBPIXEL": int(subpixel), "GLS_SELECTIVE": int(scene.selective)}
        del defines["GLS_EXACT"]  # is what this pass is for
        program = programs.get(
            "pass/resolve.vert",
            "pass/visibility.frag",
            dialect=receiver_dialect(shadow, caps),
            slots=receiver_slots(light, shadow, caps),
            defines=defines,
        )
        program.set(**place_uniforms(scene, sight, light, shadow))
        program.set(**light_uniforms(light))
        return program

    def release(self) -> None:
        """Free the GPU memory."""
        for thing in (self._first, self._found, self._rest, self._probe, self._sum, self._marks):
            thing.release()
