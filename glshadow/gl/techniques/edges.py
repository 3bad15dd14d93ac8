"""Silhouette edges of a light's casters on the GPU, in per-cell lists: a pixel whose footprint an edge crosses may have samples that
differ."""

from __future__ import annotations

from typing import Any

import moderngl
import numpy as np

from glshadow.derive.lists import ListGrid
from glshadow.gl.driver.buffers import BufferTexture
from glshadow.gl.driver.context import GLContext
from glshadow.gl.driver.entry_points import R32UI
from glshadow.gl.driver.program import Programs
from glshadow.gl.driver.targets import release
from glshadow.gl.scene.geometry import GpuScene
from glshadow.gl.techniques.cells import CellLists
from glshadow.gl.techniques.triangles import cell_defines
from glshadow.lights import Light
from glshadow.shader.slots import parallel_define

_GROUP, _MOST_GROUPS = 64, 65535
_RATIO = 4  # between grids: lib/edge_grids.glsl
_GRIDS = 4


class Edges:
    """One light's silhouette edges, listed for the first multisampled frame.

    Attributes
    ----------
    count : int
        Silhouette edges.
    """

    def __init__(self, context: GLContext) -> None:
        self._context = context
        self._lists = CellLists(context)
        self._counter = context.ctx.buffer(reserve=4)
        self._build = -1
        self._fits = False
        self._cells = self._grids = self.count = 0

    def update(
        self, programs: Programs, scene: GpuScene, light: Light, grid: ListGrid, build: int, textures: dict[str, Any],
    ) -> bool:  # fmt: skip
        """Build the lists, unless those of this build of the light's triangles are kept.

        Parameters
        ----------
        textures : dict
            Facets and traits.

        Returns
        -------
        False: even the lists of the coarsest grid do not fit.
            False: even those of the coarsest grid need more.
        """
        if build != self._build:
            self._build = -1
            edges = self._find(programs, scene, light, grid, textures)
            try:
                self._fits = edges is not None and self._fill(programs, grid, edges, textures)
            finally:
                release(edges)
            self._build = build
        return self._fits

    def _find(
        self, programs: Programs, scene: GpuScene, light: Light, grid: ListGrid, textures: dict[str, Any]
    ) -> BufferTexture | None:
        """A list of the edges; None: it would be too large."""
        program = programs.compute("pass/edges.comp", defines=parallel_define(grid.projection))
        count = scene.world.count
        program.set(u_part=(0, count, 1), u_radius=light.source_radius)
        caps = self._context.caps
        limit = min(caps.max_storage_block // 4, caps.max_texture_buffer_size)
        program.bind(**scene.world.textures, **textures, u_neighbours=scene.world.neighbours)
        capacity = min(max(count // 2, 1 << 16), limit)
        while True:
            edges = BufferTexture(self._context.gl, self._context.ctx.buffer(reserve=4 * capacity), R32UI)
            edges.buffer.bind_to_storage_buffer(0)
            self._counter.write(bytes(4))
            self._counter.bind_to_storage_buffer(1)
            program.set(u_capacity=capacity)
            groups = -(-count // _GROUP)
            program.run(min(groups, _MOST_GROUPS), -(-groups // _MOST_GROUPS))
            self._context.ctx.memory_barrier()
            self._context.check_errors(f"listing silhouette edges of {count} triangles")
            self.count = int(np.frombuffer(self._counter.read(), dtype=np.uint32)[0])
            if self.count <= capacity:
                return edges
            edges.release()
            if self.count > limit:
                return None
            capacity = self.count

    def _fill(self, programs: Programs, grid: ListGrid, edges: BufferTexture, textures: dict[str, Any]) -> bool:
        """Sort the edges into per-cell lists, with fewer grids if there are too many links."""
        for self._grids in range(_GRIDS, 0, -1):
            self._cells = (512 if grid.faces == 1 else 256) // _RATIO ** (_GRIDS - self._grids)
            defines = {**cell_defines(grid, grid.cells), **self.defines}
            program = programs.compute("pass/edge_lists.comp", defines=defines)
            program.set(u_cells=grid.cells_from_window)
            program.bind(u_facets=textures["u_facets"], u_edges=edges)
            rows = sum(self._cells // _RATIO**i for i in range(self._grids))
            size = (self._cells, rows * grid.faces)
            if self._lists.fill(program, size, self.count, self._context.caps.max_texture_buffer_size):
                return True
        return False

    @property
    def defines(self) -> dict[str, int | str]:
        """Defines of lib/edge_grids.glsl."""
        return {"GLS_EDGE_CELLS": self._cells, "GLS_EDGE_GRIDS": self._grids}

    @property
    def textures(self) -> dict[str, moderngl.Texture | BufferTexture | None]:
        """Textures of exact/edges.glsl."""
        return {"u_edge_heads": self._lists.heads, "u_edge_links": self._lists.links}

    def release(self) -> None:
        """Free the GPU memory."""
        release(self._lists, self._counter)
