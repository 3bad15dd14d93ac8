"""A scene on the GPU: its draws, and per-triangle data for the passes."""

from __future__ import annotations

import itertools
import weakref
from collections.abc import Hashable, Iterator
from typing import TYPE_CHECKING

import moderngl
import numpy as np
from numpy.typing import NDArray

from glshadow.core.spaces import Array
from glshadow.errors import ResourceError
from glshadow.geometry.clusters import Placed, place
from glshadow.geometry.smooth import heights, pack_octahedral, sides, unit_vectors
from glshadow.gl.driver.buffers import BufferTexture, texture_buffer
from glshadow.gl.driver.context import GLContext
from glshadow.gl.driver.entry_points import R32UI, RGBA32F, RGBA32UI
from glshadow.gl.driver.targets import release
from glshadow.gl.scene.capsules import CAPSULE, GpuCapsules
from glshadow.gl.scene.copies import copies_of
from glshadow.gl.scene.kept_meshes import Meshes
from glshadow.gl.scene.matrices import normal_matrices, pack_matrices, placed, raised
from glshadow.gl.scene.meshes import face_normals
from glshadow.gl.scene.paint import Features
from glshadow.gl.scene.reuse import Before, write_rows
from glshadow.gl.scene.textures import albedo_texture
from glshadow.gl.scene.world import WorldTriangles
from glshadow.scene.mesh import Mesh
from glshadow.scene.nodes import Node, Scene

if TYPE_CHECKING:
    from glshadow.gl.scene.bodies import Casters

# flag bits of triangle IDs, see lib/surface_number.glsl
NOT_RECEIVING = 1 << 31
CATCHING = 1 << 30
TRIANGLES = CATCHING - 1
"""The bits of a triangle's ID, which counts from 1."""
_AT_ONCE = 1 << 18  # triangles per batch of plane computation


