"""Triangle lists of one light, built on the CPU for drivers without compute shaders, and walked by glsl/exact/lists.glsl like others."""

from __future__ import annotations

from collections.abc import Hashable
from typing import Any

import moderngl
import numpy as np
from numpy.typing import NDArray

from glshadow.derive.cells import CUT_OUT, CellLists, cell_lists
from glshadow.derive.lists import LEAST_CELLS, ListGrid, list_grid
from glshadow.derive.resolved import ignored_size
from glshadow.derive.used import Used
from glshadow.errors import ResourceError
from glshadow.gl.driver.buffers import BufferTexture
from glshadow.gl.driver.context import GLContext
from glshadow.gl.driver.entry_points import RGBA32F, RGBA32UI
from glshadow.gl.driver.targets import release, released_on_error
from glshadow.gl.frame_context import FrameContext
from glshadow.gl.passes.receiver import Receiver
from glshadow.gl.scene.bodies import casters_seen
from glshadow.gl.scene.geometry import GpuScene
from glshadow.gl.scene.world import local_positions
from glshadow.gl.techniques.listed import node_traits
from glshadow.gl.techniques.technique import Technique
from glshadow.gl.techniques.triangles import (
    casting_corners,
    check_facets,
    far_away,
    light_frame,
    made_for,
    triangle_receiver,
)
from glshadow.lights import Light
from glshadow.shadows.shadow import ResolvedShadow

_WHY = "triangle lists are built on the CPU: building them on the GPU needs OpenGL 4.3, {} has {:.1f}"
_TEXEL = 16  # bytes
_KEPT = 1 << 29  # bytes of kept lists of lights that take turns; lists beyond are rebuilt at each turn


class _Lists:
    """One light's lists in textures.

    Attributes
    ----------
    grid : ListGrid
    count : int
        Links of all lists together.
    """

    def __init__(self, context: GLContext) -> None:
        self._context = context
        self._heads: moderngl.Texture | None = None
        self._links: BufferTexture | None = None
        self._facets: BufferTexture | None = None
        self.grid: ListGrid
        self.count = self.bytes = 0

    @property
    def textures(self) -> dict[str, Any]:
        """The textures by sampler name."""
        return {"u_heads": self._heads, "u_links": self._links, "u_facets": self._facets}

    def write(self, grid: ListGrid, lists: CellLists) -> None:
        """Upload these lists in place of the old ones."""
        self.grid, self.count = grid, lists.count
        heads, facets, links = self._heads, self._facets, self._links
        self._heads = self._facets = self._links = None
        with released_on_error([each for each in (heads, facets, links) if each is not None]):
            size = lists.heads.shape[::-1]
            if heads is None or heads.size != size:
                release(heads)
                heads = self._context.ctx.texture(size, 1, dtype="u4")
                heads.filter = (moderngl.NEAREST, moderngl.NEAREST)
            heads.write(lists.heads.tobytes())
            self._heads = heads
            self._facets = self._written(facets, lists.facets, RGBA32F)
            self._links = self._written(links, lists.links, RGBA32UI)
        self.bytes = lists.heads.nbytes + self._facets.buffer.size + self._links.buffer.size
        self._context.check_errors(f"uploading {lists.count} list entries and {len(lists.facets)} facets")

    def _written(self, old: BufferTexture | None, data: NDArray[Any], internal_format: int) -> BufferTexture:
        """Data in a buffer texture; reuses the old one if it is large enough and not more than twice as large."""
        if old is None or not data.nbytes <= old.buffer.size <= 2 * data.nbytes:
            release(old)
            buffer = self._context.ctx.buffer(reserve=max(data.nbytes, _TEXEL))
            old = BufferTexture(self._context.gl, buffer, internal_format)
        old.buffer.write(data.tobytes())
        return old

    def release(self) -> None:
        """Free the GPU memory."""
        release(self._heads, self._links, self._facets)


