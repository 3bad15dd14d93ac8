"""Per-cell lists on the GPU: heads, links, and a counter that reports how many links were needed."""

from __future__ import annotations

import moderngl
import numpy as np

from glshadow.gl.driver.buffers import PART, BufferTexture
from glshadow.gl.driver.context import GLContext
from glshadow.gl.driver.entry_points import RGBA32UI
from glshadow.gl.driver.program import ComputeProgram
from glshadow.gl.driver.targets import release, succeed

LINK_BYTES, FACET_BYTES = 16, 48
_COUNTER_BYTES = 40  # Counter of lib/cells.glsl and pass/chain.comp
_GROUP, _MOST_GROUPS = 64, 65535
_SPARE = 1.25  # a buffer of links that was too small grows to this multiple of what was needed
_LEAST = 1 << 16
# For scenes of so many triangles the links of one in 64 are counted first: a second pass over all takes longer.
_MANY, _EVERY = 1 << 20, 64


class CellLists:
    """Lists that lib/cells.glsl fills and glsl/exact/lists.glsl walks.

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
        self._part = 1 << 31  # triangles of one dispatch, at most

    def fill(
        self,
        program: ComputeProgram,
        size: tuple[int, int],
        triangles: int,
        limit: int,
        facets: BufferTexture | None = None,
    ) -> bool:
        """Run a pass that fills the lists; run it again if there were too few links. Its other resources are bound already.

        Parameters
        ----------
        size : (2,) ints
            Columns and rows of heads.
        triangles : int
            One invocation each.
        limit : int
            Most links.
        facets : BufferTexture, optional
            What the pass also writes for each triangle.

        Returns
        -------
        bool
            False: they do not fit into the limit; `count` is the number that was needed.
        """
        self._reserve_heads(size)
        if self.links is None:
            self._reserve_about(program, triangles, limit, facets)
        while True:
            need, most = self._run(program, triangles, facets)
            assert self.links is not None
            crowded = most > self._most_links
            if need <= self.links.buffer.size // LINK_BYTES and not crowded:
                return True
            if need > limit or (crowded and self._part == _GROUP):
                return False
            if crowded:
                self._part = max(int(self._part * self._most_links / (_SPARE * most)) // _GROUP, 1) * _GROUP
            self.reserve(min(int(_SPARE * need), limit) * LINK_BYTES)

    @property
    def _most_links(self) -> int:
        """Limits of one dispatch that a storage buffer can hold."""
        return self._context.caps.max_storage_block // LINK_BYTES

    def _reserve_about(self, program: ComputeProgram, triangles: int, limit: int, facets: BufferTexture | None) -> None:
        """Initial number of links: two for each triangle; for many triangles an estimate from some of them."""
        links = 2 * triangles
        if triangles > _MANY:
            self.reserve(PART)
            links = int(_SPARE * _EVERY * self._run(program, triangles, facets, _EVERY)[0])
        self.reserve(min(max(links, _LEAST), limit) * LINK_BYTES)

    def _run(
        self, program: ComputeProgram, triangles: int, facets: BufferTexture | None, every: int = 1
    ) -> tuple[int, int]:
        """Dispatch over all triangles, or over one in so many, in parts that storage buffers hold. Returns the links needed in all and
        the most of one part."""
        assert self._framebuffer is not None
        assert self.heads is not None
        assert self.links is not None
        self._framebuffer.use()
        self._context.gl.clear_unsigned(0, (0, 0, 0, 0))
        self.counter.write(bytes(_COUNTER_BYTES))
        self.counter.bind_to_storage_buffer(2)
        self.heads.bind_to_image(0, read=True, write=True)
        self._part = min(self._part, max(self._context.caps.max_storage_block // FACET_BYTES // _GROUP, 1) * _GROUP)
        capacity = self.links.buffer.size // LINK_BYTES
        self.count = start = need = most = 0
        for first in range(0, triangles, self._part):
            end = min(first + self._part, triangles)
            room = max(min(capacity - start, self._most_links), 0)
            self.links.bind_to_storage(1, start * LINK_BYTES if room else 0, room * LINK_BYTES or PART)
            if facets is not None:
                facets.bind_to_storage(0, first * FACET_BYTES, (end - first) * FACET_BYTES)
            self.counter.write(bytes(4))  # links of this part
            program.set(u_part=(first, end, every), u_first_link=start, u_capacity=room)
            groups = -(-(end - first) // (every * _GROUP))
            program.run(min(groups, _MOST_GROUPS), -(-groups // _MOST_GROUPS))
            self._context.ctx.memory_barrier()
            found = int(np.frombuffer(self.counter.read(4), dtype=np.uint32)[0])
            self.count += found
            most, need = max(most, found), start + found
            start = -(-need * LINK_BYTES // PART) * PART // LINK_BYTES
        return need, most

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
