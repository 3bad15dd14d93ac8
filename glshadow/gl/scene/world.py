"""All triangles of a scene in one frame, for passes that test rays against triangles."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from glshadow.core.spaces import Array, rigid_inverse, world_positions
from glshadow.errors import ResourceError
from glshadow.geometry.adjacency import NONE
from glshadow.gl.driver.buffers import BufferTexture, texture_buffer
from glshadow.gl.driver.context import GLContext
from glshadow.gl.driver.entry_points import R8, RGBA32F, RGBA32UI
from glshadow.gl.scene.capsules import radii_of, stored
from glshadow.scene.capsules import Capsules
from glshadow.scene.texture import NEAREST, WRAPS, Sampler

if TYPE_CHECKING:
    from glshadow.gl.scene.geometry import GpuScene

HUGE = 128.0
"""A triangle that reaches further than this multiple gets its own rounding bound. At 128 times a table's metre the common bound is
70 micrometres."""

_TEXEL = 16  # bytes of a row of each buffer
_SOLID = np.full((1, 1, 4), 255, dtype=np.uint8)  # the image of materials without a texture

_START_BITS = 27  # of an image's first texel; its sampling is above

_TOGETHER = 2**15  # vertices transformed per batch, so that intermediate results stay in the CPU cache


def _placed(scene: GpuScene) -> tuple[NDArray[np.float32], NDArray[np.uint32], NDArray[np.int64]]:
    """Vertices (V, 4) of all nodes, one after the other, as `_round` has them, triangles (T, 4): three vertices and the node, and the
    first vertex of each node (N + 1,)."""
    meshes = [stored(node.mesh) for node in scene.nodes]
    vertices = np.cumsum([0, *(len(mesh.positions) for mesh in meshes)])
    triangles = np.append(scene.first, scene.count)
    places = np.zeros((vertices[-1], 4), dtype=np.float32)
    corners = np.zeros((scene.count, 4), dtype=np.uint32)
    for first, end in _blocks(vertices.tolist()):
        into = slice(vertices[first], vertices[end])
        faces = corners[triangles[first] : triangles[end]]
        if end == first + 1:
            points = meshes[first].positions
            for k in range(0, len(points), _TOGETHER):
                some = slice(into.start + k, min(into.start + k + _TOGETHER, into.stop))
                _round(
                    places[some], world_positions(points[k : k + _TOGETHER], scene.world_from_mesh[first], scene.origin)
                )
            np.add(meshes[first].triangles, into.start, out=faces[:, :3], casting="unsafe")
            faces[:, 3] = first
            continue
        # each vertex with its node's matrix, in the same order of sums as world_positions
        points = np.concatenate([mesh.positions for mesh in meshes[first:end]])
        owner = np.repeat(np.arange(first, end), np.diff(vertices[first : end + 1]))
        matrices = scene.world_from_mesh[first:end, :3] - np.pad(scene.origin[:, None], ((0, 0), (3, 0)))
        _round(places[into], _each_placed(points, matrices, owner - first))
        owner = np.repeat(np.arange(first, end), np.diff(triangles[first : end + 1]))
        np.add(np.concatenate([mesh.triangles for mesh in meshes[first:end]]), vertices[owner, None], out=faces[:, :3],
               casting="unsafe")  # fmt: skip
        faces[:, 3] = owner
    for node in np.flatnonzero(scene.round).tolist():
        mesh = scene.nodes[node].mesh
        assert isinstance(mesh, Capsules)
        radii = radii_of(mesh, scene.world_from_mesh[node])
        places[vertices[node + 1] - len(radii) : vertices[node + 1]] = np.stack(
            [radii, *np.zeros((3, len(radii)))], axis=1
        )
    return places, corners, vertices


def _round(places: NDArray[np.float32], points: Array) -> None:
    """Points (V, 3) to float32 places (V, 4): in w eight more bits of each coordinate, see lib/ray_triangle.glsl."""
    places[:, :3] = points
    x, y, z = np.abs(places[:, :3]).T
    scale = np.ldexp(1.0, 32 - np.frexp(np.maximum(np.maximum(x, y), z))[1])
    bits = np.rint((points - places[:, :3]) * scale[:, None]) + 128.0
    places[:, 3] = np.minimum(bits, 255.0) @ np.array([1.0, 256.0, 65536.0])


def _each_placed(points: Array, matrices: Array, owner: NDArray[np.int64]) -> Array:
    """Points (V, 3) transformed by matrices (N, 3, 4), each by its owner's: equal to `world_positions` to the last bit."""
    x, y, z = points.T
    rows = [[matrices[:, i, k].take(owner) for k in range(4)] for i in range(3)]
    return np.stack([a * x + b * y + c * z + d for a, b, c, d in rows], axis=-1)


