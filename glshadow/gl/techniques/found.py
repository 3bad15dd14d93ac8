"""Triangles that may lie between pixels and an area light: one list per pixel, for a batch of pixels at a time."""

from __future__ import annotations

from typing import Any

import moderngl

from glshadow.gl.driver.buffers import BufferTexture
from glshadow.gl.driver.context import GLContext
from glshadow.gl.driver.entry_points import RGBA32UI
from glshadow.gl.driver.targets import release, succeed
from glshadow.gl.techniques.cells import LINK_BYTES

ROW = 1024  # pixels in a row of the passes over a batch
BATCH = 1 << 16
TOGETHER = 16  # sample points that one fragment tests: exact/found.glsl


class Found:
    """The lists, and the render targets of the passes that fill and walk them.

    Attributes
    ----------
    links : BufferTexture
    texture : moderngl.Texture
        Each pixel's first link.
    capacity : int
        Links allocated.
    side : int
        Fragments along each side of a pixel's block; they share the light's sample points.
    """

    def __init__(self, context: GLContext) -> None:
        self._context = context
        self.side = self.capacity = 0
        self._made: list[Any] = []
        self.links: BufferTexture
        self.texture: moderngl.Texture

    def reserve(self, points: int) -> None:
        """Allocate the lists, and blocks of fragments for this many sample points."""
        side = 1
        while TOGETHER * side * side < points:
            side *= 2
        if side == self.side:
            return
        ctx, rows = self._context.ctx, BATCH // ROW
        old, self._made = self._made, []
        self.texture = ctx.texture((ROW, rows), 1, dtype="u4")
        self.texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
        nobody_reads = ctx.renderbuffer((side * ROW, side * rows), 1)
        self._lists, self._blocks = ctx.framebuffer([self.texture]), ctx.framebuffer([nobody_reads])
        self._made = [self._lists, self._blocks, self.texture, nobody_reads]
        succeed(self._lists, *old)
        if self.capacity == 0:
            self.grow(1 << 16, 1 << 26)
        self._context.check_errors("allocating lists of what comes between")
        self.side = side

    def grow(self, count: int, limit: int) -> bool:
        """Allocate this many links and a margin; False: they exceed the limit."""
        if count > limit:
            return False
        if self.capacity:
            self.links.release()
        self.capacity = min(int(1.25 * count), limit)
        buffer = self._context.ctx.buffer(reserve=self.capacity * LINK_BYTES)
        self.links = BufferTexture(self._context.gl, buffer, RGBA32UI)
        self._context.check_errors(f"allocating {self.capacity} links")
        return True

    def use_lists(self, count: int) -> None:
        """Bind the target in which each of so many pixels is one fragment, which builds its list."""
        self._lists.viewport = (0, 0, ROW, -(-count // ROW))
        self._lists.use()

    def use_blocks(self, count: int) -> None:
        """Bind the target in which each of so many pixels is a block of fragments."""
        self._blocks.viewport = (0, 0, self.side * ROW, self.side * -(-count // ROW))
        self._blocks.use()

    def release(self) -> None:
        """Free the GPU memory."""
        release(*self._made, self.links if self.capacity else None)
