"""Points and lines on the GPU: colours of their vertices, and how the scene's buffers of vertices and triangles hold their elements."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from glshadow.core.spaces import Array
from glshadow.geometry.adjacency import NONE
from glshadow.gl.driver.buffers import BufferTexture, texture_buffer
from glshadow.gl.driver.context import GLContext
from glshadow.gl.driver.entry_points import RGBA32F
from glshadow.gl.scene.meshes import GpuMesh, Shape
from glshadow.gl.scene.paint import Paint
from glshadow.scene.capsules import Capsules, radius_scale
from glshadow.scene.mesh import Mesh

CAPSULE = 2.0
"""First component of an element's plane, as in lib/capsule.glsl: larger than one of a unit normal."""


class GpuCapsules(GpuMesh):
    """Points or lines as a node's mesh: the interface of a mesh, without triangles.

    Attributes
    ----------
    tubes : bool
    vertex_colors : BufferTexture or None
        Linear RGBA of each vertex.
    """

    def __init__(self, context: GLContext, mesh: Capsules) -> None:
        self.shape = _NoShape(mesh)
        self.origin = np.zeros(3)
        self.count, self.tubes = mesh.count, mesh.tubes
        self.textured = self.closed = self.smooth = self.cut_out = self.culls = False
        self.paint = _Matte()
        self.texture = self.transmission = None
        self.transmits, self.cutoff = False, 0.0
        self.colored = mesh.colors is not None
        self.vertex_colors: BufferTexture | None = None
        if mesh.colors is not None:
            self.vertex_colors = texture_buffer(context, mesh.colors, RGBA32F)
        context.check_errors(f"uploading {self.count} points or lines")

    def release(self) -> None:
        """Free the GPU memory."""
        if self.vertex_colors is not None:
            self.vertex_colors.release()


class _Matte(Paint):
    """Nothing beside a base colour."""

    def __init__(self) -> None:
        self.matte, self.rough, self.emits, self.bumped, self.occluded = True, False, False, False, False
        self.defines, self.uniforms, self.textures, self.of_vertices, self.of_faces = {}, {}, {}, {}, {}
        self._held = []


class _NoShape(Shape):
    """Stands for the element's geometry in the comparison of nodes: equal for the same positions, ends and radii."""

    def __init__(self, mesh: Capsules) -> None:
        self._parts = (mesh.positions, mesh.ends, mesh.radius)
        self.origin, self.closed = np.zeros(3), False
        self.neighbours = np.broadcast_to(np.uint32(NONE), (mesh.count, 3))

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _NoShape) and all(a is b for a, b in zip(self._parts, other._parts, strict=True))

    def __hash__(self) -> int:
        return hash(tuple(map(id, self._parts)))


@dataclass(frozen=True, eq=False)
class Stored:
    """Vertices and elements of a mesh as the scene's buffers hold them.

    Parameters
    ----------
    positions : (V, 3) float64
    triangles : (T, 3) ints
        Three vertices of each element. Of a capsule: its ends, and a vertex that holds its radius as x.
    """

    positions: Array
    triangles: NDArray[np.integer]


def stored(mesh: Mesh) -> Stored:
    """A mesh's vertices and elements; for capsules the vertices that hold radii are zero."""
    if not isinstance(mesh, Capsules):
        return Stored(mesh.positions, mesh.triangles)
    count, radii = len(mesh.positions), len(mesh.radius)
    elements = np.zeros((mesh.count, 3), dtype=np.int32)
    elements[:, :2] = mesh.ends
    elements[:, 2] = count if radii == 1 else np.arange(count, count + radii)
    return Stored(np.concatenate([mesh.positions, np.zeros((radii, 3))]), elements)


def radii_of(mesh: Capsules, world_from_mesh: Array) -> Array:
    """World radii as the last vertices of `stored` hold them."""
    return np.asarray(mesh.radius * radius_scale(world_from_mesh))


def surface_points(
    mesh: Capsules, world_from_mesh: Array, element: NDArray[np.int64], points: Array
) -> tuple[Array, Array]:
    """Nearest points (K, 3) of elements' surfaces to world points, and the unit normals there."""
    ends = mesh.positions[mesh.ends[element]] @ world_from_mesh[:3, :3].T + world_from_mesh[:3, 3]
    along = ends[:, 1] - ends[:, 0]
    length2 = np.einsum("ij,ij->i", along, along)
    share = np.einsum("ij,ij->i", points - ends[:, 0], along) / np.where(length2 > 0.0, length2, 1.0)
    axis = ends[:, 0] + np.clip(share, 0.0, 1.0)[:, None] * along
    normal = points - axis
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), np.finfo(np.float64).tiny)
    radius = np.broadcast_to(radii_of(mesh, world_from_mesh), (mesh.count,))[element]
    return axis + radius[:, None] * normal, normal
