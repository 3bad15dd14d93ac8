"""The floor: the time that the same driver needs for the same image without shadows, plus one pass over the map's triangles.

A Lambert pass of the camera and a depth-only pass of the light into a map that is not read, with the culling, matrices and sizes of
a real frame, including read-back, and without anything cached from the last frame. Frame time divided by floor hardly depends on the
machine. It is below 1 if the map is smaller than the floor's, or if parts of the frame were cached.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from types import TracebackType
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from numpy.typing import NDArray

from glshadow.core.spaces import Array, ClipSpace
from glshadow.derive.culling import seen_by
from glshadow.gl.driver.targets import depth_texture
from glshadow.gl.scene.drawing import draw_nodes
from glshadow.gl.scene.matrices import pack_matrices
from glshadow.scene.box import box_corners
from glshadow.scene.capsules import refuse_capsules
from glshadow.scene.mesh import AlphaMode, Mesh
from glshadow.scene.nodes import Scene
from glshadow.shadows.metric import Target
from glshadow.shadows.view import ShadowView, camera_view
from glshadow.signals import undisturbed

if TYPE_CHECKING:
    from glshadow.frame import Frame
    from glshadow.renderer import Renderer

FLOOR_RESOLUTION = 2048  # one floor for all settings, so that their ratios can be compared

LAMBERT = (
    """#version 330 core
in vec3 a_position;
in vec3 a_normal;
out vec3 v_normal;
uniform mat4 u_clip_from_mesh;
uniform mat3 u_normal_from_mesh;
void main() {
    v_normal = u_normal_from_mesh * a_normal;
    gl_Position = u_clip_from_mesh * vec4(a_position, 1.0);
}""",
    """#version 330 core
in vec3 v_normal;
uniform vec3 u_to_light;
out vec4 o_color;
void main() { o_color = vec4(vec3(0.1 + 0.9 * max(dot(normalize(v_normal), u_to_light), 0.0)), 1.0); }""",
)
DEPTH = (
    """#version 330 core
in vec3 a_position;
uniform mat4 u_clip_from_mesh;
void main() { gl_Position = u_clip_from_mesh * vec4(a_position, 1.0); }""",
    "#version 330 core\nvoid main() {}",
)


@dataclass(frozen=True)
class _Drawn:
    """A node's mesh as both passes draw it."""

    lambert: Any
    depth: Any
    solid: bool


