"""Triangle lists of one light on the GPU: built by a compute pass, walked by glsl/exact/lists.glsl, kept while nothing changes."""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshadow.core.spaces import Array
from glshadow.derive.cells import CASTS, CULL_BACK, CULL_FRONT, CUT_OUT, ROUND
from glshadow.derive.lists import LEAST_CELLS, ListGrid, doublings, list_grid
from glshadow.derive.resolved import ignored_size
from glshadow.derive.used import Used
from glshadow.errors import ResourceError
from glshadow.gl.driver.buffers import BufferTexture
from glshadow.gl.driver.context import GLContext
from glshadow.gl.driver.entry_points import RG32UI, RGBA32F
from glshadow.gl.driver.program import Programs
from glshadow.gl.driver.targets import release
from glshadow.gl.frame_context import FrameContext
from glshadow.gl.passes.receiver import Receiver
from glshadow.gl.scene.bodies import casters_seen, hides_back_faces
from glshadow.gl.scene.capsules import radii_of
from glshadow.gl.scene.geometry import GpuScene
from glshadow.gl.techniques.cells import FACET_BYTES, CellLists
from glshadow.gl.techniques.edges import Edges
from glshadow.gl.techniques.technique import Technique
from glshadow.gl.techniques.triangles import (
    casting_corners,
    cell_defines,
    check_facets,
    far_away,
    head_size,
    light_frame,
    made_for,
    triangle_receiver,
)
from glshadow.lights import Light
from glshadow.scene.capsules import Capsules
from glshadow.shadows.shadow import Faces, ResolvedShadow

_EVERYWHERE = (-1e9, -1e9, 1e9, 1e9)


class Listed(Technique):
    """One light's triangle lists and what they were built for.

    Attributes
    ----------
    grid : ListGrid
    lists : CellLists
    masked : bool
        Whether some casters are cut out by their texture.
    builds : int
        How often they were built.
    """

    marks_capsules = True

    def __init__(self, context: GLContext) -> None:
        self._context = context
        self._key: tuple[Hashable, ...] | None = None
        self._facets: BufferTexture | None = None
        self._traits: BufferTexture | None = None
        self.lists = CellLists(context)
        self._edges = Edges(context)
        self._values: dict[str, Any] = {}  # uniforms of the pass for an area light
        self.grid: ListGrid
        self._capsule_cells = _EVERYWHERE
        self.masked = False
        self.builds = 0

    def allocate(self, frame: FrameContext, light: Light, shadow: ResolvedShadow | None) -> None:
        """Set the light and its settings."""
        assert shadow is not None
        self.light, self._shadow = light, shadow

    def update(self, frame: FrameContext) -> Used:
        """Build the lists, unless those of this scene and light are kept.

        Raises
        ------
        ResourceError
            If the scene does not fit into the driver's buffers on any grid.
        """
        shadow = self._shadow
        built = self._update_lists(
            frame.programs, frame.scene, self.light, casters_seen(frame.scene, self.light, frame.camera_view)
        )
        fallbacks = ignored_size(self.light, shadow.filter) + far_away(frame, self.grid)
        return Used(filter=shadow.filter, faces=shadow.requested.faces, draws=int(built), links=self.lists.count, fallbacks=fallbacks,
                    why=shadow.why)  # fmt: skip

    def list_all(self, frame: FrameContext, light: Light) -> None:
        """Build lists of all triangles, whatever casts shadows; as `update`."""
        self.light = light
        self._update_lists(frame.programs, frame.scene, light, np.ones(len(frame.scene.nodes), dtype=bool))

    def _update_lists(self, programs: Programs, scene: GpuScene, light: Light, casting: NDArray[np.bool_]) -> bool:
        """Build the lists if needed; returns whether they were built."""
        key = made_for(scene, light, casting)
        if key == self._key:
            return False
        self._key = None
        check_facets(scene, self._context.caps.max_texture_buffer_size)
        traits = node_traits(scene, light, casting)
        self._write(scene, traits)
        corners = casting_corners(scene, casting)
        halvings = -doublings(*_capsules(scene, casting, corners))
        while True:
            self.grid = list_grid(light, corners, halvings, scene.corners.reshape(-1, 3))
            if self._build(programs, scene, light):
                break
            if self.grid.cells <= LEAST_CELLS:
                raise ResourceError(
                    f"Exact() needs {self.lists.count} list entries even on its coarsest grid, a texture buffer of this driver holds "
                    f"{self._context.caps.max_texture_buffer_size}: split the scene, or use another filter"
                )
            halvings += 1
        self.masked = scene.world.masks is not None
        self._capsule_cells = _cells_around(self.grid, scene.corners[scene.round & casting].reshape(-1, 3))
        self._key = key
        self.builds += 1
        return True

    def _build(self, programs: Programs, scene: GpuScene, light: Light) -> bool:
        """Dispatch over all triangles; returns whether the links fit."""
        grid, world = self.grid, scene.world
        program = programs.compute(
            "pass/lists.comp",
            defines={
                **cell_defines(grid, grid.cells),
                "GLS_AREA": int(light.has_size),
                "GLS_DOUBLE": int(self._context.caps.doubles),
                "GLS_ROUNDED": int(scene.rounded is not None),
                "GLS_CAPSULES": scene.capsules,
            },
        )
        axes, origin = light_frame(grid, scene)
        program.set(u_axes=axes, u_origin=tuple(origin), u_cells=grid.cells_from_window)
        program.set(**self._values)
        program.bind(**world.textures, u_traits=self._traits)
        if scene.rounded is not None:
            program.bind(u_smooth=scene.rounded)
        assert self._facets is not None
        size = head_size(grid, grid.cells)
        return self.lists.fill(program, size, world.count, self._context.caps.max_texture_buffer_size, self._facets)

    def _write(self, scene: GpuScene, traits: NDArray[np.uint32]) -> None:
        """Allocate the facets and upload the nodes' traits."""
        if self._traits is None or self._traits.buffer.size != traits.nbytes:
            self._traits = self._buffer(self._traits, traits.nbytes, RG32UI)
        self._traits.buffer.write(traits.tobytes())
        if self._facets is None or self._facets.buffer.size != scene.world.count * FACET_BYTES:
            self._facets = self._buffer(self._facets, scene.world.count * FACET_BYTES, RGBA32F)
        self._context.check_errors(f"allocating the facets of {scene.world.count} triangles")

    def _buffer(self, old: BufferTexture | None, size: int, internal_format: int) -> BufferTexture:
        if old is not None:
            old.release()
        return BufferTexture(self._context.gl, self._context.ctx.buffer(reserve=size), internal_format)

    def receiver(self, frame: FrameContext) -> Receiver:
        """A receiver that walks the lists."""
        return self._walked(frame)

    def marking_receiver(self, frame: FrameContext) -> Receiver:
        """The same with the silhouette edges of the casters. If there are too many, all samples of every pixel are shaded."""
        return self._marking(frame)

    def _walked(self, frame: FrameContext) -> Receiver:
        return triangle_receiver(frame, self.light, self.grid, self.masked, self._textures)

    def _marking(self, frame: FrameContext) -> Receiver:
        receiver = self._walked(frame)
        if not self._find_edges(frame):
            return replace(receiver, collected={"GLS_EVERY": 1, "GLS_NEIGHBORS": 0})
        return replace(
            receiver,
            uniforms={**receiver.uniforms, "u_capsule_cells": self._capsule_cells},
            textures={**receiver.textures, **self._edges.textures},
            marks={"GLS_MARKS": 1, **self._edges.defines},
            collected={"GLS_MARKED": 1, "GLS_NEIGHBORS": int(self._turns_unlisted(frame.scene))},
        )

    def _turns_unlisted(self, scene: GpuScene) -> bool:
        """Whether surfaces may turn away from the light where no edge is listed: beyond a spot's window, on what casts nothing, on
        smooth meshes between their edges."""
        return self.grid.projection == "perspective" or not scene.casts.all() or scene.rounded is not None

    def _find_edges(self, frame: FrameContext) -> bool:
        """Build the lists of silhouette edges, unless they are kept; returns whether they fit into the driver's buffers."""
        textures = {"u_facets": self._facets, "u_traits": self._traits}
        return self._edges.update(frame.programs, frame.scene, self.light, self.grid, self.builds, textures)

    @property
    def _textures(self) -> dict[str, Any]:
        return {"u_heads": self.lists.heads, "u_links": self.lists.links, "u_facets": self._facets}

    def release(self) -> None:
        """Free the GPU memory."""
        release(self._edges, self.lists, self._facets, self._traits)


