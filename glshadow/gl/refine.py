"""Antialiased exact shadows: several points in each pixel that a shadow's edge goes through, one elsewhere. Needs OpenGL 4.3."""

from __future__ import annotations

from typing import Any

import moderngl
import numpy as np

from glshadow.core.kernels import sample_offsets
from glshadow.core.lights import Light
from glshadow.gl.camera import Sight
from glshadow.gl.context import GLContext
from glshadow.gl.entry_points import R32UI, BufferTexture
from glshadow.gl.geometry import GpuScene
from glshadow.gl.lists import Lists
from glshadow.gl.program import UNITS, Defines, Program, Programs
from glshadow.gl.receiver import Given, light_uniforms, receiver_defines, receiver_dialect, receiver_slots
from glshadow.gl.resolve import Samplers, bind_candidates, bind_surface, draw_over, place_uniforms
from glshadow.gl.targets import CameraTargets, released_on_error
from glshadow.shader.slots import BLOCKS


class Refined:
    """Visibility of one light at a time, between its exact filter and the resolve pass, for one image size."""

    def __init__(self, context: GLContext, targets: CameraTargets, samples: int) -> None:
        self.targets, self.samples = targets, samples
        self._context = context
        ctx = context.ctx
        width, height = self.size = targets.depth.size
        columns, rows = BLOCKS[samples]
        context.check_size((width * columns, height * rows), f"{samples} samples of each pixel")
        made: list[Any] = []
        with released_on_error(made):
            made.append(ctx.texture(self.size, 1, dtype="f4"))
            made.append(ctx.texture((width * columns, height * rows), 1, dtype="f1"))  # room for every pixel
            self._given, self._points = made
            self._count = BufferTexture(context.gl, ctx.buffer(reserve=4), R32UI)
            self._pixels = BufferTexture(context.gl, ctx.buffer(reserve=4 * width * height), R32UI)
            context.check_errors(f"allocating {samples} samples of {width} x {height} pixels")
        for texture in made:
            texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
        self._first = ctx.framebuffer([self._given], targets.depth)
        self._second = ctx.framebuffer(depth_attachment=targets.depth)
        self._third = ctx.framebuffer([self._points])
        self._first.depth_mask = self._second.depth_mask = False

    def draw(
        self, programs: Programs, samplers: Samplers, scene: GpuScene, sight: Sight, light: Light, shadow: Lists
    ) -> Given:
        """Ask every pixel once, and those on edges at every point."""
        context = self._context
        values = {**place_uniforms(scene, sight, light, shadow), **light_uniforms(light)}
        camera = {"GLS_ORTHO": int(not sight.camera.is_perspective)}
        one = self._program(programs, "resolve.vert", "visibility.frag", scene, light, shadow, camera)
        one.set(**values)
        bind_surface(samplers, scene, self.targets)
        bind_candidates(scene, shadow)
        self._first.use()
        context.gl.clear_floats(0, (np.nan,) * 4)
        draw_over(context, one, sight)
        context.ctx.clear_samplers(0, max(UNITS.values()) + 1)
        self._collect(programs, sight)
        columns, rows = BLOCKS[self.samples]
        defines = {**camera, "GLS_COLUMNS": columns, "GLS_ROWS": rows}
        many = self._program(programs, "samples.vert", "samples.frag", scene, light, shadow, defines)
        many.set(**values, u_size=self.size, u_offsets=sample_offsets(self.samples).astype(np.float32).tobytes())
        bind_surface(samplers, scene, self.targets)
        bind_candidates(scene, shadow)
        self._count.use(UNITS["u_edges"])
        self._pixels.use(UNITS["u_pixels"])
        self._third.use()
        context.ctx.enable_only(moderngl.NOTHING)
        many.vertex_array().render(moderngl.TRIANGLE_STRIP, vertices=4)
        context.ctx.clear_samplers(0, max(UNITS.values()) + 1)
        return Given(self._given, self._points, self.samples)

    def _collect(self, programs: Programs, sight: Sight) -> None:
        ctx = self._context.ctx
        program = programs.get("pass/resolve.vert", "pass/edges.frag", dialect="core430")
        program.set(u_far_z=sight.far_z)
        self._count.buffer.write(b"\0\0\0\0")
        self._count.buffer.bind_to_storage_buffer(0)
        self._pixels.buffer.bind_to_storage_buffer(1)
        self._given.use(UNITS["u_given"])
        self._given.bind_to_image(0, read=False, write=True)
        self._second.use()
        draw_over(self._context, program, sight)
        ctx.memory_barrier()

    def _program(
        self,
        programs: Programs,
        vertex: str,
        fragment: str,
        scene: GpuScene,
        light: Light,
        shadow: Lists,
        defines: Defines,
    ) -> Program:
        caps = self._context.caps
        settings = {**receiver_defines(light, shadow), "GLS_SELECTIVE": int(scene.selective), **defines}
        del settings["GLS_EXACT"]  # is what these passes are for
        slots, dialect = receiver_slots(light, shadow, caps), receiver_dialect(shadow, caps)
        return programs.get(f"pass/{vertex}", f"pass/{fragment}", dialect, slots, settings)

    def release(self) -> None:
        """Free the GPU memory."""
        for framebuffer in (self._first, self._second, self._third):
            framebuffer.release()
        for texture in (self._given, self._points):
            texture.release()
        for buffer in (self._count, self._pixels):
            buffer.release()
            buffer.buffer.release()
