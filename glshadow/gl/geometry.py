"""Meshes and scenes on the GPU: uploaded once, shared by all their instances, forgotten with them."""

from __future__ import annotations

import itertools
import weakref

import moderngl
import numpy as np
from numpy.typing import NDArray

from glshadow.core.spaces import Array, transform
from glshadow.errors import ResourceError
from glshadow.gl.context import GLContext
from glshadow.gl.entry_points import R32UI, RGBA32F
from glshadow.gl.program import Program
from glshadow.gl.world import WorldTriangles, texture_buffer
from glshadow.scene.mesh import AlphaMode, Mesh, Node, Scene

NOT_RECEIVING = 1 << 31  # marks the numbers of triangles that no light's shadow falls on
_SRGB8_ALPHA8 = 0x8C43
_FAR_FROM_ORIGIN = (
    16.0  # a mesh further from its origin than this many extents is stored relative to its middle (4 bits of float32)
)
_FORMATS = {"a_position": "3f", "a_normal": "3f", "a_uv": "2f", "a_color": "4f"}
_INTERPOLATED = 2.0**-20  # what interpolating an alpha of 1 between vertices may cost it, a few roundings of float32


class GpuMesh:
    """Vertex and index buffers of a mesh, and its base colour texture.

    Positions are float32 relative to `origin`, so that a mesh baked far from zero keeps what float64 knew of it.

    Attributes
    ----------
    textured, colored : bool
        Whether it has a texture with coordinates, whether it has vertex colours.
    cut_out : bool
        Whether alpha decides where it exists: MASK, and an alpha that may be below the cutoff.
    cutoff : float
        What alpha is compared with.
    """

    def __init__(self, context: GLContext, mesh: Mesh) -> None:
        ctx = context.ctx
        low, high = mesh.bounds
        far = max(np.abs(low).max(), np.abs(high).max()) > _FAR_FROM_ORIGIN * (high - low).max()
        self.origin: Array = 0.5 * (low + high) if far else np.zeros(3)
        self.count, self.vertices = len(mesh.triangles), len(mesh.positions)
        self._triangles = mesh.triangles  # the array alone: holding the mesh would keep it, and with it this, alive
        self.closed = mesh.closed and mesh.material.alpha_mode is not AlphaMode.MASK and not mesh.material.double_sided
        corners = mesh.positions[mesh.triangles]
        normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        length = np.linalg.norm(normal, axis=1, keepdims=True)
        self.face_normals: Array = normal / np.where(length > 0.0, length, 1.0)
        self.smooth = mesh.normals is not None
        material = mesh.material
        self.textured = material.texture is not None and mesh.uv is not None
        self.colored = mesh.colors is not None
        self.cut_out = material.alpha_mode is AlphaMode.MASK and (
            self.textured or self.colored or material.color[3] < material.cutoff
        )
        self.cutoff = material.cutoff - (_INTERPOLATED if self.colored else 0.0)
        self._ctx = ctx
        self._arrays: dict[tuple[int, bool], moderngl.VertexArray] = {}
        order, numbered, shared = numbered_triangles(mesh.triangles, len(mesh.positions))
        self._order = order
        self._buffers = {"a_position": ctx.buffer((mesh.positions - self.origin).astype(np.float32)[order].tobytes())}
        normals = mesh.normals
        if normals is not None:
            self._buffers["a_normal"] = ctx.buffer(normals[order].tobytes())
        if self.textured and mesh.uv is not None:
            self._buffers["a_uv"] = ctx.buffer(mesh.uv[order].tobytes())
        if mesh.colors is not None:
            self._buffers["a_color"] = ctx.buffer(mesh.colors[order].tobytes())
        self._numbered, self._shared = ctx.buffer(numbered.tobytes()), ctx.buffer(shared.tobytes())
        self.texture: moderngl.Texture | None = None
        if self.textured and mesh.material.texture is not None:
            self.texture = _texture(context, mesh.material.texture)
        context.check_errors(f"uploading a mesh of {self.count} triangles")

    @property
    def alpha_test(self) -> dict[str, int]:
        """Defines of a pass that asks no colour, only whether the surface exists."""
        tested = self.cut_out
        return {
            "GLS_ALPHA": int(tested),
            "GLS_TEXTURED": int(tested and self.textured),
            "GLS_COLORED": int(tested and self.colored),
        }

    def vertex_array(self, program: Program, numbered: bool = False) -> moderngl.VertexArray:
        """The mesh as input of a program: the attributes that both have.

        Parameters
        ----------
        numbered : bool
            gl_VertexID of a triangle's last vertex is the triangle's number; else vertices are shared by as many triangles as can be.
        """
        key = (program.gl.glo, numbered)
        array = self._arrays.get(key)
        if array is None:
            names = [name for name in _FORMATS if name in program]
            if "a_normal" in names and "a_normal" not in self._buffers:  # a bias along the normal asks even flat meshes
                self._buffers["a_normal"] = self._ctx.buffer(self._averaged_normals()[self._order].tobytes())
            content = [(self._buffers[name], _FORMATS[name], name) for name in names]
            index = self._numbered if numbered else self._shared
            array = self._arrays[key] = self._ctx.vertex_array(program.gl, content, index)
        return array

    def _averaged_normals(self) -> NDArray[np.float32]:
        """Per vertex (V, 3) the mean of its triangles' normals, unit length; zero where there is none."""
        triangles = self._triangles
        total = np.stack(
            [np.bincount(triangles.ravel(), np.repeat(self.face_normals[:, k], 3), self.vertices) for k in range(3)],
            axis=-1,
        )
        length = np.linalg.norm(total, axis=1, keepdims=True)
        return np.asarray(total / np.where(length > 0.0, length, 1.0), dtype=np.float32)

    def release(self) -> None:
        """Free the GPU memory."""
        for thing in (*self._arrays.values(), *self._buffers.values(), self._numbered, self._shared, self.texture):
            if thing is not None:
                thing.release()


