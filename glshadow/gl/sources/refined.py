"""Antialiased exact shadows: several points in each pixel that a shadow's edge goes through, one elsewhere. Needs OpenGL 4.3."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import moderngl
import numpy as np

from glshadow.core.filters.exact import BLOCKS, sample_offsets
from glshadow.core.lights import Light
from glshadow.core.view import kind_of
from glshadow.gl.buffers import BufferTexture
from glshadow.gl.camera import Sight
from glshadow.gl.entry_points import R32UI
from glshadow.gl.geometry import GpuScene
from glshadow.gl.lighting import light_uniforms
from glshadow.gl.program import Defines, Program, Programs
from glshadow.gl.screen import camera_uniforms, draw_over, surface_textures
from glshadow.gl.sources.source import Receiver, open_receiver
from glshadow.gl.targets import released_on_error
from glshadow.gl.work import Work
from glshadow.shader.slots import given_slots


class Refined:
    """Visibility of one light at a time, between its exact filter and the resolve pass, for one image size."""

    def __init__(self, work: Work, samples: int) -> None:
        self.samples = samples
        self._context = context = work.context
        ctx, targets = context.ctx, work.targets
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

    def draw(self, work: Work, light: Light, asked: Receiver) -> Receiver:
        """Ask every pixel once, and those on edges at every point; the receiver that reads the answers."""
        context, programs = self._context, work.programs
        camera = camera_uniforms(work.scene, work.sight, asked.axes, asked.offset)
        values = {**camera, **asked.uniforms, **light_uniforms(light)}
        textures = {**surface_textures(work.samplers, work.scene, work.targets), **asked.textures}
        ortho: Defines = {"GLS_ORTHO": int(not work.sight.camera.is_perspective)}
        one = self._program(programs, "resolve.vert", "visibility.frag", work.scene, asked, ortho)
        one.set(**values)
        one.bind(**textures)
        self._first.use()
        context.gl.clear_floats(0, (np.nan,) * 4)
        draw_over(context, one, work.sight)
        one.unbind()
        self._collect(programs, work.sight)
        columns, rows = BLOCKS[self.samples]
        block: Defines = {"GLS_COLUMNS": columns, "GLS_ROWS": rows}
        many = self._program(programs, "samples.vert", "samples.frag", work.scene, asked, {**ortho, **block})
        many.set(**values, u_size=self.size, u_offsets=sample_offsets(self.samples).astype(np.float32).tobytes())
        many.bind(**textures, u_edges=self._count, u_pixels=self._pixels)
        self._third.use()
        context.ctx.enable_only(moderngl.NOTHING)
        many.vertex_array().render(moderngl.TRIANGLE_STRIP, vertices=4)
        many.unbind()
        return replace(
            open_receiver(work, light),
            slots=given_slots(kind_of(light)),
            defines=block,
            textures={"u_given": self._given, "u_points": self._points},
        )

    def _collect(self, programs: Programs, sight: Sight) -> None:
        program = programs.get("pass/resolve.vert", "pass/edges.frag", dialect="core430")
        program.set(u_far_z=sight.far_z)
        self._count.buffer.write(b"\0\0\0\0")
        self._count.buffer.bind_to_storage_buffer(0)
        self._pixels.buffer.bind_to_storage_buffer(1)
        program.bind(u_given=self._given)
        self._given.bind_to_image(0, read=False, write=True)
        self._second.use()
        draw_over(self._context, program, sight)
        self._context.ctx.memory_barrier()

    def _program(
        self, programs: Programs, vertex: str, fragment: str, scene: GpuScene, asked: Receiver, defines: Defines
    ) -> Program:
        settings = {**asked.defines, "GLS_SELECTIVE": int(scene.selective), **defines}
        del settings["GLS_EXACT"]  # is what these passes are for
        return programs.get(f"pass/{vertex}", f"pass/{fragment}", asked.dialect, asked.slots, settings)

    def release(self) -> None:
        """Free the GPU memory."""
        for thing in (self._first, self._second, self._third, self._given, self._points, self._count, self._pixels):
            thing.release()