class Uploaded(Technique):
    """One light's triangle lists, built by `derive.cells` and uploaded; or the lists of several lights that take turns.

    Attributes
    ----------
    lists : _Lists
        Lists of the light that was updated last.
    builds : int
        How often lists were built.
    """

    def __init__(self, context: GLContext) -> None:
        self._context = context
        self._expected: tuple[Light, ...] = ()
        self._made: dict[tuple[Hashable, ...], _Lists] = {}  # by cache key
        self._key: tuple[Hashable, ...] = ()
        self.lists = _Lists(context)
        self.builds = 0

    def allocate(self, frame: FrameContext, light: Light, shadow: ResolvedShadow | None) -> None:
        """Set the light and its settings."""
        assert shadow is not None
        self.light, self._shadow = light, shadow

    def expect(self, lights: tuple[Light, ...]) -> None:
        """Keep the lists of these lights, which take turns; drop those of other lights."""
        if lights != self._expected:
            self._expected = lights
            self._forget()

    def _forget(self) -> None:
        release(*(each for each in self._made.values() if each is not self.lists))
        self._made.clear()

    def update(self, frame: FrameContext) -> Used:
        """Build the lists, unless those of this scene and light are kept.

        Raises
        ------
        ResourceError
            If the scene does not fit into the driver's buffer textures on any grid.
        """
        shadow, caps = self._shadow, frame.caps
        built = self._update_lists(frame.scene, self.light, casters_seen(frame.scene, self.light, frame.camera_view))
        why = f"{shadow.why}; {_WHY.format(caps.renderer, caps.version_code / 100)}"
        return Used(filter=shadow.filter, faces=shadow.requested.faces, draws=int(built), links=self.lists.count,
                    fallbacks=ignored_size(self.light, shadow.filter) + far_away(frame, self.lists.grid), why=why)  # fmt: skip

    def list_all(self, frame: FrameContext, light: Light) -> None:
        """Build lists of all triangles, whatever casts shadows; as `update`."""
        self.light = light
        self._update_lists(frame.scene, light, np.ones(len(frame.scene.nodes), dtype=bool))

    def _update_lists(self, scene: GpuScene, light: Light, casting: NDArray[np.bool_]) -> bool:
        """Build the lists if needed; returns whether they were built."""
        key = made_for(scene, light, casting)
        if key in self._made:
            self._key, self.lists = key, self._made[key]
            return False
        if any(scene.identity != other[0] for other in self._made):
            self._forget()
        grid, lists = self._built(scene, light, casting)
        if self.lists in self._made.values():
            if self._expected and sum(each.bytes for each in self._made.values()) < _KEPT:
                self.lists = _Lists(self._context)
            else:
                del self._made[self._key]  # replaced by the new lists
        self.lists.write(grid, lists)
        self._key, self._made[key] = key, self.lists
        self.builds += 1
        return True

    def _built(self, scene: GpuScene, light: Light, casting: NDArray[np.bool_]) -> tuple[ListGrid, CellLists]:
        """Build the lists on the finest grid on which they fit."""
        limit = self._context.caps.max_texture_buffer_size
        if scene.capsules:
            raise ResourceError("Exact() of points and lines needs OpenGL 4.3: use a filter with a map")
        check_facets(scene, limit)
        world, triangles = scene.world.positions, scene.world.triangles
        numbers = triangles[:, :3]
        flags, shift = node_traits(scene, light, casting)[triangles[:, 3]].T
        masks = np.where(flags & CUT_OUT, np.arange(len(flags), dtype=np.uint32) + shift, np.uint32(0))
        corners = casting_corners(scene, casting)
        halvings = 0
        while True:
            grid = list_grid(light, corners, halvings, scene.corners.reshape(-1, 3))
            axes, origin = light_frame(grid, scene)
            vertices = local_positions(scene.world, axes, origin)
            lists = cell_lists(grid, vertices, world, axes, numbers, flags, masks, limit)
            if lists.count <= limit:
                return grid, lists
            if grid.cells <= LEAST_CELLS:
                raise ResourceError(
                    f"Exact() needs {lists.count} list entries even on its coarsest grid, a buffer texture of this driver holds {limit}: "
                    "split the scene, or use another filter"
                )
            halvings += 1

    def receiver(self, frame: FrameContext) -> Receiver:
        """A receiver that walks the lists."""
        masked = frame.scene.world.masks is not None
        return triangle_receiver(frame, self.light, self.lists.grid, masked, self.lists.textures)

    def release(self) -> None:
        """Free the GPU memory."""
        self._forget()
        self.lists.release()
