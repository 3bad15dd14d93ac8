"""Multisampling: the camera pass draws all samples; only pixels whose samples may differ are shaded per sample. Needs OpenGL 4.3."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import moderngl
import numpy as np

from glshadow.core.spaces import Array
from glshadow.gl.driver.buffers import BufferTexture
from glshadow.gl.driver.entry_points import R32UI
from glshadow.gl.driver.targets import release, released_on_error, succeed
from glshadow.gl.frame_context import FrameContext
from glshadow.gl.passes.per_sample import PerSample
from glshadow.gl.passes.resolve import Share, colors_of, resolve
from glshadow.gl.passes.screen import camera_uniforms, draw_over, pixel_axes, surface_textures
from glshadow.gl.passes.transmittance import tint_program

MOST_SAMPLES = 1 << 23
"""Samples that are shaded together: 128 MiB of sums."""

_LIGHTS_PER_WORD = 31  # bits per word of the texture of requests: lib/sample_requests.glsl


class Samples:
    """The list of collected pixels, and buffers for their samples; for one image size."""

    def __init__(self, frame: FrameContext) -> None:
        context, targets = frame.context, frame.targets
        ctx = context.ctx
        self._context = context
        self.size, self.block = targets.size, targets.block
        width, height = self.size
        made: list[Any] = []
        with released_on_error(made):
            self._requests = self._texture(
                made, (width, height * -(-len(targets.visibility) // _LIGHTS_PER_WORD)), 1, "u4"
            )
            self._count = ctx.buffer(reserve=4)
            made.append(self._count)
            self._pixels = BufferTexture(context.gl, ctx.buffer(reserve=4 * width * height), R32UI)
            made.append(self._pixels)
            context.check_errors(f"allocating {targets.samples} samples of {width} x {height} pixels")
        emission = [] if targets.emission is None else [targets.emission]
        self._fill = ctx.framebuffer([targets.surface, targets.mixed, *emission], targets.depth)
        self._clear = ctx.framebuffer([self._requests])
        self._scatter = ctx.framebuffer(depth_attachment=targets.depth)  # for passes that only write to images
        self._scatter.depth_mask = False
        self._sums: moderngl.Texture | None = None
        self._visible: moderngl.Texture | None = None
        self._block_buffer: moderngl.Framebuffer | None = None

    def _texture(self, made: list[Any], size: tuple[int, int], components: int, dtype: str) -> moderngl.Texture:
        made.append(self._context.ctx.texture(size, components, dtype=dtype))
        made[-1].filter = (moderngl.NEAREST, moderngl.NEAREST)
        texture: moderngl.Texture = made[-1]
        return texture

    def fill(self, frame: FrameContext) -> None:
        """Give each pixel the surface and depth of one of its samples, and find the pixels whose samples see several surfaces."""
        scene, camera_view, targets, ctx = frame.scene, frame.camera_view, frame.targets, frame.context.ctx
        camera = camera_uniforms(scene, camera_view, np.eye(3), np.zeros(3))
        program = frame.programs.get(
            "pass/resolve.vert", "pass/fill.frag", "core400",
            defines={"GLS_ORTHO": int(not camera_view.camera.is_perspective), "GLS_SURFACE": targets.surface.components,
                     "GLS_COLORS": colors_of(scene), "GLS_COLUMNS": self.block[0], "GLS_ROWS": self.block[1],
                     "GLS_CAPSULES": scene.capsules, **scene.features.defines(scene.channels)},
        )  # fmt: skip
        program.set(**camera, **pixel_axes(camera, self.size))
        fine = {"u_surface": targets.fine.surface, "u_camera_depth": (targets.fine.depth, frame.samplers.plain)}
        if targets.fine.emission is not None:
            fine["u_emission"] = targets.fine.emission
        program.bind(**{**surface_textures(frame.samplers, scene, targets), **fine})
        self._fill.use()
        ctx.enable_only(moderngl.DEPTH_TEST)  # depth writes need the depth test
        ctx.depth_func = "1"
        program.vertex_array().render(moderngl.TRIANGLES, vertices=3)
        program.unbind()

    def shade(
        self, frame: FrameContext, shares: Sequence[Share], background: Array, transparent: bool, wanted: bool
    ) -> int:
        """Shade pixels whose samples may differ again, sample by sample, and replace their values by the means.

        Parameters
        ----------
        shares : sequence of Share
            All lights, each with its visibility resolved.
        background : (3,) float64
            Linear.
        transparent : bool
            Whether the background is transparent.
        wanted : bool
            Also replace each light's visibility.

        Returns
        -------
        int
            Number of these pixels.
        """
        count = self._collect(frame, shares)
        per = self.block[0] * self.block[1]
        across = min(self.size[0], frame.caps.max_texture_size // self.block[0])
        most = min(MOST_SAMPLES // per, across * (frame.caps.max_texture_size // self.block[1]))
        for first in range(0, count, most):
            now = min(most, count - first)
            self._reserve(frame, min(now, across), -(-now // across), wanted)
            assert self._block_buffer is not None
            per_sample = PerSample(
                self._block_buffer, self._pixels, first, now, across, self.block, wanted, self._block_buffer.size
            )
            for number, share in enumerate(shares):
                self._block_buffer.viewport = per_sample.viewport
                self._block_buffer.use()
                if number == 0:
                    frame.context.gl.clear_floats(0, (0.0,) * 4)
                resolve(frame, share, per_sample)
                if wanted:
                    self._average(frame, per_sample, number)
            over = (*(np.zeros(3) if transparent else background), float(not transparent))
            self._average(frame, per_sample, -1, over, shares[-1])
        return count

    def _collect(self, frame: FrameContext, shares: Sequence[Share]) -> int:
        context, targets = self._context, frame.targets
        self._clear.use()
        context.gl.clear_unsigned(0, (0, 0, 0, 0))
        self._count.write(b"\0\0\0\0")
        self._count.bind_to_storage_buffer(0)
        self._pixels.buffer.bind_to_storage_buffer(1)
        self._requests.bind_to_image(0, read=True, write=True)
        for number, share in enumerate(shares):
            defines = {**share.receiver.collected, "GLS_FIRST": int(number == 0)}
            program = frame.programs.get("pass/resolve.vert", "pass/collect.frag", dialect="core430", defines=defines)
            program.set(u_far_z=frame.camera_view.far_z, u_light=number)
            program.bind(u_visibility=targets.visibility[number], u_mixed=targets.mixed)
            targets.depth_framebuffer.use()
            draw_over(context, program, frame.camera_view)
            context.ctx.memory_barrier()
        self._collect_tinted(frame, shares)
        return int(np.frombuffer(self._count.read(), dtype=np.uint32)[0])

    def _collect_tinted(self, frame: FrameContext, shares: Sequence[Share]) -> None:
        """Collect what translucent casters tint differently within a pixel, unless all pixels are."""
        targets = frame.targets
        for share in shares:
            if share.tint is None or share.receiver.collected.get("GLS_EVERY"):
                continue
            program = tint_program(frame, share.light, share.tint, "pass/tinted.frag", "core430", targets.aside)
            program.set(u_sampled=targets.sampled, u_words=self._requests.height // self.size[1])
            program.bind(u_surface=targets.surface, u_mixed=targets.mixed, u_camera_depth=(targets.depth, frame.samplers.plain),
                         u_planes=frame.scene.planes)  # fmt: skip
            targets.depth_framebuffer.use()
            draw_over(self._context, program, frame.camera_view)
            program.unbind()
            self._context.ctx.memory_barrier()

    def _reserve(self, frame: FrameContext, across: int, down: int, wanted: bool) -> None:
        """Allocate buffers for this many blocks; larger ones are kept."""
        need = (across * self.block[0], down * self.block[1])
        have = (0, 0) if self._sums is None else self._sums.size
        if (
            self._block_buffer is not None
            and have[0] >= need[0]
            and have[1] >= need[1]
            and (self._visible or not wanted)
        ):
            return
        size = (max(need[0], have[0]), max(need[1], have[1]))
        targets, ctx = frame.targets, self._context.ctx
        old = (self._block_buffer, self._sums, self._visible)
        self._block_buffer = self._sums = self._visible = None
        made: list[Any] = []
        with released_on_error(made):
            self._texture(made, size, 4, "f4")
            if wanted:
                self._texture(made, size, 1, "f4")
            self._context.check_errors(f"allocating the samples of {targets.size[0]} x {targets.size[1]} pixels")
        self._sums, self._visible = made[0], made[1] if wanted else None
        self._block_buffer = ctx.framebuffer(made)
        succeed(self._block_buffer, *old)

    def _average(
        self,
        frame: FrameContext,
        per_sample: PerSample,
        light: int,
        background: tuple[float, ...] = (0.0,) * 4,
        share: Share | None = None,
    ) -> None:
        """Average the visibility of one light, or the image for -1."""
        targets, ctx = frame.targets, self._context.ctx
        program = frame.programs.get(
            "pass/resolve.vert", "pass/average.frag", "core430",
            defines={**per_sample.defines, "GLS_OUTPUT": int(light >= 0), "GLS_CATCHES": int(frame.scene.catches),
                     "GLS_SUM": int(targets.linear is not None), **(share.tone_defines if share else {})},
        )  # fmt: skip
        program.set(
            **per_sample.uniforms, u_background=background, u_light=light, u_exposure=share.scale if share else 1.0
        )
        program.bind(u_pixels=per_sample.pixels, u_per_sample=self._visible if light >= 0 else self._sums, u_mixed=targets.mixed,
                     u_requests=self._requests)  # fmt: skip
        if light >= 0:
            targets.visibility[light].bind_to_image(0, read=False, write=True)
        else:
            targets.image.bind_to_image(0, read=False, write=True)
            if targets.linear is not None:
                targets.linear.bind_to_image(1, read=False, write=True)
        self._scatter.viewport = (
            0,
            0,
            min(per_sample.count, per_sample.across),
            -(-per_sample.count // per_sample.across),
        )
        self._scatter.use()
        ctx.enable_only(moderngl.NOTHING)
        program.vertex_array().render(moderngl.TRIANGLES, vertices=3)
        ctx.memory_barrier()

    def release(self) -> None:
        """Free the GPU memory."""
        release(
            self._fill, self._clear, self._scatter, self._block_buffer, self._requests, self._sums, self._visible,
            self._count, self._pixels,
        )  # fmt: skip
