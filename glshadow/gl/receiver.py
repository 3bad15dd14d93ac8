"""Asks a light's shadow map from every visible surface, and adds the light that arrives to the image."""

from __future__ import annotations

from collections.abc import Sequence

import moderngl
import numpy as np

from glshadow.core.bias import ClipBias, ConstantBias, NormalOffsetBias, ReceiverPlaneBias, bias_factor
from glshadow.core.kernels import Hard
from glshadow.core.lights import DirectionalLight, Light, PointLight, SpotLight
from glshadow.core.metric import Target, metric_range
from glshadow.core.spaces import Array, bias_matrix, rigid_inverse, view_axes
from glshadow.core.view import ShadowView
from glshadow.gl.caster import Map
from glshadow.gl.context import Caps, GLContext
from glshadow.gl.program import UNITS, Program

# A curved surface is a fan of planes: its neighbouring facets, which the filter also reads, rise above the receiver's own. One degree
# is allowed for, the angle between facets of a finely tessellated body (a sphere of 360 segments): a 1/57 of a texel at contact.
_FACET_SLOPE = float(np.tan(np.radians(1.0)))

# A receiver's position is a sum of products in float32: ray x depth, the eye added, back on the plane, into the light's view, and
# the caster's vertex takes a matrix product of its own. 16 roundings of relative size 2^-24 bound the sum.
_ROUNDINGS = 16.0


def receiver_slots(light: Light, shadow_map: Map | None, caps: Caps) -> dict[str, str]:
    """Snippets of the receiver contract for a light; None: it casts nothing."""
    sun = isinstance(light, DirectionalLight)
    slots = {"light": "light/sun.glsl" if sun else "light/local.glsl"}
    if shadow_map is None:
        return {**slots, "shadow": "receiver/open.glsl"}
    target, bias = shadow_map.settings.target, shadow_map.settings.bias
    kind = shadow_map.views[0].kind
    projection = {"directional": "orthographic", "spot": "perspective", "point": "cube"}[kind]
    depth = "affine" if target.is_depth else {"directional": "affine", "spot": "linear", "point": "radial"}[kind]
    moved = {ConstantBias: "constant", NormalOffsetBias: "normal_offset"}.get(type(bias), "none")
    if not target.is_depth:
        compare = "metric"
    elif caps.texture_gather:
        compare = "depth_gather_raw" if caps.software else "depth_gather"
    else:
        compare = "depth_taps"
    return {
        **slots,
        "shadow": "receiver/mapped.glsl",
        "projection": f"projection/{projection}.glsl",
        "depth": f"depth/{depth}.glsl",
        "bias": f"bias/{moved}.glsl",
        "compare": f"compare/{compare}.glsl",
        "filter": "filter/hard.glsl" if isinstance(shadow_map.filter, Hard) else "filter/pcf.glsl",
    }


def receiver_defines(light: Light, shadow_map: Map | None) -> dict[str, float | str]:
    """Defines of the receiver contract for a light."""
    if shadow_map is None:
        return {}
    return {
        "GLS_SUN": int(isinstance(light, DirectionalLight)),
        "GLS_FOLLOW_PLANE": int(isinstance(shadow_map.settings.bias, ReceiverPlaneBias)),
        "GLS_SLACK_TEXELS": shadow_map.filter.slack_texels,
        "GLS_PCF_RADIUS": shadow_map.filter.radius,
        "GLS_REVERSED": int(shadow_map.views[0].clip.reversed),
        "GLS_BOUNDED": int(
            isinstance(light, SpotLight)
        ),  # a sun's fit holds every receiver, the six faces every direction
        "GLS_PACKED": int(shadow_map.settings.target is Target.RGBA8),
    }


def set_receiver(program: Program, context: GLContext, light: Light, shadow_map: Map, rounding: float) -> None:
    """Uniforms of the receiver contract, and the map bound to texture unit 0.

    Parameters
    ----------
    rounding : float
        World units by which float32 may misplace a receiver along the light; only the derived bias takes notice.
    """
    views, atlas, bias = shadow_map.views, shadow_map.atlas, shadow_map.settings.bias
    view = views[0]
    left, _, bottom, _ = view.window
    texel = np.array(view.texel)
    scale = 1.0 / texel
    corner = np.array(view.tile if view.kind != "point" else (0, 0), dtype=np.float64)
    offset = corner - np.array([left, bottom]) * scale
    tiles = np.zeros((6, 2))
    for each in views:
        tiles[each.face] = each.tile
    last = corner + view.resolution
    if view.kind == "point":  # the axis decides the face, so nothing lies outside
        corner, last = np.full(2, -1e9), np.full(2, 1e9)
    program.set(
        u_texel_from_lv=(*scale, *offset),
        u_lv_from_texel=tuple(texel),
        u_tile=(*corner, *last),
        u_map_texel=(1.0 / atlas.size[0], 1.0 / atlas.size[1]),
        u_depth=_depth_uniform(view, shadow_map),
        u_allowance=_allowance(view, shadow_map, rounding),
    )
    program.write("u_face_tile", tiles.astype(np.float32).tobytes())
    if isinstance(bias, ConstantBias):
        program.set(u_bias=bias.world)
    elif isinstance(bias, NormalOffsetBias):
        program.set(u_bias=bias.texels * float(texel.max()))
    atlas.texture.use(UNITS["u_map"])


