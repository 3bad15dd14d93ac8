"""The camera pass: the visible triangle at each pixel, and its depth."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar

import moderngl
import numpy as np
from numpy.typing import NDArray

from glshadow.core.cameras import Camera
from glshadow.core.spaces import Array, ClipSpace
from glshadow.derive.culling import seen_by
from glshadow.geometry.fitting import frustum_of, visible_corners
from glshadow.geometry.ranges import USUAL_SHARE, depth_range, view_depth
from glshadow.gl.driver.buffers import texture_buffer
from glshadow.gl.driver.context import GLContext
from glshadow.gl.driver.entry_points import RGBA32UI
from glshadow.gl.driver.program import Program, Programs
from glshadow.gl.scene.drawing import draw_nodes
from glshadow.gl.scene.geometry import GpuScene
from glshadow.gl.scene.matrices import pack_matrices
from glshadow.gl.scene.meshes import GpuMesh
from glshadow.gl.scene.paint import MATTE
from glshadow.gl.scene.runs import Whole
from glshadow.scene.mesh import AlphaMode, Material
from glshadow.scene.nodes import Scene
from glshadow.shadows.view import ShadowView, camera_view

# GL clips triangles in float32, with an error of 2^-24 of their length. Where that would be visible, the viewport is three times as wide
# and high as the image, so that the rounded part lies outside.
_MIDDLE_THIRD = np.diag([1.0 / 3.0, 1.0 / 3.0, 1.0, 1.0])
_CUBE = np.array([[i, j, k] for i in (-1.0, 1.0) for j in (-1.0, 1.0) for k in (-1.0, 1.0)])
_INSTANCE_TEXELS = 7  # pass/surface.vert


@dataclass(frozen=True, eq=False)
class CameraView:
    """What a camera sees of a scene at one image size, independent of the lights.

    Parameters
    ----------
    near, far : float
        Depth range, as given or derived.
    view : ShadowView
        The same as a view.
    boxes : (N, 2, 3), (N, 4, 4) float64
        As `GpuScene.boxes`.
    lifts : (N,) float64
        See `GpuScene.lifts`.
    drawn : (K,) int64
        Opaque nodes that may be in the image.
    clip_from_mesh : (N, 4, 4) float32
        Per node, in GL's column order.
    outside : (N,) bool
        Whether a node's box is wholly beyond the near plane: back faces are then invisible if the node is closed.
    fallbacks : tuple of str
        Precision that the driver's depth format loses.
    """

    camera: Camera
    size: tuple[int, int]
    near: float
    far: float
    clip: ClipSpace
    view: ShadowView
    boxes: tuple[Array, Array]
    lifts: Array
    drawn: NDArray[np.int64]
    clip_from_mesh: NDArray[np.float32]
    outside: NDArray[np.bool_]
    fallbacks: tuple[str, ...] = ()
    anywhere: ClassVar[bool] = False  # whether receivers may be where no camera sees them, such as inside a closed body

    @cached_property
    def receivers(self) -> list[Array]:
        """Per node the corners (M, 3) of the visible part of its box."""
        view = self.view
        frustum = frustum_of(view.window, self.near, self.far, view.view_from_world, self.camera.is_perspective)
        seen = visible_corners(*self.boxes, frustum)
        return [_raised(points, lift) for points, lift in zip(seen, self.lifts, strict=True)]

    @property
    def reaches_far(self) -> bool:
        """Whether triangles may be so long, compared with their distance, that the error of clipping is visible."""
        return self.camera.is_perspective and self.near < USUAL_SHARE * self.far

    @property
    def far_z(self) -> float:
        """NDC z of the far plane."""
        return (0.0 if self.clip.zero_to_one else -1.0) if self.clip.reversed else 1.0

    @property
    def eye(self) -> Array:
        """(3,) world point from which the resolve passes measure depth: the eye, or the centre of an orthographic near plane."""
        position = np.asarray(self.camera.position)
        return position if self.camera.is_perspective else position - self.near * self.camera.view_from_world[2, :3]

    @property
    def near_corners(self) -> Array:
        """(4, 3) world points: corners of the visible part of the near plane, where all rays start."""
        ndc = np.array([(-1.0, -1.0, 1.0), (1.0, -1.0, 1.0), (1.0, 1.0, 1.0), (-1.0, 1.0, 1.0)])
        starts = ndc @ self.rays.T @ self.camera.view_from_world[:3, :3]
        return np.asarray(self.eye + starts * (self.near if self.camera.is_perspective else 1.0))

    @property
    def rays(self) -> Array:
        """(3, 3) matrix that maps (NDC x, NDC y, 1) to the view-space ray of unit view depth through the eye; of an
        orthographic camera to the ray's start, relative to the eye."""
        left, right, bottom, top = self.camera.window(self.size)
        x, y = 0.5 * (right - left), 0.5 * (top - bottom)
        return np.array([[x, 0.0, left + x], [0.0, y, bottom + y], [0.0, 0.0, -float(self.camera.is_perspective)]])

    def pixel(self, depth: float) -> float:
        """Height of a pixel at a view depth, world units."""
        _, _, bottom, top = self.camera.window(self.size)
        return (top - bottom) / self.size[1] * (depth if self.camera.is_perspective else 1.0)

    @property
    def start_distance(self) -> float:
        """Distance between the eye and the starts of rays; world units."""
        return 0.0 if self.camera.is_perspective else float(np.linalg.norm(np.abs(self.rays).sum(axis=1)))

    @property
    def reach(self) -> float:
        """Largest distance of a visible point from the eye; world units."""
        if self.camera.is_perspective:
            return self.far * float(np.linalg.norm(np.abs(self.rays).sum(axis=1)))
        return self.start_distance + self.far - self.near

    @property
    def unproject(self) -> tuple[float, float]:
        """(x, y) with x + y * window depth = 1 / view depth, or the view depth itself if orthographic; for every clip convention."""
        if not self.camera.is_perspective:
            span = self.far - self.near
            return (span, -span) if self.clip.reversed else (0.0, span)
        matrix = self.view.clip_from_view
        # ndc = low + span * window = -m22 + m23 / depth
        low, span = (0.0, 1.0) if self.clip.zero_to_one else (-1.0, 2.0)
        return (low + matrix[2, 2]) / matrix[2, 3], span / matrix[2, 3]

    def depth(self, window: Array) -> Array:
        """View depth of window depths, any shape."""
        x, y = self.unproject
        return 1.0 / (x + y * window) if self.camera.is_perspective else self.near + (x + y * window)


