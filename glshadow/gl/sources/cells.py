"""Lists of a grid's cells on the GPU: heads, links, and a counter that says how long the links should have been."""

from __future__ import annotations

import moderngl
import numpy as np

from glshadow.gl.buffers import BufferTexture
from glshadow.gl.context import GLContext
from glshadow.gl.entry_points import RGBA32UI
from glshadow.gl.program import ComputeProgram
from glshadow.gl.targets import release, succeed

LINK_BYTES = 16
_COUNTER_BYTES = 40  # Counter of lib/cells.glsl and pass/chain.comp
_GROUP, _MOST_GROUPS = 64, 65535
_SPARE = 1.25  # links that were too few grow to this much of what was needed
_LEAST = 1 << 16
_MANY, _EVERY = 1 << 20, 64  # triangles whose links are counted first, one of so many: a second pass over all would take longer


class CellLists:
    """What lib/cells.glsl fills and glsl/exact/lists.glsl walks.

    Attributes
    ----------
    count : int
        Links of all lists together.
    """

    def __init__(self, context: GLContext) -> None:
        self._context = context
        self.heads: moderngl.Texture | None = None
        self.links: BufferTexture | None = None
        self._framebuffer: moderngl.Framebuffer | None = None
        self.counter = context.ctx.buffer(reserve=_COUNTER_BYTES)
        self.count = 0

    def fill(self, program: ComputeProgram, size: tuple[int, int], invocations: int, limit: int) -> bool:
        """Run a pass that fills them, again where the links were too few; its other resources are bound already.

        Parameters
        ----------
        size : (2,) ints
            Columns and rows of heads.
        invocations : int
            Triangles: one each.
        limit : int
            Most links.

        Returns
        -------
        bool
            False: they do not fit into the limit; `count` says how many there should have been.
        """
        self._reserve_heads(size)
        if self.links is None:
            self._reserve_about(program, invocations, limit)
        while True:
            self.count = self._run(program, invocations)
            assert self.links is not None
            if self.count * LINK_BYTES <= self.links.buffer.size:
                return True
            if self.count > limit:
                return False
            self.reserve(min(int(_SPARE * self.count), limit) * LINK_BYTES)

    def _reserve_about(self, program: ComputeProgram, invocations: int, limit: int) -> None:
        """Links to begin with: two for each triangle, or of many triangles what some of them need."""
        links = 2 * invocations
        if invocations > _MANY:
            self.reserve(LINK_BYTES)
            links = int(_SPARE * _EVERY * self._run(program, invocations, _EVERY))
        self.reserve(min(max(links, _LEAST), limit) * LINK_BYTES)

    def _run(self, program: ComputeProgram, invocations: int, every: int = 1) -> int:
        """Links of all triangles, or of one of so many, counted and written as far as there is room."""
        assert self._framebuffer is not None
        assert self.heads is not None
        assert self.links is not None
        self._framebuffer.use()
        self._context.gl.clear_unsigned(0, (0, 0, 0, 0))
        self.counter.write(bytes(_COUNTER_BYTES))
        self.links.bind_to_image(2)
        self.counter.bind_to_storage_buffer(2)
        self.heads.bind_to_image(0, read=True, write=True)
        program.set(u_capacity=self.links.buffer.size // LINK_BYTES, u_every=every)
        groups = -(-invocations // (every * _GROUP))
        program.run(min(groups, _MOST_GROUPS), -(-groups // _MOST_GROUPS))
        self._context.ctx.memory_barrier()
        return int(np.frombuffer(self.counter.read(), dtype=np.uint32)[0])

    def _reserve_heads(self, size: tuple[int, int]) -> None:
        if self.heads is not None and self.heads.size == size:
            return
        old = (self._framebuffer, self.heads)
        self.heads = self._context.ctx.texture(size, 1, dtype="u4")
        self.heads.filter = (moderngl.NEAREST, moderngl.NEAREST)
        self._framebuffer = self._context.ctx.framebuffer([self.heads])
        succeed(self._framebuffer, *old)
        self._context.check_errors(f"allocating a grid of {size[0]} x {size[1]} cells")

    def reserve(self, size: int) -> None:
        """Bytes of links."""
        old = self.links
        self.links = None
        release(old)
        self.links = BufferTexture(self._context.gl, self._context.ctx.buffer(reserve=size), RGBA32UI)
        self._context.check_errors(f"allocating lists of {size} bytes")

    def release(self) -> None:
        """Free the GPU memory."""
        release(self.links, self._framebuffer, self.heads, self.counter)
