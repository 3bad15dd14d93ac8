"""Meshes on the GPU: uploaded once, shared by all instances, released with the last Mesh."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from typing import Literal

import moderngl
import numpy as np
from numpy.typing import NDArray

from glshadow.core.spaces import Array
from glshadow.geometry.adjacency import neighbours
from glshadow.geometry.clusters import Clusters, make_clusters
from glshadow.geometry.welding import welded
from glshadow.gl.driver.context import GLContext
from glshadow.gl.driver.program import Program
from glshadow.gl.driver.shared import Shared
from glshadow.gl.scene.paint import Paint
from glshadow.gl.scene.textures import Textures
from glshadow.scene.mesh import AlphaMode, Mesh

_WHITE = np.full((1, 1, 4), 255, dtype=np.uint8)
_FAR_FROM_ORIGIN = 16.0
"""A mesh further from its origin than this many extents is stored relative to its middle (4 bits of float32)."""
_LARGE = 1 << 18
"""Least number of triangles for which a thread pays off."""
_FORMATS = {"a_position": "3f", "a_normal": "3f", "a_uv": "2f", "a_color": "4f", "a_sets": "4f", "a_tangent": "4f"}
Order = Literal["numbered", "shared", "clustered"]
"""Order of a mesh's triangles and layout of its vertices, see `GpuMesh.vertex_array`."""
_INTERPOLATED = 2.0**-20
"""Rounding error that interpolating an alpha of 1 between vertices may cause, a few roundings of float32."""


class Shape:
    """Triangles on the GPU independent of the material: positions, indices, and what is derived from them.

    Positions are float32 relative to `origin`, so that a mesh far from zero keeps its float64 precision.

    Attributes
    ----------
    origin : (3,) float64
        In mesh space.
    closed : bool
        See `Mesh.closed`.
    neighbours : (T, 3) uint32
        The triangles across each triangle's edges, by the drawn positions: see `geometry.adjacency`.
    positions, numbered : moderngl.Buffer
        Vertices and indices: see `numbered_triangles`.
    """

    def __init__(self, context: GLContext, mesh: Mesh) -> None:
        low, high = mesh.bounds
        far = max(np.abs(low).max(), np.abs(high).max()) > _FAR_FROM_ORIGIN * (high - low).max()
        self.origin: Array = 0.5 * (low + high) if far else np.zeros(3)
        # the arrays alone: a reference to the mesh would keep it and, with it, this object alive
        self._triangles, self._positions = mesh.triangles, mesh.positions
        self._context, self._vertices = context, len(mesh.positions)
        if len(mesh.triangles) < _LARGE:
            self._connect(mesh)
            self._upload()
        else:  # numpy releases the GIL, and this takes as long as all the rest: run it in parallel
            with ThreadPoolExecutor(1) as beside:
                connected = beside.submit(self._connect, mesh)
                self._upload()
                connected.result()
        self._shared: moderngl.Buffer | None = None
        self._averaged: moderngl.Buffer | None = None
        self._clusters: Clusters | None = None
        self._clustered: moderngl.Buffer | None = None

    def _connect(self, mesh: Mesh) -> None:
        self.closed, self.neighbours = mesh.closed, mesh.neighbours
        drawn = self._drawn()
        if np.array_equal(drawn, mesh.positions):
            return
        # float32 may merge points that differ in float64
        number = welded(drawn)
        places = number.max() + 1
        if places < len(number) and places <= welded(mesh.positions).max():
            self.neighbours = neighbours(number.astype(np.int32)[mesh.triangles])

    def _upload(self) -> None:
        numbered, self._others = numbered_triangles(self._triangles, self._vertices)
        self.numbered = self._context.ctx.buffer(numbered)
        del numbered
        self.positions = self._context.ctx.buffer(self.ordered(self._drawn()))

    @property
    def clusters(self) -> Clusters:
        """Its triangles in clusters. Computed at first use: 0.3 s for a million triangles."""
        if self._clusters is None:
            self._clusters = make_clusters(self._drawn(), self._triangles)
        return self._clusters

    @property
    def shared(self) -> moderngl.Buffer:
        """Indices over one copy of each vertex. Created at first use."""
        if self._shared is None:
            self._shared = self._context.ctx.buffer(self._over_one_copy())
        return self._shared

    @property
    def clustered(self) -> moderngl.Buffer:
        """The indices of `shared`, cluster after cluster."""
        if self._clustered is None:
            self._clustered = self._context.ctx.buffer(self._over_one_copy()[self.clusters.order])
        return self._clustered

    @property
    def averaged_normals(self) -> moderngl.Buffer:
        """Per vertex the mean of its triangles' normals, unit length; zero where there is none. Computed at first use."""
        if self._averaged is None:
            corners = self._triangles.ravel()
            faces = face_normals(*(self._positions.take(self._triangles[:, k], axis=0) for k in range(3)))
            total = np.stack(
                [np.bincount(corners, np.repeat(column, 3), self._vertices) for column in faces.T],
                axis=-1,
            )
            length = np.linalg.norm(total, axis=1, keepdims=True)
            mean = np.asarray(total / np.where(length > 0.0, length, 1.0), dtype=np.float32)
            self._averaged = self._context.ctx.buffer(self.ordered(mean))
        return self._averaged

    def ordered(self, values: NDArray[np.float32]) -> NDArray[np.float32]:
        """Vertex data (V, k) in the order of the vertices on the GPU (W, k)."""
        return np.concatenate([values.take(self._triangles[:, 2], axis=0), values[self._others]])

    def numbered_only(self, values: NDArray[np.float32]) -> NDArray[np.float32]:
        """Data of triangles (T, k) in the order of the vertices on the GPU (W, k), for flat inputs of programs that draw `numbered`."""
        return np.concatenate([values, np.zeros((len(self._others), values.shape[1]), dtype=np.float32)])

    def _drawn(self) -> NDArray[np.float32]:
        places = self._positions - self.origin if self.origin.any() else self._positions
        return places.astype(np.float32)

    def _over_one_copy(self) -> NDArray[np.int32]:
        """Triangles (T, 3) of vertices on the GPU."""
        return _first_copies(self._triangles, self._others, self._vertices)[self._triangles]

    def release(self) -> None:
        """Free the GPU memory."""
        for buffer in (self.positions, self.numbered, self._shared, self._averaged, self._clustered):
            if buffer is not None:
                buffer.release()


