"""Counts of visible sample points for each pixel or sample: a texture that passes add to, kept while its shape does not change."""

from __future__ import annotations

from collections.abc import Hashable

import moderngl

from glshadow.gl.driver.context import GLContext
from glshadow.gl.driver.targets import release, succeed
from glshadow.gl.frame_context import FrameContext
from glshadow.gl.passes.per_sample import PerSample


class Counts:
    """One light's counts for the image, or for the samples of collected pixels.

    Attributes
    ----------
    textures, framebuffer
        Read by shaders; drawn to by passes. The second texture is that of a light that differs by channel.
    """

    def __init__(self, context: GLContext) -> None:
        self._context = context
        self._shape: Hashable = None
        self.textures: tuple[moderngl.Texture, ...]
        self.framebuffer: moderngl.Framebuffer

    @property
    def texture(self) -> moderngl.Texture:
        """The first texture."""
        return self.textures[0]

    def use(
        self, frame: FrameContext, per_sample: PerSample | None, components: int, dtype: str, textures: int = 1
    ) -> None:
        """Bind the counts as render target: for the image, with its depth test, or for collected samples."""
        size, whose = (frame.targets.size, frame.targets.identity) if per_sample is None else (per_sample.size, -1)
        shape = (size, whose, components, dtype, textures)
        if self._shape != shape:
            old = () if self._shape is None else (self.framebuffer, *self.textures)
            self._shape = None
            self.textures = tuple(self._context.ctx.texture(size, components, dtype=dtype) for _ in range(textures))
            for texture in self.textures:
                texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
            self.framebuffer = self._context.ctx.framebuffer(
                list(self.textures), None if per_sample else frame.targets.depth
            )
            self.framebuffer.depth_mask = False
            succeed(self.framebuffer, *old)
            self._context.check_errors(f"allocating the share of a light that is seen, {size[0]} x {size[1]}")
            self._shape = shape
        if per_sample is not None:
            self.framebuffer.viewport = per_sample.viewport
        self.framebuffer.use()

    def release(self) -> None:
        """Free the GPU memory."""
        if self._shape is not None:
            release(self.framebuffer, *self.textures)