@dataclass(frozen=True, eq=False)
class Rays:
    """What programs need to test pixel rays against the scene's triangles: see lib/ray_triangle.glsl."""

    dialect: str
    defines: dict[str, int | str]
    uniforms: dict[str, Any]
    textures: dict[str, Any]


@dataclass(frozen=True, eq=False)
class Peel:
    """What programs need to draw a layer of blended surfaces: see lib/peel.glsl."""

    defines: dict[str, int | str]
    textures: dict[str, Any]


def view_scene(gpu: GpuScene, camera: Camera, size: tuple[int, int], clip_control: bool) -> CameraView:
    """Derive a camera's depth range and what it sees. Reversed 0..1 depth if the driver supports it, else -1..1."""
    found = depth_range(camera, size, gpu.boxes, gpu.corners, clip_control)
    near, far = found.near, found.far
    clip = ClipSpace(True, True) if clip_control else ClipSpace(False, False)
    view = camera_view(camera, size, near, far, clip)
    corners = gpu.corners
    return CameraView(
        camera, size, near, far, clip, view,
        boxes=gpu.boxes,
        lifts=gpu.lifts,
        drawn=np.flatnonzero(seen_by(view.clip_from_world, corners, view) & ~gpu.copies & ~gpu.blends),
        clip_from_mesh=pack_matrices(view.clip_from_world @ gpu.world_from_origin),
        outside=view_depth(camera, corners).min(axis=1) > near,
        fallbacks=found.fallbacks,
    )  # fmt: skip


