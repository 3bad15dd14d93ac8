"""The camera pass: which triangle is seen at each pixel, and how far away."""

from __future__ import annotations

from dataclasses import dataclass

import moderngl
import numpy as np
from numpy.typing import NDArray

from glshadow.core.cameras import PerspectiveCamera
from glshadow.core.fit import frustum_of, visible_corners
from glshadow.core.spaces import Array, ClipSpace, perspective
from glshadow.core.view import ShadowView
from glshadow.gl.caster import seen_by
from glshadow.gl.context import GLContext
from glshadow.gl.geometry import GpuScene, pack_matrices
from glshadow.gl.meshes import GpuMesh
from glshadow.gl.program import Program, Programs
from glshadow.gl.targets import CameraTargets
from glshadow.scene.mesh import Scene

NEAREST_SHARE = 1e-5  # of far: how close a derived near plane comes


@dataclass(frozen=True, eq=False)
class Sight:
    """What a camera at one size sees of a scene: everything that does not depend on the light.

    Parameters
    ----------
    near, far : float
        Depth range, as given or derived.
    receivers : list of (M, 3) float64
        Per node the corners of what is seen of its box.
    drawn : (K,) int64
        Nodes that may be in the picture.
    clip_from_mesh : list of bytes
        Per node, float32.
    outside : (N,) bool
        Whether a node's box is wholly beyond the near plane, so that no back face of it is seen if it is closed.
    """

    camera: PerspectiveCamera
    size: tuple[int, int]
    near: float
    far: float
    clip: ClipSpace
    clip_from_view: Array
    receivers: list[Array]
    drawn: NDArray[np.int64]
    clip_from_mesh: list[bytes]
    outside: NDArray[np.bool_]

    @property
    def far_z(self) -> float:
        """NDC z of the far plane."""
        return (0.0 if self.clip.zero_to_one else -1.0) if self.clip.reversed else 1.0

    @property
    def rays(self) -> Array:
        """(3, 3) ray of unit view depth = rays @ (NDC x, NDC y, 1), in view axes."""
        left, right, bottom, top = self.camera.window(self.size)
        x, y = 0.5 * (right - left), 0.5 * (top - bottom)
        return np.array([[x, 0.0, left + x], [0.0, y, bottom + y], [0.0, 0.0, -1.0]])

    @property
    def unproject(self) -> tuple[float, float]:
        """(x, y) with 1 / view depth = x + y * window depth, exact in every clip convention."""
        matrix = self.clip_from_view
        low, span = (
            (0.0, 1.0) if self.clip.zero_to_one else (-1.0, 2.0)
        )  # ndc = low + span * window = -m22 + m23 / depth
        return (low + matrix[2, 2]) / matrix[2, 3], span / matrix[2, 3]


def look(scene: Scene, gpu: GpuScene, camera: PerspectiveCamera, size: tuple[int, int], clip_control: bool) -> Sight:
    """Decide a camera's depth range and what it sees. Reversed 0..1 depth where the driver can, -1..1 elsewhere."""
    near, far = _depth_range(scene, camera)
    clip = ClipSpace(True, True) if clip_control else ClipSpace(False, False)
    window, view = camera.window(size), camera.view_from_world
    frustum = ShadowView("spot", 0, view, window, near, far, clip, 1)
    corners = scene.corners
    depth = -(corners @ view[2, :3] + view[2, 3])
    return Sight(
        camera, size, near, far, clip, perspective(*window, near, far, clip),
        receivers=visible_corners(*scene.boxes, frustum_of(window, near, far, view)),
        drawn=np.flatnonzero(seen_by(frustum.clip_from_world, corners, frustum) & ~gpu.copies),
        clip_from_mesh=pack_matrices(frustum.clip_from_world @ gpu.world_from_origin),
        outside=depth.min(axis=1) > near,
    )  # fmt: skip


def _depth_range(scene: Scene, camera: PerspectiveCamera) -> tuple[float, float]:
    """What it was given, else what the scene's boxes need."""
    row = camera.view_from_world[2]
    depth = -(scene.corners.reshape(-1, 3) @ row[:3] + row[3])
    far = camera.far if camera.far is not None else 1.001 * float(depth.max())
    if far <= 0.0 or (camera.near is not None and far <= camera.near):
        far = 2.0 * (camera.near or 1.0)
    near = camera.near if camera.near is not None else max(0.999 * float(depth.min()), NEAREST_SHARE * far)
    return min(near, 0.999 * far), far


def draw_surface(context: GLContext, programs: Programs, scene: GpuScene, sight: Sight, targets: CameraTargets) -> None:
    """Draw the triangle's number, and what else the scene needs, into the surface buffer, with depth."""
    ctx = context.ctx
    if context.caps.clip_control:
        context.gl.clip_control(sight.clip.zero_to_one)
    targets.surface_framebuffer.use()
    ctx.depth_func = ">" if sight.clip.reversed else "<"  # an equal depth would be that of "nothing there"
    ctx.enable_only(moderngl.DEPTH_TEST)
    targets.surface_framebuffer.clear(depth=sight.clip.clear_depth)
    culled: str | None = None
    outside = sight.outside.tolist()
    previous, program, array = None, None, None
    for i in sorted(sight.drawn.tolist(), key=scene.mesh_number.__getitem__):  # instances one after another
        gpu = scene.meshes[i]
        if gpu is not previous:
            previous, material = gpu, scene.nodes[i].mesh.material
            program = _program(programs, scene, gpu)
            program.set(u_color=material.color, u_cutoff=gpu.cutoff)
            array = gpu.vertex_array(program, numbered=True)
            if gpu.texture is not None:
                gpu.texture.use(0)
        assert program is not None
        assert array is not None
        program.write("u_clip_from_mesh", sight.clip_from_mesh[i])
        program.write("u_first_triangle", scene.packed_first[i])
        if gpu.smooth:
            program.write("u_normal_from_mesh", scene.packed_normals[i])
        # nobody outside a closed mesh sees its back faces
        cull = ("front" if scene.mirrored[i] else "back") if gpu.closed and outside[i] else None
        if cull != culled:
            culled = cull
            ctx.enable(moderngl.CULL_FACE) if cull else ctx.disable(moderngl.CULL_FACE)
            ctx.cull_face = cull or "back"
        array.render()
    ctx.enable_only(moderngl.DEPTH_TEST)


def _program(programs: Programs, scene: GpuScene, gpu: GpuMesh) -> Program:
    return programs.get(
        "pass/surface.vert",
        "pass/surface.frag",
        defines={
            "GLS_SURFACE": 4 if scene.textured else 2 if scene.smooth else 1,
            "GLS_SMOOTH": int(gpu.smooth),
            "GLS_TEXTURED": int(gpu.textured),
            "GLS_COLORED": int(gpu.colored),
            "GLS_ALPHA": int(gpu.cut_out),
        },
    )