class GpuMesh:
    """A mesh as passes draw it: its shape, its other vertex attributes, and its base colour texture.

    Attributes
    ----------
    shape : Shape
    textured, colored : bool
        Whether it has a texture with coordinates; whether it has vertex colours.
    cut_out : bool
        Whether alpha cuts it out: alpha mode MASK, and an alpha that may be below the cutoff.
    cutoff : float
        Threshold of alpha.
    transmits : bool
        Whether light passes through it, by its material's transmission.
    transmission : moderngl.Texture or None
        Where it has texture coordinates, a factor of the transmission.
    culls : bool
        Whether the camera sees through its triangles from behind.
    paint : Paint
        What else its material needs.
    """

    def __init__(self, context: GLContext, mesh: Mesh, shapes: Shared[Shape], textures: Textures) -> None:
        ctx, material = context.ctx, mesh.material
        self._ctx, self._shapes, self._textures = ctx, shapes, textures
        self.textured = mesh.placed_uv is not None
        self.texture: moderngl.Texture | None = None
        pixels = _WHITE if material.texture is None else material.texture
        self._pixels, self._sampler = pixels if self.textured else None, material.sampler
        masked = material.alpha_mode is AlphaMode.MASK and material.cutoff > 0.0
        self._cut = masked or material.alpha_mode is AlphaMode.BLEND
        if self._pixels is not None:  # first, since the driver may refuse it
            self.texture = textures.take(self._pixels, self._sampler, True, "a base colour texture", self._cut)
        self.transmission: moderngl.Texture | None = None
        self._mapped = material.transmission_map if self.textured and material.transmission > 0.0 else None
        if self._mapped is not None:
            self.transmission = textures.take(self._mapped, self._sampler, False, "a transmission map")
        self.paint = Paint(textures, mesh)
        self._key = (mesh.positions, mesh.triangles)
        self.shape = shapes.take(lambda: Shape(context, mesh), *self._key)
        self.origin = self.shape.origin
        self.count = len(mesh.triangles)
        self.transmits = material.transmission > 0.0
        one_sided = material.alpha_mode is not AlphaMode.MASK and not material.double_sided and not mesh.blends
        self.closed = self.shape.closed and one_sided
        self.culls = material.cull_back_faces
        self.smooth = mesh.normals is not None
        self.colored = mesh.colors is not None
        self.cut_out = material.alpha_mode is AlphaMode.MASK and (
            self.textured or self.colored or material.color[3] < material.cutoff
        )
        self.cutoff = material.cutoff - (_INTERPOLATED if self.colored else 0.0)
        self._arrays: dict[tuple[int, Order], moderngl.VertexArray] = {}
        beside = {"a_normal": mesh.normals, "a_uv": mesh.placed_uv, "a_color": mesh.colors} | self.paint.of_vertices
        self._beside = {name: ctx.buffer(self.shape.ordered(v)) for name, v in beside.items() if v is not None}
        self._of_faces = {name: ctx.buffer(self.shape.numbered_only(v)) for name, v in self.paint.of_faces.items()}
        context.check_errors(f"uploading a mesh of {self.count} triangles")

    @property
    def alpha_test(self) -> dict[str, int]:
        """Defines of a pass that needs no colour, only whether the surface exists."""
        tested = self.cut_out
        return {
            "GLS_ALPHA": int(tested),
            "GLS_TEXTURED": int(tested and self.textured),
            "GLS_COLORED": int(tested and self.colored),
        }

    def vertex_array(self, program: Program, order: Order = "shared") -> moderngl.VertexArray:
        """The mesh as input of a program: the attributes that both have.

        Parameters
        ----------
        order : {"numbered", "shared", "clustered"}
            numbered: gl_VertexID of a triangle's last vertex is the triangle's index; shared: as many triangles as possible share each
            vertex; clustered: the same, cluster after cluster.
        """
        key = (program.gl.glo, order)
        array = self._arrays.get(key)
        if array is None:
            buffers = {"a_position": self.shape.positions, **self._beside}
            buffers |= self._of_faces if order == "numbered" else {}
            if (
                "a_normal" in program and "a_normal" not in buffers
            ):  # a normal-offset bias needs normals of flat meshes too
                buffers["a_normal"] = self.shape.averaged_normals
            content = [(buffers[name], kind, name) for name, kind in _FORMATS.items() if name in program]
            array = self._arrays[key] = self._ctx.vertex_array(program.gl, content, getattr(self.shape, order))
        return array

    def release(self) -> None:
        """Release the buffers that are not shared with other meshes."""
        for array in self._arrays.values():
            array.release()
        for buffer in (*self._beside.values(), *self._of_faces.values()):
            buffer.release()
        self._shapes.give_back(*self._key)
        self.paint.release()
        if self._pixels is not None:
            self._textures.give_back(self._pixels, self._sampler, True, self._cut)
        if self._mapped is not None:
            self._textures.give_back(self._mapped, self._sampler, False)


