"""Draws points and lines as balls and tubes: into the surface buffer, and into the maps of lights."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshadow.core.spaces import Array
from glshadow.derive.resolved import CasterSettings
from glshadow.errors import SettingsError
from glshadow.gl.driver.context import GLContext
from glshadow.gl.driver.program import Program, Programs
from glshadow.gl.driver.targets import SurfaceTargets
from glshadow.gl.frame_context import FrameContext
from glshadow.gl.scene.capsules import GpuCapsules
from glshadow.gl.scene.geometry import TRIANGLES, GpuScene
from glshadow.gl.scene.runs import Generated
from glshadow.shader.slots import metric_slot
from glshadow.shadows.metric import Target
from glshadow.shadows.view import ShadowView

_MARGIN = 1.0 / 32.0  # pixels; pass/capsule.vert


@dataclass(frozen=True, eq=False)
class CapsuleView:
    """A camera or a light as lib/capsule_view.glsl describes it.

    Parameters
    ----------
    axes : (3, 3) float64
        Right, up, forward.
    eye : (3,) float64
        Relative to the scene's origin.
    window : (4,) floats
        Half width and height, middle.
    depths : (2,) floats
        Window depth is their first plus the second over depth (of a parallel view: times depth).
    near : float
        Nearer surfaces are not seen.
    parallel : bool
    """

    axes: Array
    eye: Array
    window: tuple[float, float, float, float]
    depths: tuple[float, float]
    near: float
    parallel: bool

    def uniforms(self, size: tuple[int, int], corner: tuple[int, int] = (0, 0)) -> dict[str, Any]:
        """Uniforms for a target, or a tile of one, with this many pixels from this corner on."""
        return {
            "u_view": self.axes,
            "u_eye": tuple(self.eye),
            "u_eye_rest": tuple(self.eye - self.eye.astype(np.float32)),
            "u_window": self.window,
            "u_depths": self.depths,
            "u_near": self.near,
            "u_half_size": (0.5 * size[0], 0.5 * size[1]),
            "u_corner": tuple(map(float, corner)),
            "u_margin": (2.0 * _MARGIN / size[0], 2.0 * _MARGIN / size[1]),
        }


def capsule_view(view: ShadowView, near: float, origin: Array) -> CapsuleView:
    """A view relative to the scene's origin; surfaces nearer than `near` are not seen."""
    axes = view.view_from_world[:3, :3] * np.array([[1.0], [1.0], [-1.0]])
    left, right, bottom, top = view.window
    matrix, parallel = view.clip_from_view, view.projection == "orthographic"
    # NDC z = m22 (-depth) + m23, or -m22 + m23 / depth
    low, slope = (matrix[2, 3], -matrix[2, 2]) if parallel else (-matrix[2, 2], matrix[2, 3])
    if not view.clip.zero_to_one:
        low, slope = 0.5 * low + 0.5, 0.5 * slope
    return CapsuleView(
        axes, -view.view_from_world[:3, :3].T @ view.view_from_world[:3, 3] - origin,
        (0.5 * (right - left), 0.5 * (top - bottom), 0.5 * (left + right), 0.5 * (bottom + top)),
        (float(low), float(slope)), near, parallel,
    )  # fmt: skip


def draw_capsules(frame: FrameContext, targets: SurfaceTargets) -> None:
    """Draw the points and lines that a camera sees into its surface buffer; framebuffer and depth test are set."""
    scene, camera_view = frame.scene, frame.camera_view
    chosen = camera_view.drawn[scene.round[camera_view.drawn]]
    if len(chosen) == 0:
        return
    parallel = not camera_view.camera.is_perspective
    seen = capsule_view(camera_view.view, camera_view.near, scene.origin)
    size = targets.surface.size
    channels = scene.channels
    for node in chosen.tolist():
        gpu = scene.meshes[node]
        assert isinstance(gpu, GpuCapsules)
        colored = int(gpu.colored and channels == 4)
        program = frame.programs.get(
            "pass/capsule.vert", "pass/capsule.frag", slots={"metric": metric_slot("orthographic")},
            defines={"GLS_CAPSULES": 1 + int(gpu.tubes), "GLS_ORTHO": int(parallel), "GLS_SURFACE": channels, "GLS_COLORED": colored,
                     "GLS_EMITS": int(scene.features.emits)},
        )  # fmt: skip
        program.set(**seen.uniforms(size), u_color=scene.nodes[node].mesh.material.color)
        if colored:
            program.bind(u_vertex_colors=gpu.vertex_colors)
        _draw(frame.context, program, scene, node)


def draw_capsule_casters(
    context: GLContext, programs: Programs, scene: GpuScene, nodes: NDArray[np.int64], view: ShadowView, settings: CasterSettings,
    metric: tuple[float, float, float],
) -> int:  # fmt: skip
    """Draw points and lines into a light's tile, whose state is set; returns the number of draws."""
    if len(nodes) == 0:
        return 0
    _check(view, settings)
    target = settings.target
    # casters before the near plane are clamped to it
    seen = capsule_view(view, -np.inf if view.projection == "orthographic" else 0.0, scene.origin)
    for node in nodes.tolist():
        gpu = scene.meshes[node]
        assert isinstance(gpu, GpuCapsules)
        program = programs.get(
            "pass/capsule.vert", "pass/capsule.frag", slots={"metric": metric_slot(view.projection)},
            defines={"GLS_CAPSULES": 1 + int(gpu.tubes), "GLS_ORTHO": int(seen.parallel), "GLS_CASTS": 1,
                     "GLS_METRIC": int(not target.is_depth), "GLS_PACKED": int(target is Target.RGBA8)},
        )  # fmt: skip
        program.set(**seen.uniforms((view.resolution, view.resolution), view.tile))
        if not target.is_depth:
            program.set(u_metric=metric, u_clip_from_view=view.clip_from_view)
        _draw(context, program, scene, node)
    return len(nodes)


def _check(view: ShadowView, settings: CasterSettings) -> None:
    """Refuse what fragment shaders that write depth cannot do."""
    why = ""
    if settings.bias.polygon_offset != (0.0, 0.0) or settings.bias.of_caster is not None:
        why = f"{settings.bias!r} moves casters"
    elif settings.channel is not None:
        why = "PackedShadow"
    elif settings.faces is not None:
        why = f"faces {settings.faces.value}"
    elif view.warp is not None:
        why = "a fit with perspective"
    if why:
        raise SettingsError(
            f"{why}: not available for points and lines; use the default, another bias or fit, or Exact()"
        )


def _draw(context: GLContext, program: Program, scene: GpuScene, node: int) -> None:
    world = scene.world
    program.bind(**world.textures)
    gpu = scene.meshes[node]
    assert isinstance(gpu, GpuCapsules)
    first, count, corners = int(scene.first[node]), gpu.count, 6 if gpu.tubes else 3  # pass/capsule.vert
    program.set(u_marks=int(scene.packed_first[node, 0]) & ~TRIANGLES, u_first_vertex=int(world.first_vertex[node]))
    draw = Generated(context, scene.count, corners)
    draw(program.vertex_array(), count, lambda start: program.set(u_first=first + start))
