"""The resolve pass: one light on every visible surface, added to the picture."""

from __future__ import annotations

from dataclasses import dataclass

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
from glshadow.gl.program import UNITS, Program, Programs
from glshadow.gl.receiver import (
    comparison_sampler,
    light_uniforms,
    light_view,
    receiver_defines,
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
    shadow: Map | Lists | None
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
        dialect="core330_gather" if context.caps.texture_gather else "core330",
        slots=receiver_slots(light, share.shadow, context.caps),
        defines={
            **receiver_defines(light, share.shadow),
            "GLS_SUN": int(isinstance(light, DirectionalLight)),
            "GLS_SURFACE": targets.surface.components,
            "GLS_COLORS": 2 if scene.textured else 0 if scene.color is not None else 1,
            "GLS_FIRST": int(first),
            "GLS_LAST": int(last),
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
    if context.caps.clip_control:
        context.gl.clip_control(sight.clip.zero_to_one)
    ctx.enable_only(moderngl.DEPTH_TEST)
    ctx.depth_func = "<" if sight.clip.reversed else ">"
    program.vertex_array().render(moderngl.TRIANGLES, vertices=3)
    ctx.clear_samplers(0, max(UNITS.values()) + 1)


def _set(program: Program, scene: GpuScene, sight: Sight, light: Light, share: Share) -> None:
    camera, size = sight.camera, sight.size
    eye = np.asarray(camera.position) - scene.origin
    left, right, bottom, top = camera.window(size)
    x, y = 0.5 * (right - left), 0.5 * (top - bottom)
    rays_v = np.array([[x, 0.0, left + x], [0.0, y, bottom + y], [0.0, 0.0, -1.0]])
    exact = isinstance(share.shadow, Lists)
    if isinstance(share.shadow, Lists):
        axes, origin = light_frame(share.shadow.grid, scene)
        offset = -axes @ origin
    else:
        lv_from_world = light_view(light, share.shadow.views if share.shadow else (), scene.origin)
        axes = lv_from_world[:3, :3]
        offset = lv_from_world[:3, 3] + axes @ scene.origin
    program.set(
        u_far_z=(0.0 if sight.clip.zero_to_one else -1.0) if sight.clip.reversed else 1.0,
        u_unproject=sight.unproject,
        u_ray_l=axes @ camera.view_from_world[:3, :3].T @ rays_v,
        u_eye_l=tuple(axes @ eye + (offset if exact else 0.0)),
        u_forward_l=tuple(-axes @ camera.view_from_world[2, :3]),
        u_lv_from_l=tuple(offset),
        u_axes_l=axes,
        u_towards_w=tuple(axes[2]),
        u_strength=light.shadow.strength if light.shadow else 1.0,
    )
    program.set(**light_uniforms(light))
    color = np.ones(3) if scene.color is None else np.asarray(scene.color)
    radiance = np.minimum(color * np.asarray(light.color) * light.intensity, 1e18)  # its square root is still a float32
    program.set(u_ambient=tuple(share.ambient * color), u_radiance=tuple(radiance))
    if isinstance(share.shadow, Lists):
        local = axes @ (scene.corners.reshape(-1, 3) - scene.origin).T + offset[:, None]
        reach = max(float(np.abs(local).max()), float(np.abs(axes @ eye + offset).max()))
        bound = distance_bound(scene.world.reach, reach)
        program.set(u_cells=share.shadow.grid.cells_from_window, u_bound=bound)
    elif share.shadow is not None:
        ray = float(np.hypot(1.0, np.hypot(max(abs(left), abs(right)), max(abs(bottom), abs(top)))))
        reach = max(float(np.abs(eye).max()) + sight.far * ray, float(np.abs(offset).max()))
        program.set(**receiver_uniforms(light, share.shadow, rounding_of(reach)))


def _bind(
    program: Program,
    context: GLContext,
    samplers: Samplers,
    scene: GpuScene,
    targets: CameraTargets,
    shadow: Map | Lists | None,
) -> None:
    targets.surface.use(UNITS["u_surface"])
    targets.depth.use(UNITS["u_camera_depth"])
    samplers.plain.use(UNITS["u_camera_depth"])
    scene.planes.use(UNITS["u_planes"])
    if "u_colors" in program:
        scene.owners.use(UNITS["u_owners"])
        scene.colors.use(UNITS["u_colors"])
    if shadow is None:
        return
    if isinstance(shadow, Lists):
        shadow.use(UNITS["u_heads"], UNITS["u_links"], UNITS["u_facets"])
        if scene.world.masks is not None and scene.world.alphas is not None:
            scene.world.masks.use(UNITS["u_masks"])
            scene.world.alphas.use(UNITS["u_alphas"])
        return
    shadow.atlas.texture.use(UNITS["u_map"])
    if shadow.settings.target.is_depth:
        raw = context.caps.texture_gather and context.caps.software
        compared = samplers.nearer_reversed if shadow.views[0].clip.reversed else samplers.nearer
        (samplers.plain if raw else compared).use(UNITS["u_map"])
