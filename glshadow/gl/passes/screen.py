"""Full-screen passes: camera uniforms, surface textures, samplers, and the draw call."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass
from typing import Any

import moderngl
import numpy as np

from glshadow.core.spaces import Array
from glshadow.gl.driver.context import GLContext
from glshadow.gl.driver.entry_points import BLEND
from glshadow.gl.driver.program import Program
from glshadow.gl.driver.targets import CameraTargets
from glshadow.gl.passes.camera import CameraView
from glshadow.gl.scene.geometry import GpuScene


@dataclass(frozen=True)
class Samplers:
    """Sampler objects for shadow maps: nearest with comparison, normal and reversed, and nearest without."""

    nearer: moderngl.Sampler
    nearer_reversed: moderngl.Sampler
    plain: moderngl.Sampler

    @classmethod
    def make(cls, ctx: moderngl.Context) -> Samplers:
        """Nearest texel, clamped to the edge."""
        plain = ctx.sampler(repeat_x=False, repeat_y=False)
        plain.filter = (moderngl.NEAREST, moderngl.NEAREST)
        return cls(comparison_sampler(ctx, False), comparison_sampler(ctx, True), plain)

    def release(self) -> None:
        """Delete them."""
        for sampler in (self.nearer, self.nearer_reversed, self.plain):
            sampler.release()


def comparison_sampler(ctx: moderngl.Context, reversed_depth: bool) -> moderngl.Sampler:
    """Comparison sampler: 1 where the reference is not farther than the nearest texel's depth; clamped to the edge."""
    sampler = ctx.sampler(compare_func=">=" if reversed_depth else "<=", repeat_x=False, repeat_y=False)
    sampler.filter = (moderngl.NEAREST, moderngl.NEAREST)
    return sampler


def camera_uniforms(
    scene: GpuScene, camera_view: CameraView, axes: Array, offset: Array, aside: tuple[float, float] = (0.0, 0.0)
) -> dict[str, Any]:
    """Uniforms of pass/resolve.vert for a camera in a light's frame.

    Parameters
    ----------
    axes : (3, 3) float64
        Of the frame.
    offset : (3,) float64
        Position of the scene's origin in the frame.
    aside : (2,) floats
        Offset of the rays from the pixel's centre, right and up, in pixels.
    """
    camera = camera_view.camera
    rays = camera_view.rays
    rays[:, 2] += rays[:, :2] @ (2.0 * np.array(aside) / camera_view.size)
    eye = camera_view.eye - scene.origin
    return {
        "u_far_z": camera_view.far_z,
        "u_unproject": camera_view.unproject,
        "u_ray_l": axes @ camera.view_from_world[:3, :3].T @ rays,
        "u_eye_l": tuple(axes @ eye),
        "u_forward_l": tuple(-axes @ camera.view_from_world[2, :3]),
        "u_lv_from_l": tuple(offset),
        "u_axes_l": axes,
        "u_towards_w": tuple(axes[2]),
    }


def pixel_axes(camera: Mapping[str, Any], size: tuple[int, int]) -> dict[str, Any]:
    """Change of rays, or of an orthographic camera's ray starts, from pixel to pixel; `camera` are its `camera_uniforms`."""
    right, up = (2.0 / side * axis for side, axis in zip(size, camera["u_ray_l"].T[:2], strict=True))
    return {"u_right_l": tuple(right), "u_up_l": tuple(up)}


def surface_textures(samplers: Samplers, scene: GpuScene, targets: CameraTargets) -> dict[str, Any]:
    """Textures of the surface buffer, by sampler name."""
    return {
        "u_surface": targets.surface,
        **({} if targets.mixed is None else {"u_mixed": targets.mixed}),
        "u_camera_depth": (targets.depth, samplers.plain),
        "u_planes": lambda: scene.planes,
        "u_owners": lambda: scene.owners,
        "u_colors": scene.colors,
        **({"u_albedo": lambda: scene.albedo} if scene.features.glossy else {}),
        **({} if targets.emission is None else {"u_emission": targets.emission}),
        **({"u_smooth": scene.rounded} if scene.rounded is not None else {}),
        **targets.given,
    }


def draw_over(
    context: GLContext, program: Program, camera_view: CameraView, added: int = 0, multiplied: bool = False
) -> None:
    """Draw a pass over all pixels with a surface: one triangle at the far plane, against the camera's depth.

    `added`: colours to blend; `multiplied`: colour 0 is.
    """
    if context.caps.clip_control:
        context.gl.clip_control(camera_view.clip.zero_to_one)
    context.ctx.enable_only(moderngl.DEPTH_TEST)
    context.ctx.depth_func = "<" if camera_view.clip.reversed else ">"
    with blended(context, added or 1, multiplied) if added or multiplied else nullcontext():
        program.vertex_array().render(moderngl.TRIANGLES, vertices=3)


@contextmanager
def blended(context: GLContext, colors: int = 1, multiplied: bool = False) -> Iterator[None]:
    """Additive blending of the first colours inside the block; or multiplication with them."""
    context.ctx.blend_func = (moderngl.ZERO, moderngl.SRC_COLOR) if multiplied else (moderngl.ONE, moderngl.ONE)
    for number in range(colors):
        context.gl.call("glEnablei", BLEND, number)
    try:
        yield
    finally:
        for number in range(colors):
            context.gl.call("glDisablei", BLEND, number)