class Floor:
    """The floor of one scene at one size. Owns its buffers, programs and targets in the renderer's context.

    Parameters
    ----------
    renderer : Renderer
    scene : Scene
    size : (2,) ints
        Size of the image.
    resolution : int
        Texels along each side of the map, for every view of the light.
    """

    def __init__(self, renderer: Renderer, scene: Scene, size: tuple[int, int], resolution: int = 2048) -> None:
        refuse_capsules(scene, "a study")
        self._context = renderer._context
        self.scene, self.size, self.resolution = scene, size, resolution
        self._nodes = [scene.nodes[i] for i in scene.drawn.tolist()]
        self._world_from_mesh = np.stack([node.world_from_mesh for node in self._nodes])
        self._boxes = box_corners(*scene.boxes)
        self._casts = ~scene.blending
        self._owned: list[Any] = []
        with self._context.drawing():
            ctx = self._context.ctx
            with undisturbed():
                self._lambert, self._depth = self._own(ctx.program(*LAMBERT)), self._own(ctx.program(*DEPTH))
            shadow_map = self._own(
                depth_texture(self._context, (resolution, resolution), Target.DEPTH32F, "the floor's map")
            )
            depth = self._own(depth_texture(self._context, size, Target.DEPTH32F, "the floor's depth buffer"))
            self._color = self._own(ctx.texture(size, 4))
            self._map = self._own(ctx.framebuffer(depth_attachment=shadow_map))
            self._image = self._own(ctx.framebuffer([self._color], depth))
            self._idle = self._own(ctx.simple_framebuffer((1, 1)))
            uploaded: dict[int, tuple[Any, Any]] = {}
            self._drawn = [self._upload(i, uploaded) for i in range(len(self._nodes))]
        numbers = {key: number for number, key in enumerate(uploaded)}
        self.mesh_number = np.array([numbers[id(node.mesh)] for node in self._nodes])
        self.mirrored = (np.linalg.det(self._world_from_mesh[:, :3, :3]) < 0.0).tolist()
        self._hidden = ["back" if drawn.solid else None for drawn in self._drawn]

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.release()

    def release(self) -> None:
        """Free the GPU memory. May be called twice; call it before the renderer is released."""
        with self._context.drawing():
            while self._owned:
                self._owned.pop().release()

    def _own(self, thing: Any) -> Any:
        self._owned.append(thing)
        return thing

    def _upload(self, i: int, uploaded: dict[int, tuple[Any, Any]]) -> _Drawn:
        node, ctx = self._nodes[i], self._context.ctx
        mesh = node.mesh
        if id(mesh) not in uploaded:
            position = self._own(ctx.buffer(mesh.positions.astype(np.float32).tobytes()))
            normal = self._own(ctx.buffer(_normals(mesh).tobytes()))
            index = self._own(ctx.buffer(mesh.triangles.tobytes()))
            content = [(position, "3f", "a_position"), (normal, "3f", "a_normal")]
            arrays = ctx.vertex_array(self._lambert, content, index), ctx.vertex_array(self._depth, content[:1], index)
            uploaded[id(mesh)] = (self._own(arrays[0]), self._own(arrays[1]))
        material = mesh.material
        solid = mesh.closed and material.alpha_mode is not AlphaMode.MASK and not material.double_sided
        return _Drawn(*uploaded[id(mesh)], solid)

    def draw(self, frame: Frame, light: int = 0) -> NDArray[np.uint8]:
        """Draw both passes with the matrices of a rendered frame, then read back; (H, W, 3), row 0 at the top."""
        clip = ClipSpace(True, True) if self._context.caps.clip_control else ClipSpace(False, False)
        eye = camera_view(frame.camera, frame.size, frame.near, frame.far, clip)
        towards = frame.lights[light].to_light(self.scene.extent.mean(axis=0)[None])[0][0]
        with self._context.drawing():
            for view in frame.used[light].views:
                self._pass(self._map, self._depth, view, self._casts)
            self._lambert["u_to_light"].value = tuple(towards)
            self._pass(self._image, self._lambert, eye, np.ones(len(self._nodes), dtype=bool))
            data = np.frombuffer(self._color.read(), np.uint8).reshape(self.size[1], self.size[0], 4)
            self._idle.use()
        return np.ascontiguousarray(data[::-1])[..., :3]

    def _pass(self, target: Any, program: Any, view: ShadowView, wanted: NDArray[np.bool_]) -> None:
        context, ctx = self._context, self._context.ctx
        if context.caps.clip_control:
            context.gl.clip_control(view.clip.zero_to_one)
        target.use()
        ctx.enable_only(ctx.DEPTH_TEST)
        ctx.depth_func = ">=" if view.clip.reversed else "<="
        is_map = program is self._depth
        ctx.depth_clamp_range = (0.0, 1.0) if is_map else None
        target.clear(depth=view.clip.clear_depth)
        matrices = pack_matrices(view.clip_from_world @ self._world_from_mesh)

        def begin(node: int) -> tuple[Callable[[int], None], Any]:
            def place(i: int) -> None:
                program["u_clip_from_mesh"].write(matrices[i])
                if not is_map:
                    normals = np.ascontiguousarray(self._world_from_mesh[i, :3, :3].T, dtype=np.float32)
                    program["u_normal_from_mesh"].write(normals.tobytes())

            return place, self._drawn[node].depth if is_map else self._drawn[node].lambert

        chosen = np.flatnonzero(wanted & seen_by(view.clip_from_world, self._boxes, view))
        draw_nodes(ctx, self, chosen, self._hidden, begin)
        ctx.depth_clamp_range = None
        ctx.enable_only(ctx.DEPTH_TEST)


def _normals(mesh: Mesh) -> NDArray[np.float32]:
    """Normals per vertex (V, 3), unit length: the mesh's own, or the mean of its triangles' normals."""
    if mesh.normals is not None:
        return mesh.normals
    corners = mesh.positions[mesh.triangles]
    faces = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    total: Array = np.stack(
        [np.bincount(mesh.triangles.ravel(), np.repeat(faces[:, k], 3), len(mesh.positions)) for k in range(3)], axis=-1
    )
    length = np.linalg.norm(total, axis=1, keepdims=True)
    return np.asarray(total / np.where(length > 0.0, length, 1.0), dtype=np.float32)
