"""Triangle lists of one light on the GPU: built by a compute pass, walked by glsl/exact/lists.glsl, kept while nothing changes."""

from __future__ import annotations

from collections.abc import Hashable

import moderngl
import numpy as np
from numpy.typing import NDArray

from glshadow.core.decision import ignored_size
from glshadow.core.lights import Light
from glshadow.core.lists import LEAST_CELLS, MOST, RATIO, ListGrid, list_grid
from glshadow.core.shadow import Faces, Settled
from glshadow.core.used import Used
from glshadow.errors import ResourceError
from glshadow.gl.bodies import casters_on_others, hides_back_faces
from glshadow.gl.buffers import BufferTexture
from glshadow.gl.context import GLContext
from glshadow.gl.entry_points import RG32UI, RGBA32F, RGBA32UI
from glshadow.gl.geometry import GpuScene
from glshadow.gl.program import Programs
from glshadow.gl.receiver import Receiver
from glshadow.gl.sources.source import Source
from glshadow.gl.sources.triangles import casting_corners, check_facets, light_frame, made_for, triangle_receiver
from glshadow.gl.work import Work

_CULL_BACK, _CULL_FRONT, _CASTS, _CUT_OUT = 1, 2, 4, 8  # pass/lists.comp
_GROUP, _MOST_GROUPS = 64, 65535
_LINK_BYTES, _FACET_BYTES = 16, 48
_SPARE = 1.25  # a buffer that was too small grows to this much of what was needed