def _allowance(view: ShadowView, shadow_map: Map, rounding: float) -> tuple[float, float]:
    """World units, and share of the distance, that the derived bias takes off a receiver's distance; (0, 0) for other biases."""
    if not isinstance(shadow_map.settings.bias, ReceiverPlaneBias):
        return 0.0, 0.0
    facet = _FACET_SLOPE * shadow_map.filter.reach_texels * max(view.texel)
    return (rounding + facet, 0.0) if view.kind == "directional" else (rounding, facet)


def _depth_uniform(view: ShadowView, shadow_map: Map) -> tuple[float, float, float, float]:
    target, bias = shadow_map.settings.target, shadow_map.settings.bias
    quantum = target.quantum if isinstance(bias, ReceiverPlaneBias) else 0.0
    if target is Target.DEPTH32F and view.clip.reversed:
        quantum = 0.0  # reversed floats round relative to 1 / depth: part of what `rounding` allows for
    shift = bias.clip if isinstance(bias, ClipBias) and not bias.caster else 0.0
    if target.is_depth:
        x, y = _window_depth_line(view)
        nearer = -view.clip.sign
        slack = quantum + shift * bias_factor(view.clip) / _span(view)
        return (x, y, nearer * abs(y), nearer * slack)
    low, high = metric_range(view.kind, view.clip, view.near, view.far)
    sign = view.clip.sign
    slack = quantum + shift
    if view.kind == "point":
        return (low / (low + high), 1.0 / (low + high), view.texel[0], -slack)
    matrix = view.clip_from_view
    y, x = -sign * matrix[2, 2] / (low + high), (sign * matrix[2, 3] + low) / (low + high)
    return (x, y, -abs(y), -slack)


def _span(view: ShadowView) -> float:
    """Window depth is NDC z itself, or half of it: what a bias in clip units becomes after the bias matrix."""
    return 1.0 if view.clip.zero_to_one else 2.0


def _window_depth_line(view: ShadowView) -> tuple[float, float]:
    """(x, y) with window depth = x + y * d, d the distance along a sun's view or 1 / depth of a lamp's."""
    matrix = bias_matrix(view.clip) @ view.clip_from_view
    if view.kind == "directional":
        return matrix[2, 3], -matrix[2, 2]
    return -matrix[2, 2], matrix[2, 3]


def set_light(program: Program, light: Light) -> None:
    """Uniforms of the shading: radiance, cone, range and falloff."""
    program.set(u_radiance=tuple(c * light.intensity for c in light.color))
    if isinstance(light, DirectionalLight):
        return
    program.set(u_reach=(0.0 if light.range is None else 1.0 / light.range, light.falloff))
    if isinstance(light, SpotLight):
        inner, outer = np.cos(np.radians([light.inner_angle, light.outer_angle]))
        width = max(inner - outer, 1e-6)
        program.set(u_cone=(1.0 / width, -outer / width))
    else:
        program.set(u_cone=(0.0, 1.0))


def rounding_of(reach: float) -> float:
    """World units by which float32 may misplace a receiver, its coordinates in every frame on its way below `reach`."""
    return _ROUNDINGS * 2.0**-24 * reach


def light_view(light: Light, views: Sequence[ShadowView], origin: Array | None = None) -> Array:
    """(4, 4) lv_from_world: the frame in which a light's receivers are given.

    Parameters
    ----------
    views : sequence of ShadowView
        Of the light's map; empty: it has none, and a sun's frame begins at `origin`.
    """
    if isinstance(light, PointLight):  # one frame for all faces: world axes
        return rigid_inverse(np.eye(3), np.asarray(light.position))
    if views:
        return views[0].view_from_world
    place = light.position if isinstance(light, SpotLight) else origin if origin is not None else np.zeros(3)
    return rigid_inverse(view_axes(np.asarray(light.direction)), np.asarray(place))


def comparison_sampler(ctx: moderngl.Context, reversed_depth: bool) -> moderngl.Sampler:
    """1 where the reference is not farther than the nearest texel's depth; edges repeated outwards."""
    sampler = ctx.sampler(compare_func=">=" if reversed_depth else "<=", repeat_x=False, repeat_y=False)
    sampler.filter = (moderngl.NEAREST, moderngl.NEAREST)
    return sampler