def _raised(points: Array, lift: float) -> Array:
    """Points (M, 3) whose hull also contains everything within a distance of `lift` of the given points."""
    return (points[:, None] + lift * _CUBE).reshape(-1, 3) if lift > 0.0 else points


def draw_surface(
    context: GLContext,
    programs: Programs,
    scene: GpuScene,
    camera_view: CameraView,
    framebuffer: moderngl.Framebuffer,
    samples: int = 1,
    rays: Rays | None = None,
    peel: Peel | None = None,
) -> None:
    """Draw triangle IDs, with depth and what else the scene needs, into a surface buffer.

    Parameters
    ----------
    samples : int
        Per pixel of the buffer.
    rays : Rays, optional
        Redraw over the content, in each pixel the triangle that its ray meets; else rasterise as GL does, into an empty buffer.
    peel : Peel, optional
        Draw a layer of blended surfaces.
    """
    ctx = context.ctx
    if context.caps.clip_control:
        context.gl.clip_control(camera_view.clip.zero_to_one)
    clip_from_mesh, (width, height) = camera_view.clip_from_mesh, framebuffer.size
    wide = (
        rays is None
        and camera_view.reaches_far
        and all(np.less_equal((3 * width, 3 * height), context.caps.max_viewport))
    )
    if wide:
        framebuffer.viewport = (-width, -height, 3 * width, 3 * height)
        clip_from_mesh = pack_matrices(_MIDDLE_THIRD @ camera_view.view.clip_from_world @ scene.world_from_origin)
    framebuffer.use()
    ctx.depth_func = ">" if camera_view.clip.reversed else "<"  # equal depth would mean the background
    ctx.enable_only(moderngl.DEPTH_TEST)
    if rays is None:
        framebuffer.clear(depth=camera_view.clip.clear_depth)
    # back faces of a closed mesh are invisible from outside
    unseen = scene.closed & camera_view.outside | scene.culls
    hidden = ["back" if each else None for each in unseen.tolist()]
    of_kind: dict[tuple[Any, ...], Program] = {}  # one look-up per kind, not per mesh
    beside = rays.textures if rays else peel.textures if peel else {}

    sides = np.where(scene.mirrored, -1.0, 1.0).astype(np.float32)[:, None]

    def begin(node: int) -> tuple[Callable[[int], None], moderngl.VertexArray]:
        gpu, material = scene.meshes[node], scene.nodes[node].mesh.material
        transmits = gpu.transmission is not None
        kind = (gpu.smooth, gpu.textured, gpu.colored, gpu.cut_out, transmits, *gpu.paint.defines.items())
        if kind not in of_kind:
            of_kind[kind] = _program(programs, scene, gpu, samples, rays, peel)
        program = of_kind[kind]
        program.bind(**beside)  # again: instances drawn since took the units for textures of theirs
        _set_material(program, scene, gpu, material)
        if peel is not None:
            set_transparency(program, gpu, material)

        def place(i: int) -> None:
            program.write("u_clip_from_mesh", clip_from_mesh[i])
            program.write("u_first_triangle", scene.packed_first[i])
            program.write("u_normal_from_mesh", scene.packed_normals[i])
            program.write("u_side", sides[i])
            program.set(u_hidden=hidden[i] is not None)

        return place, gpu.vertex_array(program, "numbered")

    whole = Whole(context, scene.count)

    def crowd(nodes: NDArray[np.int64]) -> None:
        gpu, material = scene.meshes[nodes[0]], scene.nodes[nodes[0]].mesh.material
        program = _program(programs, scene, gpu, samples, rays, peel, GLS_INSTANCED=1)
        _set_material(program, scene, gpu, material)
        if peel is not None:
            set_transparency(program, gpu, material)
        program.write("u_side", sides[nodes[0]])
        program.set(u_hidden=hidden[nodes[0]] is not None)
        array = gpu.vertex_array(program, "numbered")
        most = context.caps.max_texture_buffer_size // _INSTANCE_TEXELS
        for some in np.split(nodes, range(most, len(nodes), most)):
            instances = texture_buffer(context, _instances(scene, clip_from_mesh, some), RGBA32UI)
            program.bind(u_instances=instances)
            whole.instances(array, len(some), lambda first: program.set(u_first_instance=first))
            instances.release()

    draw_nodes(ctx, scene, camera_view.drawn[~scene.round[camera_view.drawn]], hidden, begin, whole, crowd)
    ctx.enable_only(moderngl.DEPTH_TEST)
    if wide:
        framebuffer.viewport = (0, 0, width, height)
        framebuffer.use()