class Listed(Source):
    """One light's triangle lists and what they were built for.

    Attributes
    ----------
    grid : ListGrid
    links : int
        Entries of all lists together.
    masked : bool
        Whether some casters are cut out by their texture.
    builds : int
        How often they were built.
    """

    def __init__(self, context: GLContext) -> None:
        self._context = context
        self._key: tuple[Hashable, ...] | None = None
        self._heads: moderngl.Texture | None = None
        self._framebuffer: moderngl.Framebuffer | None = None
        self._links: BufferTexture | None = None
        self._facets: BufferTexture | None = None
        self._traits: BufferTexture | None = None
        self._counter = context.ctx.buffer(reserve=4)
        self.grid: ListGrid
        self.links = 0
        self.masked = False
        self.builds = 0

    def claim(self, work: Work, light: Light, shadow: Settled | None) -> None:
        """Take the light with its settings."""
        assert shadow is not None
        self.light, self._shadow = light, shadow

    def prepare(self, work: Work) -> Used:
        """Build them, unless they are those of this scene and light already.

        Raises
        ------
        ResourceError
            If the scene does not fit into the driver's buffers on any grid.
        """
        shadow = self._shadow
        built = self._update(work.programs, work.scene, self.light)
        fallbacks = ignored_size(self.light, shadow.filter)
        return Used(filter=shadow.filter, faces=shadow.asked.faces, draws=int(built), links=self.links, fallbacks=fallbacks,
                    why=shadow.why)  # fmt: skip

    def _update(self, programs: Programs, scene: GpuScene, light: Light) -> bool:
        """Whether they had to be built."""
        key = made_for(scene, light)
        if key == self._key:
            return False
        self._key = None
        limit = min(self._context.caps.max_storage_block, 16 * self._context.caps.max_texture_buffer_size)
        check_facets(scene, limit, "bytes", _FACET_BYTES)
        traits = _traits(scene, light)
        casting = (traits[:, 0] & _CASTS) != 0
        corners = casting_corners(scene, casting)
        halvings = 0
        while True:
            self.grid = list_grid(light, corners, halvings)
            self.links = self._build(programs, scene, traits)
            if self._links is not None and self.links * _LINK_BYTES <= self._links.buffer.size:
                break
            if self.links * _LINK_BYTES <= limit:
                self._reserve_links(min(int(_SPARE * self.links) * _LINK_BYTES, limit))
            elif self.grid.cells > LEAST_CELLS:
                halvings += 1
            else:
                raise ResourceError(
                    f"Exact() needs {self.links} list entries even on its coarsest grid, a buffer of this driver holds "
                    f"{limit // _LINK_BYTES}: split the scene, or use another filter"
                )
        self.masked = scene.world.masks is not None
        self._key = key
        self.builds += 1
        return True

    def _build(self, programs: Programs, scene: GpuScene, traits: NDArray[np.uint32]) -> int:
        """One pass over all triangles; how many links it wanted."""
        context, grid, world = self._context, self.grid, scene.world
        ctx = context.ctx
        self._reserve(scene)
        assert self._heads is not None
        assert self._framebuffer is not None
        assert self._links is not None
        assert self._facets is not None
        program = programs.compute(
            "pass/lists.comp",
            defines={
                "GLS_SUN": int(grid.kind == "directional"),
                "GLS_POINT": int(grid.kind == "point"),
                "GLS_CELLS": grid.cells,
                "GLS_RATIO": RATIO,
                "GLS_MOST": MOST,
            },
        )
        axes, origin = light_frame(grid, scene)
        program.set(
            u_axes=axes,
            u_origin=tuple(origin),
            u_triangles=world.count,
            u_capacity=self._links.buffer.size // _LINK_BYTES,
            u_cells=grid.cells_from_window,
        )
        self._framebuffer.use()
        context.gl.clear_unsigned(0, (0, 0, 0, 0))
        self._counter.write(b"\0\0\0\0")
        self._write_traits(traits)
        assert self._traits is not None
        program.bind(**world.textures, u_traits=self._traits)
        for binding, buffer in enumerate((self._facets.buffer, self._links.buffer, self._counter)):
            buffer.bind_to_storage_buffer(binding)
        self._heads.bind_to_image(0, read=True, write=True)
        groups = -(-world.count // _GROUP)
        program.run(min(groups, _MOST_GROUPS), -(-groups // _MOST_GROUPS))
        ctx.memory_barrier()
        return int(np.frombuffer(self._counter.read(), dtype=np.uint32)[0])

    def _write_traits(self, traits: NDArray[np.uint32]) -> None:
        if self._traits is None or self._traits.buffer.size != traits.nbytes:
            self._traits = self._buffer(self._traits, traits.nbytes, RG32UI)
        self._traits.buffer.write(traits.tobytes())

    def _reserve(self, scene: GpuScene) -> None:
        context, grid = self._context, self.grid
        size = (grid.cells, grid.faces * (grid.cells + grid.cells // RATIO))
        if self._heads is None or self._heads.size != size:
            old = (self._framebuffer, self._heads)
            self._heads = context.ctx.texture(size, 1, dtype="u4")
            self._heads.filter = (moderngl.NEAREST, moderngl.NEAREST)
            self._framebuffer = context.ctx.framebuffer([self._heads])
            self._framebuffer.use()  # before the old one goes: moderngl would bind that again
            for thing in old:
                if thing is not None:
                    thing.release()
        if self._facets is None or self._facets.buffer.size != scene.world.count * _FACET_BYTES:
            self._facets = self._buffer(self._facets, scene.world.count * _FACET_BYTES, RGBA32F)
        if self._links is None:
            self._reserve_links(max(2 * scene.world.count, 1 << 16) * _LINK_BYTES)
        context.check_errors(f"allocating the triangle lists of {scene.world.count} triangles")

    def _reserve_links(self, size: int) -> None:
        self._links = self._buffer(self._links, size, RGBA32UI)
        self._context.check_errors(f"allocating triangle lists of {size} bytes")

    def _buffer(self, old: BufferTexture | None, size: int, internal_format: int) -> BufferTexture:
        if old is not None:
            old.release()
        return BufferTexture(self._context.gl, self._context.ctx.buffer(reserve=size), internal_format)

    def receiver(self, work: Work) -> Receiver:
        """Walk them."""
        textures = {"u_heads": self._heads, "u_links": self._links, "u_facets": self._facets}
        return triangle_receiver(work, self.light, self.grid, "lists", self.masked, textures)

    def release(self) -> None:
        """Free the GPU memory."""
        for thing in (self._links, self._facets, self._traits, self._framebuffer, self._heads, self._counter):
            if thing is not None:
                thing.release()


def _traits(scene: GpuScene, light: Light) -> NDArray[np.uint32]:
    """Per node (N, 2): flags, and what turns a triangle's number into its mask's."""
    faces = light.shadow.faces if light.shadow else None
    casting, solid = casters_on_others(scene, light), hides_back_faces(scene, light, faces)
    mirrored = np.array(scene.mirrored)
    back = solid if faces is None else np.full(len(casting), faces is Faces.FRONT)
    front = np.full(len(casting), faces is Faces.BACK)
    # a mirrored node's winding is turned over by its matrix
    back, front = np.where(mirrored, front, back), np.where(mirrored, back, front)
    masked = scene.world.mask_shift != 0
    flags = _CULL_BACK * back + _CULL_FRONT * front + _CASTS * casting + _CUT_OUT * masked
    return np.stack([flags, scene.world.mask_shift], axis=1).astype(np.int64).astype(np.uint32)