class GpuScene:
    """A scene on the GPU: its draws, and for each drawn triangle its plane and its node, read by the resolve pass.

    Attributes
    ----------
    nodes : tuple of Node
        Those of the scene's drawn nodes that were chosen, in the order of `chosen`.
    scene_numbers : (N,) int
        Their indices in the scene.
    meshes : list of GpuMesh
        One per node, shared by instances.
    count : int
        Triangles of all nodes.
    first : (N,) int
        Index of each node's first triangle, from 0, over the whole scene.
    boxes, corners : (N, 2, 3) and (N, 4, 4), (N, 8, 3) float64
        Mesh bounds and `world_from_mesh`; world corners of the boxes.
    world_from_mesh : (N, 4, 4) float64
    world_from_origin : (N, 4, 4) float64
        Places the float32 vertices: world_from_mesh times the translation to the mesh's origin.
    origin : (3,) float64
        World point that the planes are relative to: the median corner, where most of the scene is even if one triangle lies far away.
    round : (N,) bool
        Nodes of points or lines, whose elements are capsules.
    capsules : int
        0: there are no such nodes; 1: all elements are balls; 2: some are tubes.
    color : (3,) floats or None
        The base colour, where all nodes share one and none has a texture or vertex colours.
    textured : bool
        Whether some base colour varies within a triangle, by a texture or vertex colours, or its materials need `features`.
    features, channels : Features, int
        Of its materials; of the surface buffer.
    culls : (N,) bool
        Whether the camera sees through triangles from behind.
    selective, catches : bool
        Whether some nodes receive no shadows; whether some are shadow catchers, which show only the shadow on them.
    copies : (N,) bool
        Nodes that coincide with another one and need not be drawn: the same triangles at the same place, whatever their colour.
    casts : (N,) bool
        All but copies, blended nodes and those with `casts` off.
    blends, tints : (N,) bool
        Which nodes are composited over what is behind them, and those of them that tint what light passes through them.
    closed : (N,) bool
        Whether back faces are invisible from outside.
    casting : dict
        Which nodes darken anything, by `Light.geometry`: see `gl.scene.bodies`.
    rounded : BufferTexture or None
        Per drawn triangle its vertices' normals, see lib/smooth_point.glsl; None where all triangles are flat.
    lifts : (N,) float64
        Largest distance between a node's shaded points and its triangles, world units; 0 where all are flat.
    raised_corners : (N, 8, 3) float64
        World corners of boxes that contain the shaded points.
    identity : int
        Unique for each GpuScene.
    """

    _count = itertools.count()

    def __init__(
        self,
        context: GLContext,
        meshes: Meshes,
        scene: Scene,
        before: Before | None = None,
        chosen: NDArray[np.int64] | slice = slice(None),
    ) -> None:
        """`before`: of the scene drawn before; `chosen`: of `scene.drawn`."""
        self.scene = weakref.ref(scene)
        self.identity = next(self._count)
        self._context = context
        self._world: WorldTriangles | None = None
        self._clusters: Placed | None = None
        self.casting: dict[tuple[Hashable, ...], Casters] = {}
        self.scene_numbers = scene.drawn[chosen]
        self.nodes: tuple[Node, ...] = tuple(scene.nodes[i] for i in self.scene_numbers.tolist())
        different = list(dict.fromkeys(node.mesh for node in self.nodes))
        numbers = {id(mesh): k for k, mesh in enumerate(different)}
        self.mesh_number = np.array([numbers[id(node.mesh)] for node in self.nodes])
        on_gpu = self._on_gpu = [meshes.get(mesh) for mesh in different]
        self.meshes = [on_gpu[number] for number in self.mesh_number.tolist()]
        self.blends: NDArray[np.bool_] = scene.blending[chosen]
        casts = np.array([node.casts for node in self.nodes])
        self.casts: NDArray[np.bool_] = casts & ~self.blends
        self.tints: NDArray[np.bool_] = casts & self.blends
        self.closed: NDArray[np.bool_] = np.array([gpu.closed for gpu in on_gpu])[self.mesh_number]
        self.culls: NDArray[np.bool_] = np.array([gpu.culls for gpu in on_gpu])[self.mesh_number]
        self.round: NDArray[np.bool_] = np.array([isinstance(gpu, GpuCapsules) for gpu in on_gpu])[self.mesh_number]
        self.capsules = max(1 + gpu.tubes if isinstance(gpu, GpuCapsules) else 0 for gpu in on_gpu)
        counts = np.array([gpu.count for gpu in on_gpu])[self.mesh_number]
        self.count = int(counts.sum())
        self.first = np.concatenate([[0], np.cumsum(counts)[:-1]])
        limit = context.caps.max_texture_buffer_size
        if self.count > limit:
            raise ResourceError(
                f"the scene draws {self.count} triangles; this driver's texture buffers hold {limit}: split the scene"
            )
        bounds, matrices = self.boxes = scene.boxes[0][chosen], scene.boxes[1][chosen]
        self.world_from_mesh = matrices
        self._before, self._moved = before, np.ones(len(counts), dtype=bool)
        if before is not None:
            moved = before.differing(self.nodes, self.first, self.count, matrices)
            if moved is None:
                before.release()
                self._before = None
            else:
                self._moved, before.nodes = moved, ()
        self.copies = copies_of(self, matrices)
        self.casts &= ~self.copies
        origins = np.stack([gpu.origin for gpu in on_gpu])[self.mesh_number]
        self.world_from_origin: Array = matrices.copy()
        self.world_from_origin[:, :3, 3] += np.einsum("nij,nj->ni", matrices[:, :3, :3], origins)
        self.mirrored: list[bool] = (np.linalg.det(matrices[:, :3, :3]) < 0.0).tolist()
        self.normal_from_mesh = normal_matrices(matrices[:, :3, :3])
        self.packed_normals = pack_matrices(self.normal_from_mesh)
        first = (self.first + 1).astype(np.uint32)  # as shaders count; 0 is the background
        receives = np.array([node.receives for node in self.nodes])
        self.selective = not receives.all()
        first[~receives] |= np.uint32(NOT_RECEIVING)
        catching = np.array([node.catches for node in self.nodes])
        self.catches = bool(catching.any())
        first[catching] |= np.uint32(CATCHING)
        self.packed_first = first[:, None]
        self.origin: Array = np.median(self._sample(1024), axis=0)
        self.smooth = any(gpu.smooth for gpu in on_gpu)
        self.lifts, self._bent = np.zeros(len(counts)), np.zeros(len(counts), dtype=bool)
        self.rounded = self._rounded() if self.smooth else None
        self.corners = scene.corners[chosen]
        self.raised_corners = raised(bounds, matrices, self.lifts) if self.lifts.any() else self.corners
        self._albedo: moderngl.Texture | None = None
        self._planes: BufferTexture | None = None
        self._owners: BufferTexture | None = None
        self.features = Features.of(gpu.paint for gpu in on_gpu)
        self.textured = self.features.any or any(gpu.textured or gpu.colored or gpu.transmits for gpu in on_gpu)
        self.channels = 4 if self.textured else 2 if self.smooth else 1
        colors = np.array([mesh.material.color for mesh in different], dtype=np.float32)[self.mesh_number]
        matte = np.array([gpu.paint.matte for gpu in on_gpu])[self.mesh_number]
        if self.features.rough:
            colors[:, 3] = np.where(matte, 0.0, 1.0)
        self.colors = texture_buffer(context, colors, RGBA32F)
        context.check_errors(f"uploading {len(colors)} colours")
        one = (
            not self.textured
            and bool((colors[:, :3] == colors[0, :3]).all())
            and (not self.features.rough or not matte.any())
        )
        self.color: tuple[float, float, float] | None = tuple(float(c) for c in colors[0, :3]) if one else None  # type: ignore[assignment]

    @property
    def scene_triangles(self) -> NDArray[np.int64]:
        """(N,) what to add to the index of a node's triangle for its index over all nodes of the scene, drawn or not."""
        scene = self.scene()
        assert scene is not None
        counts = [node.mesh.count for node in scene.nodes]
        return np.asarray(np.cumsum([0, *counts])[self.scene_numbers] - self.first)

    @property
    def planes(self) -> BufferTexture:
        """Per triangle its unit world normal and distance from `origin`, zero without area (RGBA32F). Created at first use."""
        if self._planes is None:
            before = self._before
            taken = before is not None and before.planes is not None and np.array_equal(before.origin, self.origin)
            planes = np.zeros((self.count, 4), dtype=np.float32)
            for group in self._groups(self._moved if taken else None):
                count = self.meshes[group[0]].count
                for k in range(0, count, _AT_ONCE):
                    chosen = slice(k, min(k + _AT_ONCE, count))
                    rows = self.first[group][:, None] + np.arange(chosen.start, chosen.stop)
                    planes[rows] = self._planes_of(group, chosen)
            planes[np.repeat(self.round, [gpu.count for gpu in self.meshes]), 0] = CAPSULE
            if taken and before is not None and before.planes is not None:
                self._write_moved(before.planes, planes)
                self._planes, before.planes = before.planes, None
            else:
                self._planes = texture_buffer(self._context, planes, RGBA32F)
            self._context.check_errors(f"uploading the planes of {self.count} triangles")
        return self._planes

    @property
    def owners(self) -> BufferTexture:
        """Per triangle its node (R32UI). Created at first use."""
        if self._owners is None and self._before is not None:
            self._owners, self._before.owners = self._before.owners, None
        if self._owners is None:
            counts = [gpu.count for gpu in self.meshes]
            owners = np.repeat(np.arange(len(counts), dtype=np.uint32), counts)
            self._owners = texture_buffer(self._context, owners, R32UI)
            self._context.check_errors(f"uploading the nodes of {self.count} triangles")
        return self._owners

    @property
    def albedo(self) -> moderngl.Texture:
        """The table that lib/reflection.glsl reads (R32F). Created at first use."""
        if self._albedo is None:
            self._albedo = albedo_texture(self._context)
        return self._albedo

    @property
    def clusters(self) -> Placed:
        """The clusters of all nodes, created at first use."""
        if self._clusters is None:
            meshes = {id(gpu): gpu for gpu in self.meshes}
            place_of = {key: k for k, key in enumerate(meshes)}
            relative = self.world_from_origin.copy()
            relative[:, :3, 3] -= self.origin
            bodies = [gpu.shape.clusters for gpu in meshes.values()]
            number = [place_of[id(gpu)] for gpu in self.meshes]
            self._clusters = place(bodies, number, relative, self.normal_from_mesh)
        return self._clusters

    @property
    def world(self) -> WorldTriangles:
        """All triangles in one frame, created at first use."""
        if self._world is None:
            before = self._before
            taken = before is not None and np.array_equal(before.origin, self.origin)
            self._world = WorldTriangles(self._context, self, before.world if before and taken else None, self._moved)
        return self._world

    def _write_moved(self, texture: BufferTexture, rows: NDArray[np.generic]) -> None:
        """Write the rows (T, k) of nodes that have moved into a buffer of the scene before."""
        write_rows(texture, rows, np.append(self.first, self.count), np.flatnonzero(self._moved))

    def leave(self) -> Before:
        """Leave what another scene with the same nodes may take."""
        if self._before is not None:
            self._before.release()
        before = Before(self.nodes, self.first, self.count, self.world_from_mesh, self.origin, self.lifts, self._bent, self._planes,
                        self.rounded, self._owners, self._world)  # fmt: skip
        self._planes = self.rounded = self._owners = self._world = self._before = None
        return before

    def _sample(self, count: int) -> Array:
        """World corners (about `count` or one per node, 3) of triangles all over the scene."""
        step = max(1, self.count // count)
        corners = []
        for group in self._groups():
            meshes, of_node = self._different(group)
            points = np.stack([mesh.positions.take(mesh.triangles[::step, 0], axis=0) for mesh in meshes])
            corners.append(placed(self.world_from_mesh[group], points[of_node]))
        for node in np.flatnonzero(self.round).tolist():
            corners.append(placed(self.world_from_mesh[[node]], self.nodes[node].mesh.positions[None, ::step]))
        return np.concatenate([each.reshape(-1, 3) for each in corners])

    def _groups(self, chosen: NDArray[np.bool_] | None = None) -> Iterator[NDArray[np.int64]]:
        """Batches of nodes, or of those chosen (N,), with equally many triangles; instances follow each other. No points or lines."""
        counts = np.array([gpu.count for gpu in self._on_gpu])[self.mesh_number]
        order = np.lexsort((self.mesh_number, counts))
        order = order[~self.round[order] if chosen is None else (chosen & ~self.round)[order]]
        if len(order) == 0:
            return
        starts = np.flatnonzero(np.diff(counts[order])) + 1
        for group in np.split(order, starts):
            most = max(1, _AT_ONCE // int(counts[group[0]]))
            yield from (group[k : k + most] for k in range(0, len(group), most))

    def _different(self, group: NDArray[np.int64]) -> tuple[list[Mesh], NDArray[np.int64]]:
        """The distinct meshes of nodes, and each node's index into them."""
        _, first, of_node = np.unique(self.mesh_number[group], return_index=True, return_inverse=True)
        return [self.nodes[i].mesh for i in group[first].tolist()], of_node

    def _planes_of(self, group: NDArray[np.int64], chosen: slice) -> Array:
        """Planes (N, T, 4) of some triangles of nodes that have equally many."""
        meshes, of_node = self._different(group)
        corners = np.stack([mesh.positions.take(mesh.triangles[chosen], axis=0) for mesh in meshes])
        normals = face_normals(*(corners[:, :, k] for k in range(3)))
        normals = normals[of_node] @ self.normal_from_mesh[group].transpose(0, 2, 1)
        length = np.linalg.norm(normals, axis=-1, keepdims=True)
        normals = normals / np.where(length > 0.0, length, 1.0)
        # from the float32 vertices that the GPU draws
        origins = np.stack([self._on_gpu[k].origin for k in self.mesh_number[group]])
        drawn = (corners[of_node, :, 0] - origins[:, None]).astype(np.float32)
        corner = placed(self.world_from_origin[group], drawn.astype(np.float64)) - self.origin
        return np.concatenate([normals, np.einsum("nij,nij->ni", normals, corner)[..., None]], axis=-1)

    def _rounded(self) -> BufferTexture | None:
        """Per drawn triangle its vertices' normals, see lib/smooth_point.glsl; sets `lifts`. None if all triangles are flat."""
        rows, before = np.zeros((self.count, 4), dtype=np.uint32), self._before
        if before is not None:
            self.lifts[~self._moved], self._bent[~self._moved] = before.lifts[~self._moved], before.bent[~self._moved]
        for group in self._groups(self._moved):
            smooth = group[[self.meshes[i].smooth for i in group]]
            faces = self._planes_of(smooth, slice(None))[..., :3] if len(smooth) else ()
            for node, face in zip(smooth, faces, strict=True):
                mesh = self.nodes[node].mesh
                assert mesh.normals is not None
                normals = unit_vectors(mesh.normals @ self.normal_from_mesh[node].T)
                corners = normals[mesh.triangles]
                side = sides(face, corners)
                bent = np.flatnonzero(side)
                if len(bent) == 0:
                    continue
                places = mesh.positions @ self.world_from_origin[node, :3, :3].T
                most, share = heights(places[mesh.triangles[bent]], corners[bent])
                self.lifts[node], self._bent[node] = most.max(), True
                into = self.first[node] + bent
                rows[into, :3] = pack_octahedral(normals)[mesh.triangles[bent]]
                rows[into, 3] = 1 + 2 * (side[bent] < 0) + (np.rint(share * 65535.0).astype(np.uint32) << 16)
        if before is not None and before.rounded is not None and self._bent.any():
            self._write_moved(before.rounded, rows)
            taken, before.rounded = before.rounded, None
            return taken
        return texture_buffer(self._context, rows, RGBA32UI) if self._bent.any() else None

    def release(self) -> None:
        """Free the GPU memory; the meshes are kept."""
        release(self._planes, self._owners, self._albedo, self.colors, self.rounded, self._world, self._before)