def _instances(scene: GpuScene, clip_from_mesh: NDArray[np.float32], nodes: NDArray[np.int64]) -> NDArray[np.uint32]:
    """Per-instance texels of pass/surface.vert, of nodes (N, 7, 4)."""
    data = np.zeros((len(nodes), _INSTANCE_TEXELS, 4), dtype=np.uint32)
    data[:, :4] = clip_from_mesh[nodes].view(np.uint32)
    data[:, 4:, :3] = scene.packed_normals[nodes].view(np.uint32)
    data[:, 4, 3] = scene.packed_first[nodes, 0]
    data[:, 5, 3] = np.where(np.array(scene.mirrored)[nodes], np.float32(-1.0), np.float32(1.0)).view(np.uint32)
    return data


def _set_material(program: Program, scene: GpuScene, gpu: GpuMesh, material: Material) -> None:
    program.set(u_color=material.color, u_cutoff=gpu.cutoff)
    if gpu.texture is not None:
        program.bind(u_texture=gpu.texture)
    if scene.features.any or scene.features.rough:
        program.set(u_metallic_roughness=(0.0, MATTE))
        program.set(**gpu.paint.uniforms)
        program.bind(**gpu.paint.textures)


def _program(
    programs: Programs, scene: GpuScene, gpu: GpuMesh, samples: int, rays: Rays | None, peel: Peel | None, **more: int
) -> Program:
    defines: dict[str, int | str] = {
        "GLS_SURFACE": scene.channels,
        "GLS_SMOOTH": int(gpu.smooth),
        "GLS_TEXTURED": int(gpu.textured),
        "GLS_COLORED": int(gpu.colored),
        "GLS_ALPHA": int(gpu.cut_out),
        "GLS_LOD": f"{0.5 * math.log2(samples):.1f}",
        **scene.features.defines(scene.channels),
        **gpu.paint.defines,
        **more,
    }
    if peel is not None:
        peeled = peel.defines | {"GLS_TRANSMISSION_MAP": int(gpu.transmission is not None)}
        program = programs.get("pass/surface.vert", "pass/surface.frag", defines=defines | peeled)
        program.bind(**peel.textures)
        return program
    if rays is None:
        return programs.get("pass/surface.vert", "pass/surface.frag", defines=defines)
    program = programs.get(
        "pass/surface.vert", "pass/surface.frag", rays.dialect, None, defines | rays.defines, "pass/surface.geom"
    )
    program.set(**rays.uniforms)
    program.bind(**rays.textures)
    return program


def set_transparency(program: Program, gpu: GpuMesh, material: Material) -> None:
    """Uniforms of lib/peel.glsl for a material."""
    program.set(u_least_alpha=float(material.alpha_mode is not AlphaMode.BLEND), u_transmission=material.transmission)
    if gpu.transmission is not None:
        program.bind(u_transmission_map=gpu.transmission)


def nothing_in_view(scene: Scene, camera_view: CameraView) -> str:
    """The warning for an image without any surface."""
    low, high = ("(" + ", ".join(f"{x:.6g}" for x in point) + ")" for point in scene.bounds)
    return (
        f"nothing is in view: {scene.name} lies between {low} and {high}, and the camera {camera_view.camera}, "
        f"near {camera_view.near:g}, far {camera_view.far:g}"
    )