def _blocks(starts: list[int]) -> Iterator[tuple[int, int]]:
    """Batches of consecutive nodes, first and end, with about this many vertices (or triangles); a large node is a batch of its own.

    `starts`: of each node's vertices, and the end.
    """
    first = 0
    for node in range(1, len(starts) - 1):
        if starts[node + 1] - starts[first] > _TOGETHER:
            yield first, node
            first = node
    yield first, len(starts) - 1


def _tops(places: NDArray[np.float32], corners: NDArray[np.uint32], vertices: NDArray[np.int64]) -> NDArray[np.float32]:
    """Largest coordinate of each node's used vertices; `vertices`: each node's first, and the end."""
    top = np.abs(places[:, 0])
    for k in (1, 2):
        np.maximum(top, np.abs(places[:, k]), out=top)
    used = np.zeros(len(top), dtype=bool)
    for k in range(3):
        used[corners[:, k]] = True
    top[~used] = 0.0
    return np.asarray(np.maximum.reduceat(top, vertices[:-1]))


class WorldTriangles:
    """Vertices of a scene's drawn triangles in world axes, relative to the scene's origin, float32; masks of cut-out materials.

    Attributes
    ----------
    count : int
        Triangles, in the order of triangle IDs, from 0.
    reach : float
        Largest coordinate of the triangles that are not huge: all but those that reach HUGE times as far as the nearest body.
    huge : bool
        Whether there are huge triangles.
    mask_shift : (N,) int64
        Per alpha-tested node the shift from a triangle's index to 1 + its index among masked triangles; may be 0.
    masks, alphas : BufferTexture or None
        Three texels per masked triangle: the corners' texture coordinates and alpha without the texture's, the cutoff (float bits),
        start and sampling (27 and 5 bits), width and height (16 bits each) of its image; and the images' alpha.
        None if nothing is alpha-tested.
    """

    def __init__(
        self,
        context: GLContext,
        scene: GpuScene,
        before: WorldTriangles | None = None,
        moved: NDArray[np.bool_] | None = None,
    ) -> None:
        self._context = context
        self._neighbours: BufferTexture | None = None
        self._buffers: tuple[BufferTexture, BufferTexture] | None = None
        self._shapes, self._first = [gpu.shape for gpu in scene.meshes], np.append(scene.first, scene.count)
        self.count = scene.count
        nearest = float(np.abs(scene.corners - scene.origin).max(axis=(1, 2)).min())
        self._arrays: tuple[NDArray[np.float32], NDArray[np.uint32]] | None = None
        masked = [k for k, gpu in enumerate(scene.meshes) if gpu.cut_out]
        if before is not None and moved is not None and before._buffers and not (masked or before.masks):
            self._take(scene, before, np.flatnonzero(moved))
        else:
            places, corners, self._vertices = _placed(scene)
            self._arrays = (places, corners)
            self._tops = _tops(places, corners, self._vertices)
        self.reach, self.huge = self._reach(nearest)
        self.masks: BufferTexture | None = None
        self.alphas: BufferTexture | None = None
        self.mask_shift = np.zeros(len(scene.nodes), dtype=np.int64)
        if masked:
            self._upload_masks(scene, masked)
        context.check_errors(f"uploading {self.count} triangles")

    def _take(self, scene: GpuScene, before: WorldTriangles, moved: NDArray[np.int64]) -> None:
        """Take the buffers of the scene before, and place the vertices of the nodes that have moved."""
        assert before._buffers is not None
        self._vertices, self._tops = before._vertices, before._tops.copy()
        self._neighbours = before._neighbours
        for node in moved.tolist():
            mesh, first = scene.nodes[node].mesh, int(self._first[node])
            places = np.zeros((len(mesh.positions), 4), dtype=np.float32)
            for k in range(0, len(places), _TOGETHER):
                some = slice(k, k + _TOGETHER)
                _round(places[some], world_positions(mesh.positions[some], scene.world_from_mesh[node], scene.origin))
            corners = np.full((len(mesh.triangles), 4), node, dtype=np.uint32)
            corners[:, :3] = mesh.triangles
            self._tops[node] = _tops(places, corners, np.array([0, len(places)]))[0]
            before._buffers[0].buffer.write(places.tobytes(), offset=_TEXEL * int(self._vertices[node]))
            if self._shapes[node] is before._shapes[node]:
                continue
            corners[:, :3] += np.uint32(self._vertices[node])
            before._buffers[1].buffer.write(corners.tobytes(), offset=_TEXEL * first)
            if self._neighbours is not None:
                self._neighbours.buffer.write(self._across(node, node + 1).tobytes(), offset=_TEXEL * first)
        self._buffers, before._buffers, before._neighbours = before._buffers, None, None

    def _reach(self, nearest: float) -> tuple[float, bool]:
        """`reach` and `huge`; `nearest`: distance of the nearest body's farthest corner."""
        farthest = float(self._tops.max())
        if farthest <= HUGE * nearest:
            return farthest, False
        places, corners = self._placed()
        each = np.abs(places[:, :3]).max(axis=1)[corners[:, :3]].max(axis=1)
        usual = each <= HUGE * nearest
        return (float(each[usual].max()), True) if usual.any() else (farthest, False)

    @property
    def first_vertex(self) -> NDArray[np.int64]:
        """First vertex of each node, and the end (N + 1,)."""
        return self._vertices

    @property
    def positions(self) -> NDArray[np.float32]:
        """Vertices (V, 3)."""
        return self._placed()[0][:, :3]

    @property
    def triangles(self) -> NDArray[np.uint32]:
        """Three vertices and the node of each triangle, (T, 4)."""
        return self._placed()[1]

    @property
    def corners(self) -> Array:
        """Vertices (T, 3, 3) of all triangles."""
        places, corners = self._placed()
        return places[:, :3].astype(np.float64)[corners[:, :3]]

    def _placed(self) -> tuple[NDArray[np.float32], NDArray[np.uint32]]:
        """Read the buffers back, once they are made."""
        if self._arrays is not None:
            return self._arrays
        assert self._buffers is not None
        places, corners = (texture.buffer.read() for texture in self._buffers)
        return np.frombuffer(places, np.float32).reshape(-1, 4), np.frombuffer(corners, np.uint32).reshape(-1, 4)

    @property
    def textures(self) -> dict[str, BufferTexture]:
        """Positions (RGBA32F), and per triangle three vertices and its node (RGBA32UI), by sampler name."""
        if self._buffers is None:
            places, corners = self._placed()
            limit = self._context.caps.max_texture_buffer_size
            if len(places) > limit:
                raise ResourceError(
                    f"the scene has {len(places)} vertices, a texture buffer of this driver holds {limit}: split the scene, or use "
                    "another filter than Exact()"
                )
            self._buffers = (
                texture_buffer(self._context, places, RGBA32F),
                texture_buffer(self._context, corners, RGBA32UI),
            )
            self._arrays = None  # now in the buffers
        return dict(zip(("u_positions", "u_corners"), self._buffers, strict=True))

    @property
    def neighbours(self) -> BufferTexture:
        """Per triangle the node's triangles across its edges (RGBA32UI): see `geometry.adjacency`."""
        if self._neighbours is None:
            across = np.full((self.count, 4), NONE, dtype=np.uint32)
            for first, end in _blocks(self._first.tolist()):
                across[self._first[first] : self._first[end]] = self._across(first, end)
            self._neighbours = texture_buffer(self._context, across, RGBA32UI)
            self._context.check_errors(f"uploading the neighbours of {self.count} triangles")
        return self._neighbours

    def _across(self, first: int, end: int) -> NDArray[np.uint32]:
        """Rows (T, 4) of `neighbours` of consecutive nodes."""
        shapes, starts = self._shapes[first:end], self._first[first : end + 1]
        of_mesh = shapes[0].neighbours if len(shapes) == 1 else np.concatenate([s.neighbours for s in shapes])
        shift = starts[0] if len(shapes) == 1 else np.repeat(starts[:-1], np.diff(starts))[:, None]
        rows = np.full((len(of_mesh), 4), NONE, dtype=np.uint32)
        np.add(of_mesh, np.asarray(shift, dtype=np.uint32), out=rows[:, :3], where=of_mesh != NONE)
        return rows

    @property
    def mask_textures(self) -> dict[str, BufferTexture]:
        """Masks and alphas by sampler name; empty if nothing is alpha-tested."""
        if self.masks is None or self.alphas is None:
            return {}
        return {"u_masks": self.masks, "u_alphas": self.alphas}

    def _upload_masks(self, scene: GpuScene, masked: list[int]) -> None:
        starts: dict[int, int] = {}  # each image is uploaded once, however many nodes show it
        images: list[NDArray[np.uint8]] = []
        texels: list[NDArray[np.uint32]] = []
        before = end = 0
        for k in masked:
            mesh = scene.nodes[k].mesh
            material, uv = mesh.material, mesh.placed_uv
            texture = _SOLID if material.texture is None or uv is None else material.texture
            height, width = texture.shape[:2]
            if id(texture) not in starts:
                starts[id(texture)] = end
                images.append(texture[::-1, :, 3].ravel())  # v points up
                end += width * height
            record = np.zeros((len(mesh.triangles), 12), dtype=np.uint32)
            if uv is not None:
                record[:, :6] = uv[mesh.triangles].reshape(-1, 6).view(np.uint32)
            alpha = np.full((len(record), 3), material.color[3], dtype=np.float32)
            if mesh.colors is not None:
                alpha *= mesh.colors[:, 3][mesh.triangles]
            record[:, 6:9] = alpha.view(np.uint32)
            record[:, 9] = np.float32(material.cutoff).view(np.uint32)
            record[:, 10:] = starts[id(texture)] | _sampling(material.sampler) << _START_BITS, width | height << 16
            self.mask_shift[k] = before + 1 - int(scene.first[k])
            before += len(record)
            texels.append(record)
        limit = self._context.caps.max_texture_buffer_size
        if max(end, 3 * before) > limit or end > 1 << _START_BITS:
            raise ResourceError(
                f"the scene's masks have {end} texels and {before} triangles, a texture buffer of this driver holds "
                f"{min(limit, 1 << _START_BITS)} texels: "
                "use smaller textures, or another filter than Exact()"
            )
        self.masks = texture_buffer(self._context, np.concatenate(texels), RGBA32UI)
        self.alphas = texture_buffer(self._context, np.concatenate(images), R8)

    def release(self) -> None:
        """Free the GPU memory."""
        for texture in (*(self._buffers or ()), self._neighbours, self.masks, self.alphas):
            if texture is not None:
                texture.release()


def _sampling(sampler: Sampler) -> int:
    """Five bits for lib/mask.glsl: wrap along u and v, two each, and 16 for the nearest texel."""
    along_u, along_v = (WRAPS.index(each) for each in sampler.wrap)
    return along_u | along_v << 2 | (sampler.magnify == NEAREST) << 4


def local_positions(world: WorldTriangles, axes: Array, origin: Array) -> NDArray[np.float32]:
    """Vertices (V, 3) in a light's frame, rounded to float32 where pass/lists.comp rounds them.

    Parameters
    ----------
    axes : (3, 3) float64
        Rotation into the light's frame; float32 values.
    origin : (3,) float64
        Relative to the scene's; float32 values.
    """
    inverse = rigid_inverse(axes, np.zeros(3))
    return world_positions(world.positions.astype(np.float64) - origin, inverse, np.zeros(3)).astype(np.float32)
