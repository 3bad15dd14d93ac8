"""The resolve pass: one light on every visible surface, added to the picture."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import moderngl
import numpy as np

from glshadow.core.lights import DirectionalLight, Light
from glshadow.core.lists import distance_bound
from glshadow.core.spaces import Array
from glshadow.gl.camera import Sight
from glshadow.gl.caster import Map
from glshadow.gl.context import GLContext
from glshadow.gl.geometry import GpuScene
from glshadow.gl.lists import Lists, light_frame
from glshadow.gl.numbers import Numbers
from glshadow.gl.program import UNITS, Program, Programs
from glshadow.gl.receiver import (
    Asked,
    Given,
    comparison_sampler,
    light_uniforms,
    light_view,
    receiver_defines,
    receiver_dialect,
    receiver_slots,
    receiver_uniforms,
    rounding_of,
)
from glshadow.gl.targets import CameraTargets


@dataclass(frozen=True)
class Samplers:
    """How maps are read: nearest comparison, normal and reversed, and plain numbers."""

    nearer: moderngl.Sampler
    nearer_reversed: moderngl.Sampler
    plain: moderngl.Sampler

    @classmethod
    def make(cls, ctx: moderngl.Context) -> Samplers:
        """Nearest texel, edges repeated outwards."""
        plain = ctx.sampler(repeat_x=False, repeat_y=False)
        plain.filter = (moderngl.NEAREST, moderngl.NEAREST)
        return cls(comparison_sampler(ctx, False), comparison_sampler(ctx, True), plain)

    def release(self) -> None:
        """Delete them."""
        for sampler in (self.nearer, self.nearer_reversed, self.plain):
            sampler.release()


@dataclass(frozen=True)
class Share:
    """One light's part of a picture.

    Parameters
    ----------
    light : Light or None
        None: no light at all, only the ambient term.
    number, count : int
        Which light this is, of how many: the first adds the ambient term, the last writes the display image.
    ambient : (3,) float64
        Linear.
    """

    light: Light | None
    shadow: Asked
    number: int
    count: int
    ambient: Array


def resolve(
    context: GLContext,
    programs: Programs,
    samplers: Samplers,
    scene: GpuScene,
    sight: Sight,
    targets: CameraTargets,
    share: Share,
) -> None:
    """Add a light to the picture."""
    ctx = context.ctx
    first, last = share.number == 0, share.number >= share.count - 1
    light = share.light or DirectionalLight()
    program = programs.get(
        "pass/resolve.vert",
        "pass/resolve.frag",
        dialect=receiver_dialect(share.shadow, context.caps),
        slots=receiver_slots(light, share.shadow, context.caps),
        defines={
            **receiver_defines(light, share.shadow),
            "GLS_ORTHO": int(not sight.camera.is_perspective),
            "GLS_SUN": int(isinstance(light, DirectionalLight)),
            "GLS_SURFACE": targets.surface.components,
            "GLS_COLORS": 2 if scene.textured else 0 if scene.color is not None else 1,
            "GLS_FIRST": int(first),
            "GLS_LAST": int(last),
            "GLS_SELECTIVE": int(scene.selective),
            "GLS_LIT": int(share.light is not None),
            "GLS_WEAK": int(light.shadow is not None and light.shadow.strength < 1.0),
            "GLS_VISIBILITY": int(bool(targets.visibility)),
            "GLS_SUM": int(last and targets.linear is not None),
        },
    )
    _set(program, scene, sight, light, share)
    _bind(program, context, samplers, scene, targets, share.shadow)
    if not first:
        targets.sums[(share.number - 1) % 2].use(UNITS["u_sum"])
    targets.framebuffer(targets.image if last else targets.sums[share.number % 2], share.number).use()
    draw_over(context, program, sight)
    ctx.clear_samplers(0, max(UNITS.values()) + 1)


def _set(program: Program, scene: GpuScene, sight: Sight, light: Light, share: Share) -> None:
    program.set(**place_uniforms(scene, sight, light, share.shadow))
    program.set(**light_uniforms(light))
    color = np.ones(3) if scene.color is None else np.asarray(scene.color)
    radiance = np.minimum(color * np.asarray(light.color) * light.intensity, 1e18)  # its square root is still a float32
    program.set(u_ambient=tuple(np.minimum(share.ambient * color, 1e18)), u_radiance=tuple(radiance))
    program.set(u_strength=light.shadow.strength if light.shadow else 1.0)


def place_uniforms(scene: GpuScene, sight: Sight, light: Light, shadow: Asked) -> dict[str, Any]:
    """Uniforms of pass/resolve.vert that say where camera and light are, and those that ask what the light's shadow is made of."""
    camera = sight.camera
    eye = sight.eye - scene.origin
    axes, offset = _light_frame(scene, light, shadow)
    eye_l = axes @ eye
    values = {
        "u_far_z": sight.far_z,
        "u_unproject": sight.unproject,
        "u_ray_l": axes @ camera.view_from_world[:3, :3].T @ sight.rays,
        "u_eye_l": tuple(eye_l),
        "u_forward_l": tuple(-axes @ camera.view_from_world[2, :3]),
        "u_lv_from_l": tuple(offset),
        "u_axes_l": axes,
        "u_towards_w": tuple(axes[2]),
    }
    if isinstance(shadow, Lists | Numbers):
        local = (scene.corners.reshape(-1, 3) - scene.origin) @ axes.T + offset
        reach = max(float(np.abs(local).max()), float(np.abs(eye_l + offset).max()) + sight.spread)
        bound = distance_bound(scene.world.reach, reach)
        return values | {"u_eye_l": tuple(eye_l + offset), "u_cells": shadow.grid.cells_from_window, "u_bound": bound}
    if isinstance(shadow, Map):
        reach = max(float(np.abs(eye).max()) + sight.reach, float(np.abs(offset).max()))
        values |= receiver_uniforms(light, shadow, rounding_of(reach))
    return values