def numbered_triangles(
    triangles: NDArray[np.int32], vertices: int
) -> tuple[NDArray[np.int64], NDArray[np.int32], NDArray[np.int32]]:
    """Vertices in an order in which the last vertex of triangle k is vertex k.

    A flat gl_VertexID then names the triangle, where gl_PrimitiveID would make llvmpipe take every triangle apart (7 of 21 ms on the
    courtyard).

    Parameters
    ----------
    triangles : (T, 3) int32
    vertices : int
        V, how many there are.

    Returns
    -------
    order : (W,) int64
        Which of the old vertices each new one is; T <= W <= T + V.
    numbered : (T, 3) int32
        Triangles over the new vertices, the last index of triangle k being k.
    shared : (T, 3) int32
        The same over one copy of each old vertex.
    """
    count = len(triangles)
    number = np.arange(count, dtype=np.int64)
    last = triangles[:, 2].astype(np.int64)
    # Copies of a vertex, by vertex and then by triangle. A corner takes the copy of the nearest triangle before it, else after it,
    # so that the vertices of neighbouring triangles stay together in the vertex cache.
    copies = np.sort(last * count + number)
    wanted = triangles[:, :2].astype(np.int64)
    after = np.searchsorted(copies, wanted * count + number[:, None])
    before = np.maximum(after - 1, 0)
    after = np.minimum(after, count - 1)
    found = np.where(copies[before] // count == wanted, copies[before], copies[after])
    has_copy = found // count == wanted
    missing = np.unique(wanted[~has_copy])
    others = np.where(has_copy, found % count, count + np.searchsorted(missing, wanted))
    order = np.concatenate([last, missing])
    one = np.zeros(vertices, dtype=np.int64)
    one[order[::-1]] = np.arange(len(order))[::-1]
    return order, np.concatenate([others, number[:, None]], axis=1).astype(np.int32), one[triangles].astype(np.int32)


def _texture(context: GLContext, pixels: NDArray[np.uint8]) -> moderngl.Texture:
    height, width = pixels.shape[:2]
    context.check_size((width, height), "a base colour texture")
    # v up, as uv counts: row 0 of the file is the top
    texture = context.ctx.texture((width, height), 4, pixels[::-1].tobytes(), internal_format=_SRGB8_ALPHA8)
    texture.build_mipmaps()
    texture.filter = (moderngl.LINEAR_MIPMAP_LINEAR, moderngl.LINEAR)
    return texture


class Meshes:
    """The GPU meshes of a context, kept as long as their Mesh lives."""

    def __init__(self, context: GLContext) -> None:
        self._context = context
        self._meshes: weakref.WeakKeyDictionary[Mesh, GpuMesh] = weakref.WeakKeyDictionary()
        self._finalizers: weakref.WeakKeyDictionary[Mesh, weakref.finalize[..., Mesh]] = weakref.WeakKeyDictionary()
        self._dead: list[GpuMesh] = []

    def get(self, mesh: Mesh) -> GpuMesh:
        """The GPU side of a mesh, uploaded the first time."""
        gpu = self._meshes.get(mesh)
        if gpu is None:
            gpu = self._meshes[mesh] = GpuMesh(self._context, mesh)
            # Deleting needs the context to be current, which a finaliser cannot know: collect now, delete in `sweep`.
            self._finalizers[mesh] = finalizer = weakref.finalize(mesh, self._dead.append, gpu)
            finalizer.atexit = False
        return gpu

    def sweep(self) -> None:
        """Free what belonged to meshes that are gone."""
        while self._dead:
            self._dead.pop().release()

    def release(self) -> None:
        """Free everything."""
        for gpu in (*self._meshes.values(), *self._dead):
            gpu.release()
        for finalizer in self._finalizers.values():
            finalizer.detach()  # it holds the GpuMesh as long as the Mesh lives
        self._meshes.clear()
        self._finalizers.clear()
        self._dead.clear()


class GpuScene:
    """A scene on the GPU: its draws, and per drawn triangle its plane and its node, read by the resolve pass.

    Attributes
    ----------
    nodes : tuple of Node
        Those that have triangles, in the scene's order.
    meshes : list of GpuMesh
        One per node, shared by instances.
    first : (N,) int
        Number of each node's first triangle, from 0, over the whole scene.
    world_from_origin : (N, 4, 4) float64
        Places the float32 vertices: world_from_mesh after the mesh's origin.
    origin : (3,) float64
        World point that the planes are relative to: the median corner, where most of the scene is even if a stray triangle is not.
    color : (3,) floats or None
        The base colour, where all nodes share one and none has a texture or vertex colours.
    textured : bool
        Whether some base colour changes from pixel to pixel: a texture's, or that of vertices.
    selective : bool
        Whether shadows leave out some nodes.
    casts : (N,) bool
        All but blended nodes and those that are told not to.
    closed : (N,) bool
        Whether back faces are seen by nobody outside.
    casting : dict
        Which nodes darken anything, by a sun's direction or a lamp's place: see `gl.caster.casters_on_others`.
    identity : int
        Never the same for two of them.
    """

    _count = itertools.count()

    def __init__(self, context: GLContext, meshes: Meshes, scene: Scene) -> None:
        self.scene = weakref.ref(scene)
        self.identity = next(self._count)
        self._context = context
        self._world: WorldTriangles | None = None
        self.casting: dict[tuple[bool, tuple[float, float, float]], NDArray[np.bool_]] = {}
        self.nodes: tuple[Node, ...] = tuple(node for node in scene.nodes if len(node.mesh.triangles))
        self.meshes = [meshes.get(node.mesh) for node in self.nodes]
        self.casts: NDArray[np.bool_] = np.array(
            [node.casts and node.mesh.material.alpha_mode is not AlphaMode.BLEND for node in self.nodes]
        )
        self.closed: NDArray[np.bool_] = np.array([gpu.closed for gpu in self.meshes])
        numbers = {id(gpu): k for k, gpu in enumerate(dict.fromkeys(self.meshes))}
        self.mesh_number = [numbers[id(gpu)] for gpu in self.meshes]
        counts = np.array([gpu.count for gpu in self.meshes])
        self.first = np.concatenate([[0], np.cumsum(counts)[:-1]])
        limit = context.caps.max_texture_buffer_size
        if counts.sum() > limit:
            raise ResourceError(
                f"the scene draws {counts.sum()} triangles; this driver's texture buffers hold {limit}: split the scene"
            )
        matrices = np.stack([node.world_from_mesh for node in self.nodes])
        origins = np.stack([gpu.origin for gpu in self.meshes])
        self.world_from_origin: Array = matrices.copy()
        self.world_from_origin[:, :3, 3] += np.einsum("nij,nj->ni", matrices[:, :3, :3], origins)
        self.mirrored: list[bool] = (np.linalg.det(matrices[:, :3, :3]) < 0.0).tolist()
        self.normal_from_mesh = _cofactors(matrices[:, :3, :3])
        self.packed_normals = pack_matrices(self.normal_from_mesh)
        first = (self.first + 1).astype(np.uint32)  # as shaders count, 0 being none
        receives = np.array([node.receives for node in self.nodes])
        self.selective = not receives.all()
        first[~receives] |= np.uint32(NOT_RECEIVING)
        self.packed_first = [number.tobytes() for number in first]
        self.origin: Array = np.median(self._sample(1024), axis=0)
        self.corners = scene.corners
        planes = np.zeros((int(counts.sum()), 4), dtype=np.float32)
        for i, gpu in enumerate(self.meshes):
            planes[self.first[i] : self.first[i] + gpu.count] = self._planes(i)
        owners = np.repeat(np.arange(len(counts), dtype=np.uint32), counts)
        colors = np.array([node.mesh.material.color for node in self.nodes], dtype=np.float32)
        self.planes = texture_buffer(context, planes, RGBA32F)
        self.owners = texture_buffer(context, owners, R32UI)
        self.colors = texture_buffer(context, colors, RGBA32F)
        context.check_errors(f"uploading the planes of {counts.sum()} triangles")
        self.textured = any(gpu.textured or gpu.colored for gpu in self.meshes)
        self.smooth = any(gpu.smooth for gpu in self.meshes)
        one = not self.textured and bool((colors[:, :3] == colors[0, :3]).all())
        self.color: tuple[float, float, float] | None = tuple(float(c) for c in colors[0, :3]) if one else None  # type: ignore[assignment]

    @property
    def world(self) -> WorldTriangles:
        """All triangles in one frame, made when first asked for."""
        if self._world is None:
            self._world = WorldTriangles(self._context, self)
        return self._world

    def _sample(self, count: int) -> Array:
        """World corners (about `count` or one per node, 3) of triangles all over the scene."""
        step = max(1, int(self.first[-1] + self.meshes[-1].count) // count)
        corners = []
        for node in self.nodes:
            mesh = node.mesh
            corners.append(transform(node.world_from_mesh, mesh.positions[mesh.triangles[::step, 0]]))
        return np.concatenate(corners)

    def _planes(self, i: int) -> Array:
        """Unit world normal and distance from `origin` of a node's triangles, (T, 4); zero for a triangle without area."""
        gpu, mesh = self.meshes[i], self.nodes[i].mesh
        normals = gpu.face_normals @ self.normal_from_mesh[i].T
        length = np.linalg.norm(normals, axis=1, keepdims=True)
        normals = normals / np.where(length > 0.0, length, 1.0)
        # from the vertices that the GPU draws, rounded to float32 as they are
        drawn = (mesh.positions[mesh.triangles[:, 0]] - gpu.origin).astype(np.float32).astype(np.float64)
        corner = transform(self.world_from_origin[i], drawn) - self.origin
        return np.concatenate([normals, np.einsum("ij,ij->i", normals, corner)[:, None]], axis=1)

    def release(self) -> None:
        """Free the GPU memory; the meshes stay."""
        for texture in (self.planes, self.owners, self.colors):
            texture.release()
            texture.buffer.release()
        if self._world is not None:
            self._world.release()


def _cofactors(linear: Array) -> Array:
    """Matrices (N, 3, 3) that carry normals: cofactors, det * inverse transpose, also for singular ones; scaled to size 1."""
    rows = np.stack([np.cross(linear[:, (i + 1) % 3], linear[:, (i + 2) % 3]) for i in range(3)], axis=1)
    size = np.abs(rows).max(axis=(1, 2), keepdims=True)
    return np.asarray(rows / np.where(size > 0.0, size, 1.0))


def pack_matrices(matrices: Array) -> list[bytes]:
    """float64 matrices (N, k, k) as float32 bytes in GL's column order, one per draw."""
    data = np.ascontiguousarray(matrices.transpose(0, 2, 1), dtype=np.float32)
    return [row.tobytes() for row in data]
