"""Forward rendering with a light's shadow map: the map, and the GLSL and uniforms that sample it in another program's shader.

::

    context = open_context(context=ctx)
    programs, meshes = Programs(context), Meshes(context)
    views = shadow_views(light, ...)  # or a frame's used[i].views
    shadow_map = draw_map(context, programs, GpuScene(context, meshes, scene), light, views)
    program = ctx.program(MY_VERTEX_SHADER, receiver_source(context, light, shadow_map) + MY_DECLARATIONS_AND_MAIN)
    values = receiver_uniforms(light, shadow_map, rounding_of(reach))
    sampler = bind_map(ctx, shadow_map, unit)

MAIN calls light_visibility(position_lv, normal_lv, cosine), its arguments in the frame of `lv_from_world`. The caller
writes those uniforms that the program has, and u_map = unit. glsl/pass/forward.vert and .frag are such a program.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import moderngl
import numpy as np

from glshadow.core.spaces import Array
from glshadow.derive.compare import rounding_of
from glshadow.derive.resolved import resolve_settings
from glshadow.errors import SettingsError
from glshadow.gl.driver.context import Caps, GLContext, open_context
from glshadow.gl.driver.program import Programs
from glshadow.gl.passes.atlases import Atlas, layout
from glshadow.gl.passes.caster import Map, draw_casters
from glshadow.gl.passes.moments import Moments
from glshadow.gl.passes.screen import comparison_sampler
from glshadow.gl.scene.bodies import casters_seen
from glshadow.gl.scene.geometry import GpuScene
from glshadow.gl.scene.kept_meshes import Meshes
from glshadow.gl.techniques.mapped import map_defines, map_slots, uniforms_of
from glshadow.lights import Light
from glshadow.shader.compose import compose
from glshadow.shader.slots import open_slots
from glshadow.shadows.view import ShadowView, shadow_views

# Also the argument types of its functions, which are defined elsewhere.
__all__ = [
    "GLContext", "GpuScene", "Map", "Meshes", "Programs", "bind_map", "draw_map", "lv_from_world", "open_context",
    "receiver_source", "receiver_uniforms", "rounding_of", "shadow_views",
]  # fmt: skip


def draw_map(context: GLContext, programs: Programs, scene: GpuScene, light: Light, views: Sequence[ShadowView]) -> Map:
    """Draw one light's map, in an atlas of its own, with the settings of `light.shadow`.

    Parameters
    ----------
    views : sequence of ShadowView
        What `glshadow.shadows.view.shadow_views` gives, or a frame's `used[i].views`.

    Returns
    -------
    Map
        The caller must release its `atlas`.

    Raises
    ------
    SettingsError
        If the light casts nothing, or there is no view.
    """
    shadow = light.shadow
    if shadow is None or not views:
        raise SettingsError(
            f"a map needs a light with a Shadow and at least one view, got {light!r} and {len(views)} views"
        )
    resolved = shadow.resolved(with_map="a forward pass")
    settings = resolve_settings(light, resolved, context.caps.clip_control, context.caps.renderer)
    placed, size = layout(views, context.caps.max_texture_size)
    shadow_map = Map(placed, Atlas(context, settings.caster.target, size), settings.caster, settings.filter)
    casting = casters_seen(scene, light, None) if settings.caster.bias.certain else scene.casts
    bound = context.ctx.fbo
    draw_casters(context, programs, scene, light, casting, shadow_map)
    if shadow_map.filter.encoding:
        depths = shadow_map.atlas
        shadow_map = Moments(context).filled(programs, shadow_map)
        depths.release()
    if bound is not None:
        bound.use()
    return shadow_map


def receiver_source(context: GLContext, light: Light, shadow_map: Map | None, dialect: str = "core330") -> str:
    """GLSL of `light_arriving` and `light_visibility` (glsl/light, glsl/receiver), `#version` first.

    Parameters
    ----------
    shadow_map : Map or None
        None: the light casts nothing.
    dialect : {"core330", "core330_gather", "es100"}
        GLSL 3.30, the same with textureGather on comparison samplers, or GLSL ES 1.00 (metric targets only).

    Raises
    ------
    SettingsError
        For an unknown dialect, and a depth target in GLSL ES 1.00, which has no comparison sampler.
    """
    if dialect not in ("core330", "core330_gather", "es100"):
        raise SettingsError(f'dialect must be "core330", "core330_gather" or "es100", got {dialect!r}')
    compares = shadow_map is not None and shadow_map.settings.target.is_depth and not shadow_map.filter.encoding
    if shadow_map is not None and compares and dialect == "es100":
        raise SettingsError(
            f"GLSL ES 1.00 cannot compare with target {shadow_map.settings.target.value}: use R32F, R16F, R8 or RGBA8"
        )
    if shadow_map is not None and shadow_map.filter.reads_depths and shadow_map.settings.target.is_depth:
        raise SettingsError(
            f"{shadow_map.filter!r} reads depths, and `bind_map` binds a sampler that only compares: use target R32F, R16F, R8 or RGBA8"
        )
    return receiver_text(context.caps, light, shadow_map, dialect)


def receiver_text(caps: Caps, light: Light, shadow_map: Map | None, dialect: str = "core330") -> str:
    """The same for everything the dialect can express; depth formats use comparison samplers, unless the filter reads depths."""
    caps = replace(caps, texture_gather=dialect == "core330_gather", software=False)
    slots = map_slots(light, shadow_map, caps) if shadow_map else open_slots(light)
    known = compose("pass/include.frag", dialect, slots).declared
    # receivers of another program may lie anywhere
    wanted = {**(map_defines(light, shadow_map) if shadow_map else {}), "GLS_BOUNDED": 1}
    defines = {key: value for key, value in wanted.items() if key in known}
    return compose("pass/include.frag", dialect, slots, defines).code


def lv_from_world(light: Light, shadow_map: Map) -> Array:
    """(4, 4) float64 into the frame that `light_visibility` expects; multiply it with other matrices in float64."""
    return light.frame(shadow_map.views, np.zeros(3))


def receiver_uniforms(light: Light, shadow_map: Map, rounding: float) -> dict[str, Any]:
    """Uniforms of the receiver, see `glshadow.derive.compare.map_uniforms`."""
    return uniforms_of(shadow_map, rounding)


def bind_map(ctx: moderngl.Context, shadow_map: Map, unit: int = 0) -> moderngl.Sampler | None:
    """Bind the map to a texture unit. A depth target also gets its comparison sampler, which is returned for release."""
    shadow_map.atlas.texture.use(unit)
    if shadow_map.filter.encoding or not shadow_map.settings.target.is_depth:
        return None
    sampler = comparison_sampler(ctx, shadow_map.views[0].clip.reversed)
    sampler.use(unit)
    return sampler
