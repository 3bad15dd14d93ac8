"""All triangles of a scene in one frame, for passes that ask triangles instead of maps."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from glshadow.core.adjacency import neighbours
from glshadow.core.spaces import Array, rigid_inverse, world_positions
from glshadow.errors import ResourceError
from glshadow.gl.buffers import BufferTexture, texture_buffer
from glshadow.gl.context import GLContext
from glshadow.gl.entry_points import R8, RGBA32F, RGBA32UI

if TYPE_CHECKING:
    from glshadow.gl.geometry import GpuScene

HUGE = 128.0
"""From here on a triangle gets a rounding bound of its own. At 128 times a table's metre the common bound is 70 micrometres."""

_SOLID = np.full((1, 1, 4), 255, dtype=np.uint8)  # the image of those that have none


_TOGETHER = 2**20  # vertices that are placed at once: many small instances cost no more than what they hold


def _placed(scene: GpuScene) -> tuple[NDArray[np.float32], NDArray[np.uint32]]:
    """Vertices (V, 3) of all nodes, one after the other, and triangles (N, 4): three vertices and the node. A mesh's instances together."""
    nodes = scene.nodes
    vertices = np.cumsum([0, *(len(node.mesh.positions) for node in nodes)])
    triangles = np.cumsum([0, *(len(node.mesh.triangles) for node in nodes)])
    places = np.zeros((vertices[-1], 3), dtype=np.float32)
    corners = np.zeros((triangles[-1], 4), dtype=np.uint32)
    instances: dict[int, list[int]] = {}
    for number, node in enumerate(nodes):
        instances.setdefault(id(node.mesh), []).append(number)
    for numbers in instances.values():
        mesh = nodes[numbers[0]].mesh
        count, faces = len(mesh.positions), mesh.triangles.astype(np.int64)
        step = max(_TOGETHER // max(count, 1), 1)
        for first in range(0, len(numbers), step):
            chosen = np.array(numbers[first : first + step])
            matrices = np.stack([nodes[number].world_from_mesh for number in chosen])
            into = (vertices[chosen][:, None] + np.arange(count)).ravel()
            places[into] = world_positions(mesh.positions, matrices, scene.origin).reshape(-1, 3).astype(np.float32)
            into = (triangles[chosen][:, None] + np.arange(len(faces))).ravel()
            corners[into, :3] = (faces + vertices[chosen][:, None, None]).reshape(-1, 3).astype(np.uint32)
            corners[into, 3] = np.repeat(chosen, len(faces)).astype(np.uint32)
    return places, corners


class WorldTriangles:
    """Vertices of a scene's drawn triangles in world axes, relative to the scene's origin, float32; masks of cut-out materials.

    Attributes
    ----------
    count : int
        Triangles, numbered as the surface buffer numbers them, from 0.
    reach : float
        Largest coordinate of the usual triangles: all but those that reach HUGE times as far as the nearest body does.
    huge : bool
        Whether there are others.
    mask_shift : (N,) int64
        Per node that is cut out what turns a triangle's number into 1 + its number among masked triangles, which may be 0.
    masks, alphas : BufferTexture or None
        Three texels per masked triangle: the corners' texture coordinates and alpha without the texture's, the cutoff (float bits),
        where its image begins, and its width and height in 16 bits each; and the images' alpha. None where nothing is masked.
    """

    def __init__(self, context: GLContext, scene: GpuScene) -> None:
        self.positions, self.triangles = _placed(scene)
        self.count = len(self.triangles)
        each = np.abs(self.positions).max(axis=1)[self.triangles[:, :3]].max(axis=1)
        nearest = np.abs(scene.corners - scene.origin).max(axis=(1, 2)).min()
        usual = each <= HUGE * nearest if (each <= HUGE * nearest).any() else np.ones(len(each), dtype=bool)
        self.reach, self.huge = float(each[usual].max()), not usual.all()
        self._context = context
        self._neighbours: BufferTexture | None = None
        self._buffers: tuple[BufferTexture, BufferTexture] | None = None
        self.masks: BufferTexture | None = None
        self.alphas: BufferTexture | None = None
        self.mask_shift = np.zeros(len(scene.nodes), dtype=np.int64)
        masked = [k for k, gpu in enumerate(scene.meshes) if gpu.cut_out]
        if masked:
            self._upload_masks(scene, masked)
        context.check_errors(f"uploading {self.count} triangles")

    @property
    def textures(self) -> dict[str, BufferTexture]:
        """Positions (RGBA32F), and per triangle three vertices and its node (RGBA32UI), by the samplers that read them."""
        if self._buffers is None:
            padded = np.concatenate([self.positions, np.zeros((len(self.positions), 1), dtype=np.float32)], axis=1)
            self._buffers = (
                texture_buffer(self._context, padded, RGBA32F),
                texture_buffer(self._context, self.triangles, RGBA32UI),
            )
        return dict(zip(("u_positions", "u_corners"), self._buffers, strict=True))

    @property
    def neighbours(self) -> BufferTexture:
        """Per triangle those across its edges (RGBA32UI): see `core.adjacency`."""
        if self._neighbours is None:
            across = neighbours(self.positions, self.triangles[:, :3])
            padded = np.concatenate([across, np.zeros((self.count, 1), dtype=np.uint32)], axis=1)
            self._neighbours = texture_buffer(self._context, padded, RGBA32UI)
            self._context.check_errors(f"uploading the neighbours of {self.count} triangles")
        return self._neighbours

    @property
    def mask_textures(self) -> dict[str, BufferTexture]:
        """Masks and alphas, where something is masked, by the samplers that read them."""
        if self.masks is None or self.alphas is None:
            return {}
        return {"u_masks": self.masks, "u_alphas": self.alphas}

    def _upload_masks(self, scene: GpuScene, masked: list[int]) -> None:
        starts: dict[int, int] = {}  # an image is uploaded once, however many nodes show it
        images: list[NDArray[np.uint8]] = []
        texels: list[NDArray[np.uint32]] = []
        before = end = 0
        for k in masked:
            mesh = scene.nodes[k].mesh
            material, uv = mesh.material, mesh.uv
            texture = _SOLID if material.texture is None or uv is None else material.texture
            height, width = texture.shape[:2]
            if id(texture) not in starts:
                starts[id(texture)] = end
                images.append(texture[::-1, :, 3].ravel())  # v up
                end += width * height
            record = np.zeros((len(mesh.triangles), 12), dtype=np.uint32)
            if uv is not None:
                record[:, :6] = uv[mesh.triangles].reshape(-1, 6).view(np.uint32)
            alpha = np.full((len(record), 3), material.color[3], dtype=np.float32)
            if mesh.colors is not None:
                alpha *= mesh.colors[:, 3][mesh.triangles]
            record[:, 6:9] = alpha.view(np.uint32)
            record[:, 9] = np.float32(material.cutoff).view(np.uint32)
            record[:, 10:] = starts[id(texture)], width | height << 16
            self.mask_shift[k] = before + 1 - int(scene.first[k])
            before += len(record)
            texels.append(record)
        limit = self._context.caps.max_texture_buffer_size
        if max(end, 3 * before) > limit:
            raise ResourceError(
                f"the scene's masks have {end} texels and {before} triangles, a texture buffer of this driver holds {limit} texels: "
                "use smaller textures, or another filter than Exact()"
            )
        self.masks = texture_buffer(self._context, np.concatenate(texels), RGBA32UI)
        self.alphas = texture_buffer(self._context, np.concatenate(images), R8)

    def release(self) -> None:
        """Free the GPU memory."""
        for texture in (*(self._buffers or ()), self._neighbours, self.masks, self.alphas):
            if texture is not None:
                texture.release()


def local_positions(world: WorldTriangles, axes: Array, origin: Array) -> NDArray[np.float32]:
    """Vertices (V, 3) in a light's frame, rounded to float32 where pass/lists.comp rounds them.

    Parameters
    ----------
    axes : (3, 3) float64
        Rotation into the light's frame; float32 values.
    origin : (3,) float64
        Relative to the scene's; float32 values.
    """
    frame = rigid_inverse(axes, np.zeros(3))
    return world_positions(world.positions.astype(np.float64) - origin, frame, np.zeros(3)).astype(np.float32)
