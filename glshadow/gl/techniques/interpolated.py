"""Counts of an area light's visible points, interpolated between pixels on the same surface, and lists of the texels where that fails."""

from __future__ import annotations

from collections.abc import Iterator
from copy import copy
from dataclasses import replace
from typing import cast

import moderngl
import numpy as np

from glshadow.gl.driver.buffers import BufferTexture
from glshadow.gl.driver.context import GLContext
from glshadow.gl.driver.entry_points import R32UI
from glshadow.gl.driver.targets import SurfaceTargets, release
from glshadow.gl.frame_context import FrameContext
from glshadow.gl.passes.per_sample import PerSample
from glshadow.gl.passes.screen import camera_uniforms, draw_over
from glshadow.gl.techniques.counts import Counts

UNITS = 16
"""Interpolated counts are multiples of one part in so many of a sample point."""
_ROW = 1024  # listed texels in a row of the passes over them
_BATCH = 1 << 20


class Interpolated:
    """The lists of one light's texels: every second pixel of every second row, and those that are not interpolated.

    Attributes
    ----------
    listed : int
        Length of the latter.
    """

    def __init__(self, context: GLContext) -> None:
        self._context = context
        self._sparse: BufferTexture | None = None
        self._sparse_of = (0, 0)
        self._texels: BufferTexture | None = None
        self._places: BufferTexture | None = None
        self._counter = context.ctx.buffer(reserve=4)
        self._target: moderngl.Framebuffer | None = None
        self.counts = Counts(context)  # of the listed texels
        self.listed = 0

    def sparse(self, frame: FrameContext) -> PerSample:
        """Every second pixel of every second row, as texels of `image_only`."""
        width, height = frame.targets.size
        size = (-(-width // 2), -(-height // 2))
        if self._sparse is None or self._sparse_of != (width, height):
            release(self._sparse)
            self._sparse = None
            pixels = np.arange(0, width, 2, dtype=np.uint32) | np.arange(0, height, 2, dtype=np.uint32)[:, None] << 16
            self._sparse = self._buffer(pixels.nbytes)
            self._sparse.buffer.write(pixels.tobytes())
            self._sparse_of = (width, height)
        return PerSample(None, self._sparse, 0, size[0] * size[1], size[0], (1, 1), False, size, frame.targets.aside)

    def interpolate(
        self, frame: FrameContext, per_sample: PerSample | None, known: Counts, counts: Counts, points: int
    ) -> None:
        """Fill the counts of the image from those of `sparse`, or of samples of collected pixels from those of the image; list the rest."""
        targets, context = frame.targets, self._context
        counts.use(frame, per_sample, 1, "u4")
        size = counts.texture.size
        if self._texels is None or self._texels.buffer.size < 4 * size[0] * size[1]:
            release(self._texels, self._places)
            self._texels = self._places = None
            self._texels, self._places = self._buffer(4 * size[0] * size[1]), self._buffer(4 * size[0] * size[1])
        assert self._places is not None
        program = frame.programs.get("pass/resolve.vert", "pass/interpolate.frag", "core430", {}, {
            "GLS_ORTHO": int(not frame.camera_view.camera.is_perspective),
            "GLS_PER_SAMPLE": int(per_sample is not None),
            **(per_sample.defines if per_sample else {}),
        })  # fmt: skip
        aside = per_sample.aside if per_sample else targets.aside
        program.set(**camera_uniforms(frame.scene, frame.camera_view, np.eye(3), np.zeros(3), aside))
        program.set(u_units=(1 if per_sample else UNITS, UNITS * points), u_pixel=frame.camera_view.pixel(1.0),
                    u_shown=tuple(0.5 + each for each in targets.aside))  # fmt: skip
        program.bind(u_around=targets.surface, u_known=known.texture, u_planes=frame.scene.planes)
        self._counter.write(b"\0\0\0\0")
        self._counter.bind_to_storage_buffer(0)
        self._texels.buffer.bind_to_storage_buffer(1)
        self._places.buffer.bind_to_storage_buffer(2)
        if per_sample is None:
            draw_over(context, program, frame.camera_view)
        else:
            program.set(**per_sample.uniforms, u_samples=targets.fine.surface.size)
            program.bind(u_surface=targets.fine.surface, u_pixels=per_sample.pixels)
            context.ctx.enable_only(moderngl.NOTHING)
            program.vertex_array().render(moderngl.TRIANGLES, vertices=3)
        program.unbind()
        context.ctx.memory_barrier()
        self.listed = int(np.frombuffer(self._counter.read(), dtype=np.uint32)[0])

    def batches(self, aside: tuple[float, float]) -> Iterator[PerSample]:
        """The listed texels, batch after batch."""
        assert self._texels is not None
        for first in range(0, self.listed, _BATCH):
            now = min(_BATCH, self.listed - first)
            yield PerSample(None, self._texels, first, now, _ROW, (1, 1), False, (_ROW, -(-now // _ROW)), aside)

    def scatter(self, frame: FrameContext, batch: PerSample, counts: Counts) -> None:
        """Write the counts of a batch to where they belong."""
        program = frame.programs.compute("pass/scatter.comp")
        program.set(**batch.uniforms, u_unit=UNITS)
        program.bind(u_places=self._places, u_found=self.counts.texture)
        counts.texture.bind_to_image(0, read=False, write=True)
        program.run(-(-batch.count // 64), 1)
        program.unbind()
        self._context.ctx.memory_barrier()

    def _buffer(self, size: int) -> BufferTexture:
        made = BufferTexture(self._context.gl, self._context.ctx.buffer(reserve=size), R32UI)
        self._context.check_errors(f"allocating a list of {size // 4} texels")
        return made

    def release(self) -> None:
        """Free the GPU memory."""
        release(self._sparse, self._texels, self._places, self._counter, self.counts)


def image_only(frame: FrameContext) -> FrameContext:
    """The same frame, the samples of whose buffers are the pixels of the image."""
    targets = copy(frame.targets)
    targets.fine = cast(SurfaceTargets, targets)  # its surface, depth and emission
    return replace(frame, targets=targets)