def _light_frame(scene: GpuScene, light: Light, shadow: Asked) -> tuple[Array, Array]:
    """Axes (3, 3) of the frame in which a light's receivers are given, and where the scene's origin lies in it."""
    if isinstance(shadow, Lists | Numbers):
        axes, origin = light_frame(shadow.grid, scene)
        return axes, -axes @ origin
    lv_from_world = light_view(light, shadow.views if isinstance(shadow, Map) else (), scene.origin)
    axes = lv_from_world[:3, :3]
    return axes, lv_from_world[:3, 3] + axes @ scene.origin


def _bind(
    program: Program,
    context: GLContext,
    samplers: Samplers,
    scene: GpuScene,
    targets: CameraTargets,
    shadow: Asked,
) -> None:
    bind_surface(samplers, scene, targets)
    if "u_colors" in program:
        scene.owners.use(UNITS["u_owners"])
        scene.colors.use(UNITS["u_colors"])
    if isinstance(shadow, Lists | Numbers):
        bind_candidates(scene, shadow)
    elif isinstance(shadow, Given):
        shadow.visibility.use(UNITS["u_given"])
        shadow.points.use(UNITS["u_points"])
    elif shadow is not None:
        shadow.atlas.texture.use(UNITS["u_map"])
        if shadow.settings.target.is_depth:
            raw = context.caps.texture_gather and context.caps.software
            compared = samplers.nearer_reversed if shadow.views[0].clip.reversed else samplers.nearer
            (samplers.plain if raw else compared).use(UNITS["u_map"])


def bind_surface(samplers: Samplers, scene: GpuScene, targets: CameraTargets) -> None:
    """What the camera sees, to its texture units."""
    targets.surface.use(UNITS["u_surface"])
    targets.depth.use(UNITS["u_camera_depth"])
    samplers.plain.use(UNITS["u_camera_depth"])
    scene.planes.use(UNITS["u_planes"])


def bind_candidates(scene: GpuScene, shadow: Lists | Numbers) -> None:
    """What exact filters ask, to its texture units."""
    shadow.use(UNITS["u_heads"], UNITS["u_links"], UNITS["u_facets"])
    if scene.world.masks is not None and scene.world.alphas is not None:
        scene.world.masks.use(UNITS["u_masks"])
        scene.world.alphas.use(UNITS["u_alphas"])


def draw_over(context: GLContext, program: Program, sight: Sight) -> None:
    """A pass over all pixels that see a surface: one triangle at the far plane, the camera's depth attached."""
    if context.caps.clip_control:
        context.gl.clip_control(sight.clip.zero_to_one)
    context.ctx.enable_only(moderngl.DEPTH_TEST)
    context.ctx.depth_func = "<" if sight.clip.reversed else ">"
    program.vertex_array().render(moderngl.TRIANGLES, vertices=3)
