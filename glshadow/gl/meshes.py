"""Meshes on the GPU: uploaded once, shared by all their instances, forgotten with them."""

from __future__ import annotations

import weakref

import moderngl
import numpy as np
from numpy.typing import NDArray

from glshadow.core.spaces import Array
from glshadow.gl.context import GLContext
from glshadow.gl.program import Program
from glshadow.scene.mesh import AlphaMode, Mesh

_SRGB8_ALPHA8 = 0x8C43
_FAR_FROM_ORIGIN = 16.0
"""A mesh further from its origin than this many extents is stored relative to its middle (4 bits of float32)."""
_FORMATS = {"a_position": "3f", "a_normal": "3f", "a_uv": "2f", "a_color": "4f"}
_INTERPOLATED = 2.0**-20
"""What interpolating an alpha of 1 between vertices may cost it, a few roundings of float32."""


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