def face_normals(a: Array, b: Array, c: Array) -> Array:
    """Unit normals (..., 3) of triangles; zero for those without area."""
    normal = np.cross(b - a, c - a)
    length = np.linalg.norm(normal, axis=-1, keepdims=True)
    return np.asarray(normal / np.where(length > 0.0, length, 1.0))


def numbered_triangles(triangles: NDArray[np.int32], vertices: int) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """Reorder vertices so that the last vertex of triangle k is vertex k.

    A flat gl_VertexID is then the triangle's index. gl_PrimitiveID would make llvmpipe process every triangle separately (7 of 21 ms on
    the courtyard).

    Parameters
    ----------
    triangles : (T, 3) int32
    vertices : int
        V, the number of vertices.

    Returns
    -------
    numbered : (T, 3) int32
        Triangles over the new vertices; the last index of triangle k is k. The first T new vertices are the triangles' last vertices.
    others : (M,) int32
        Old vertices that follow them: those that are no triangle's last vertex.
    """
    copies = _first_copies(triangles, np.zeros(0, dtype=np.int32), vertices)
    missing = np.zeros(vertices, dtype=bool)
    missing[triangles[:, :2]] = True
    missing &= copies < 0
    others = np.flatnonzero(missing).astype(np.int32)
    copies[others] = len(triangles) + np.arange(len(others), dtype=np.int32)
    last = copies.copy()
    number = np.arange(len(triangles), dtype=np.int32)
    last[triangles[:, 2]] = number
    numbered = np.zeros_like(triangles)
    # the last copy if it comes before, else the first: recently drawn vertices are in the vertex cache
    for k in range(2):
        latest = last.take(triangles[:, k])
        numbered[:, k] = np.where(latest < number, latest, copies.take(triangles[:, k]))
    numbered[:, 2] = number
    return numbered, others


def _first_copies(triangles: NDArray[np.int32], others: NDArray[np.int32], vertices: int) -> NDArray[np.int32]:
    """For each old vertex (V,) the first new one that equals it; -1 if there is none."""
    copies = np.full(vertices, -1, dtype=np.int32)
    copies[triangles[::-1, 2]] = np.arange(len(triangles), dtype=np.int32)[::-1]
    copies[others] = len(triangles) + np.arange(len(others), dtype=np.int32)
    return copies
