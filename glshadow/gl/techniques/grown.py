"""Casters and silhouette edges of an area light, in per-cell lists whose entries are grown by how far shadows move across its size."""

from __future__ import annotations

from typing import Any

import moderngl
import numpy as np

from glshadow.derive.lists import ListGrid, local_light_spread
from glshadow.gl.driver.context import GLContext
from glshadow.gl.driver.program import Programs
from glshadow.gl.driver.targets import release, succeed
from glshadow.gl.scene.geometry import GpuScene
from glshadow.gl.techniques.cells import CellLists
from glshadow.gl.techniques.triangles import cell_defines, light_frame
from glshadow.lights import Light

_GROUNDS = 64  # these constants: lib/cells.glsl
_GROWN = 256
_LEVELS = 6
DEFINES: dict[str, int | str] = {"GLS_GROWN": _GROWN}
"""Defines of exact/grown.glsl, which walks the lists."""


class Grown:
    """The grown lists of one light.

    Attributes
    ----------
    casters, silhouettes : CellLists
    widest : int
        Triangles whose shadows move by a quarter of the window or more: most receivers walk them.
    longest : int
        Length of the longest list that a receiver walks.
    most : int
        Links of the longer of the two lists; if they did not fit, the links needed.
    values : dict
        Uniforms of all passes that fill or walk the grown lists.
    """

    def __init__(self, context: GLContext) -> None:
        self._context = context
        self.casters, self.silhouettes = CellLists(context), CellLists(context)
        self.values: dict[str, Any] = {}
        self.widest = self.longest = self.most = 0
        self._grounds: tuple[moderngl.Texture, ...] = ()
        self._framebuffer: moderngl.Framebuffer | None = None

    def begin(self, scene: GpuScene, light: Light, grid: ListGrid) -> None:
        """Allocate the depth of the deepest receivers, which pass/lists.comp finds."""
        self._depths = _depths(scene, grid)
        self.values = {"u_radius": light.source_radius, "u_depths": self._depths}
        size = (_GROUNDS, _GROUNDS * grid.faces)
        if not self._grounds or self._grounds[0].size != size:
            old = (self._framebuffer, *self._grounds)
            self._grounds = tuple(self._context.ctx.texture(size, 1, dtype="u4") for _ in range(2))
            for texture in self._grounds:
                texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
            self._framebuffer = self._context.ctx.framebuffer([self._grounds[0]])
            succeed(self._framebuffer, *old)
        assert self._framebuffer is not None
        self._framebuffer.use()
        self._context.gl.clear_unsigned(0, (0, 0, 0, 0))
        self._grounds[0].bind_to_image(1, read=True, write=True)

    def build(
        self, programs: Programs, scene: GpuScene, light: Light, grid: ListGrid, limit: int, textures: dict[str, Any]
    ) -> bool:
        """Fill the lists, after pass/lists.comp; False: they need more links than the limit.

        Parameters
        ----------
        textures : dict
            Facets and traits.
        """
        ground, around = self._grounds
        defines: dict[str, int | str] = {"GLS_GROUNDS": _GROUNDS, "GLS_POINT": int(grid.projection == "cube")}
        program = programs.compute("pass/grounds.comp", defines=defines)
        program.set(u_around=_farthest(grid, light.source_radius, self._depths), u_depths=self._depths)
        program.bind(u_ground=ground)
        around.bind_to_image(0, read=False, write=True)
        program.run(_GROUNDS // 8, grid.faces * _GROUNDS // 8)
        self._context.ctx.memory_barrier()
        grids: dict[str, int | str] = {"GLS_GROUNDS": _GROUNDS, "GLS_GROWN": _GROWN, "GLS_LEVELS": _LEVELS}
        count, size = scene.world.count, (_GROWN, 2 * _GROWN * grid.faces)
        self.widest = self.longest = self.most = 0
        for silhouettes, lists in enumerate((self.casters, self.silhouettes)):
            defines = {**cell_defines(grid, grid.cells), **grids, "GLS_SILHOUETTES": silhouettes}
            program = programs.compute("pass/grown.comp", defines=defines)
            program.set(**self.values, u_cells=grid.cells_from_window)
            program.bind(**scene.world.textures, **textures, u_neighbours=scene.world.neighbours, u_ground=ground,
                         u_ground_around=around)  # fmt: skip
            fits = lists.fill(program, size, count, limit)
            self.most = max(self.most, lists.count)
            if not fits:
                return False
            self._chain(programs, lists, grid.faces)
        return True

    def _chain(self, programs: Programs, lists: CellLists, faces: int) -> None:
        """Merge the lists that each receiver walks into one."""
        assert lists.links is not None
        assert lists.heads is not None
        program = programs.compute("pass/chain.comp", defines={"GLS_GROWN": _GROWN})
        lists.links.bind_to_image(1)
        program.bind(u_links=lists.links)
        lists.counter.bind_to_storage_buffer(2)
        lists.heads.bind_to_image(0, read=True, write=True)
        for level in reversed(range(_LEVELS - 1)):
            program.set(u_level=level)
            program.run((_GROWN >> level) // 8, faces * (_GROWN >> level) // 8)
            self._context.ctx.memory_barrier()
        _, wide, *longest = np.frombuffer(lists.counter.read(), dtype=np.uint32).tolist()
        self.widest, self.longest = max(self.widest, wide), max(self.longest, wide + sum(longest))

    def release(self) -> None:
        """Free the GPU memory."""
        release(self.casters, self.silhouettes, self._framebuffer, *self._grounds)


def _depths(scene: GpuScene, grid: ListGrid) -> tuple[float, float]:
    """Least depth of a caster and greatest depth of a receiver, in the light's frame."""
    axes, origin = light_frame(grid, scene)
    local = (scene.raised_corners - scene.origin - origin) @ axes.T
    if grid.projection == "cube":
        low, high = local.min(axis=1), local.max(axis=1)
        nearest = np.linalg.norm(np.maximum(np.maximum(low, -high), 0.0), axis=1).min() / np.sqrt(3.0)
        return 0.999 * float(nearest), 1.001 * float(np.linalg.norm(local, axis=-1).max())
    depth = -local[..., 2]
    slack = 1e-5 * float(np.abs(local).max())
    return float(depth.min()) - slack, float(depth.max()) + slack


def _farthest(grid: ListGrid, radius: float, depths: tuple[float, float]) -> int:
    """Cells of the coarse receiver grid over which shadows move, at most."""
    least, deepest = depths
    if grid.projection == "orthographic":
        spread = radius * (deepest - least)
    elif least <= radius:
        return _GROUNDS
    else:
        left, right, bottom, top = grid.window
        spread = local_light_spread(
            radius, np.array([[left, bottom], [left, top], [right, bottom], [right, top]]), least, deepest
        )
    return min(int(np.ceil(spread * max(grid.cells_from_window[:2]) * _GROUNDS / grid.cells)) + 1, _GROUNDS)