def _capsules(scene: GpuScene, casting: NDArray[np.bool_], corners: Array) -> tuple[int, float]:
    """Number of balls and tubes that cast shadows, and their mean diameter over the extent of all casters."""
    count, total = 0, 0.0
    for node in np.flatnonzero(scene.round & casting).tolist():
        mesh = scene.nodes[node].mesh
        assert isinstance(mesh, Capsules)
        count += mesh.count
        total += mesh.count * float(radii_of(mesh, scene.world_from_mesh[node]).mean())
    return count, 2.0 * total / max(count, 1) / max(float(np.ptp(corners, axis=0).max()), 1e-300)


def _cells_around(grid: ListGrid, corners: Array) -> tuple[float, float, float, float]:
    """Least and greatest fine cell, as floats, around what has these corners (K, 3), a cell more on each side."""
    if grid.projection == "cube" or len(corners) == 0:
        return _EVERYWHERE
    local = corners @ grid.view_from_world[:3, :3].T + grid.view_from_world[:3, 3]
    if grid.projection == "perspective":
        if (local[:, 2] >= 0.0).any():
            return _EVERYWHERE
        local = local / -local[:, 2:]
    x, y, z, w = grid.cells_from_window
    places = local[:, :2] * (x, y) + (z, w)
    low, high = np.clip([places.min(axis=0) - 1.0, places.max(axis=0) + 1.0], -1e9, 1e9)
    return (float(low[0]), float(low[1]), float(high[0]), float(high[1]))


def node_traits(scene: GpuScene, light: Light, casting: NDArray[np.bool_]) -> NDArray[np.uint32]:
    """Per node (N, 2): flags, and the shift from a triangle's number to its mask's."""
    faces = light.shadow.faces if light.shadow else None
    solid = hides_back_faces(scene, light, faces)
    mirrored = np.array(scene.mirrored)
    back = solid if faces is None else np.full(len(casting), faces is Faces.FRONT)
    front = np.full(len(casting), faces is Faces.BACK)
    # a mirrored node's matrix flips the winding
    back, front = np.where(mirrored, front, back), np.where(mirrored, back, front)
    masked = np.array([gpu.cut_out for gpu in scene.meshes])
    flags = CULL_BACK * back + CULL_FRONT * front + CASTS * casting + CUT_OUT * masked + ROUND * scene.round
    return np.stack([flags, scene.world.mask_shift], axis=1).astype(np.int64).astype(np.uint32)
