"""The receiver contract from Python: which snippets, defines and uniforms ask a light's map."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import moderngl
import numpy as np

from glshadow.core.bias import FACET_SLOPE, ClipBias, ConstantBias, NormalOffsetBias, ReceiverPlaneBias, bias_factor
from glshadow.core.lights import DirectionalLight, Light, PointLight, SpotLight
from glshadow.core.lists import RATIO
from glshadow.core.metric import Target, metric_range
from glshadow.core.spaces import Array, bias_matrix, rigid_inverse, view_axes
from glshadow.core.view import ShadowView, kind_of
from glshadow.gl.caster import Map
from glshadow.gl.context import Caps
from glshadow.gl.lists import Lists
from glshadow.gl.numbers import Numbers
from glshadow.shader.slots import (
    BLOCKS,
    Compare,
    exact_defines,
    exact_slots,
    given_slots,
    mapped_defines,
    mapped_slots,
    open_slots,
)

# A receiver's position is a sum of products in float32: ray x depth, the eye added, back on the plane, into the light's view, and
# the caster's vertex takes a matrix product of its own. 16 roundings of relative size 2^-24 bound the sum.
_ROUNDINGS = 16.0


@dataclass(frozen=True)
class Given:
    """A light's visibility, found before.

    Parameters
    ----------
    visibility : moderngl.Texture
        Of each pixel, or -1 - number of a collected one.
    points : moderngl.Texture
        A block for each number.
    samples : int
        Points in a block.
    """

    visibility: moderngl.Texture
    points: moderngl.Texture
    samples: int


Asked = Map | Lists | Numbers | Given | None
"""What a light's shadow is asked of; None: it casts nothing."""


def receiver_slots(light: Light, shadow_map: Asked, caps: Caps) -> dict[str, str]:
    """Snippets of the receiver contract for a light; None: it casts nothing."""
    if shadow_map is None:
        return open_slots(kind_of(light))
    if isinstance(shadow_map, Lists | Numbers):
        return exact_slots(kind_of(light), shadow_map.candidates)
    if isinstance(shadow_map, Given):
        return given_slots(kind_of(light))
    compare: Compare = "depth_taps"
    if not shadow_map.settings.target.is_depth:
        compare = "metric"
    elif caps.texture_gather:
        compare = "depth_gather_raw" if caps.software else "depth_gather"
    settings = shadow_map.settings
    return mapped_slots(kind_of(light), settings.target, settings.bias, shadow_map.filter, compare)


def receiver_dialect(shadow_map: Asked, caps: Caps) -> str:
    """The dialect that a receiver's snippets need."""
    if isinstance(shadow_map, Lists | Numbers):
        return "core400" if caps.version_code >= 400 else "core330"
    return "core330_gather" if caps.texture_gather else "core330"


def receiver_defines(light: Light, shadow_map: Asked) -> dict[str, int | str]:
    """Defines of the receiver contract for a light."""
    if shadow_map is None:
        return {}
    if isinstance(shadow_map, Given):
        columns, rows = BLOCKS[shadow_map.samples]
        return {"GLS_COLUMNS": columns, "GLS_ROWS": rows}
    if isinstance(shadow_map, Lists | Numbers):
        return exact_defines(shadow_map.grid.kind, shadow_map.grid.cells, RATIO, shadow_map.masked)
    settings = shadow_map.settings
    reversed_depth = settings.target.is_depth and shadow_map.views[0].clip.reversed  # a metric always grows away
    return mapped_defines(kind_of(light), settings.target, settings.bias, shadow_map.filter, reversed_depth)


def receiver_uniforms(light: Light, shadow_map: Map, rounding: float) -> dict[str, Any]:
    """Uniforms of the receiver contract.

    Parameters
    ----------
    rounding : float
        World units by which float32 may misplace a receiver along the light, see `rounding_of`; only the derived bias takes notice.

    Returns
    -------
    dict
        Floats, tuples of floats, and for `u_face_tile` float32 bytes.
    """
    views, atlas, bias = shadow_map.views, shadow_map.atlas, shadow_map.settings.bias
    view = views[0]
    left, _, bottom, _ = view.window
    x, y = view.texel
    tile = view.tile if view.kind != "point" else (0, 0)  # a point light's tile is added once its face is known
    tiles = np.zeros((6, 2), dtype=np.float32)
    for each in views:
        tiles[each.face] = each.tile
    allowance = _allowance(view, shadow_map, rounding)
    scale, depth = _depth_uniforms(view, shadow_map, allowance)
    moved = bias.world if isinstance(bias, ConstantBias) else 0.0
    if isinstance(bias, NormalOffsetBias):
        moved = bias.texels * max(x, y)
    return {
        "u_texel_from_lv": (1.0 / x, 1.0 / y, tile[0] - left / x, tile[1] - bottom / y),
        "u_base": (scale, scale * x, scale * y),
        # the axis decides a point light's face, so nothing lies outside
        "u_tile": (-1e9, -1e9, 1e9, 1e9) if view.kind == "point" else (*tile, *(c + view.resolution for c in tile)),
        "u_face_tile": tiles.tobytes(),
        "u_map_texel": (1.0 / atlas.size[0], 1.0 / atlas.size[1]),
        "u_depth": depth,
        "u_allowance": allowance,
        "u_bias": moved,
    }


def _allowance(view: ShadowView, shadow_map: Map, rounding: float) -> tuple[float, float]:
    """World units, and share of the distance, that the derived bias takes off a receiver's distance; (0, 0) for other biases."""
    if not isinstance(shadow_map.settings.bias, ReceiverPlaneBias):
        return 0.0, 0.0
    facet = FACET_SLOPE * shadow_map.filter.reach_texels * max(view.texel)
    return (rounding + facet, 0.0) if view.kind == "directional" else (rounding, facet)


def _depth_uniforms(
    view: ShadowView, shadow_map: Map, allowance: tuple[float, float]
) -> tuple[float, float | tuple[float, float, float]]:
    """Factor of the base, and what turns the base into stored depth, the constant slack taken off: see glsl/depth."""
    target, bias = shadow_map.settings.target, shadow_map.settings.bias
    quantum = target.quantum if isinstance(bias, ReceiverPlaneBias) else 0.0
    if target is Target.DEPTH32F and view.clip.reversed and view.clip.zero_to_one:
        quantum = 0.0  # reversed 0..1 floats round relative to 1 / depth: part of what `rounding` allows for
    shift = bias.clip if isinstance(bias, ClipBias) and not bias.caster else 0.0
    if target.is_depth:
        x, y = _window_depth_line(view)
        x -= view.clip.sign * (quantum + shift * bias_factor(view.clip) / _span(view))
        return y, x - y * allowance[0] if view.kind == "directional" else x
    low, high = metric_range(view.kind, view.clip, view.near, view.far)
    slack = quantum + shift
    if view.kind == "point":
        return 1.0, (low / (low + high) - slack, 1.0 / (low + high), view.texel[0])
    matrix, sign = view.clip_from_view, view.clip.sign
    y, x = -sign * matrix[2, 2] / (low + high), (sign * matrix[2, 3] + low) / (low + high) - slack
    return (y, x - y * allowance[0]) if view.kind == "directional" else (1.0, (x, y, 0.0))


def _span(view: ShadowView) -> float:
    """Window depth is NDC z itself, or half of it: what a bias in clip units becomes after the bias matrix."""
    return 1.0 if view.clip.zero_to_one else 2.0


def _window_depth_line(view: ShadowView) -> tuple[float, float]:
    """(x, y) with window depth = x + y * d, d the distance along a sun's view or 1 / depth of a lamp's."""
    matrix = bias_matrix(view.clip) @ view.clip_from_view
    if view.kind == "directional":
        return matrix[2, 3], -matrix[2, 2]
    return -matrix[2, 2], matrix[2, 3]


def light_uniforms(light: Light) -> dict[str, Any]:
    """Uniforms of the shading: radiance, cone, range and falloff."""
    values: dict[str, Any] = {"u_radiance": tuple(min(c * light.intensity, 1e18) for c in light.color)}
    if isinstance(light, DirectionalLight):
        return values
    values["u_reach"] = (0.0 if light.range is None else 1.0 / light.range, light.falloff)
    values["u_cone"] = (0.0, 1.0)
    if isinstance(light, SpotLight):
        inner, outer = np.cos(np.radians([light.inner_angle, light.outer_angle]))
        width = max(float(inner - outer), 1e-6)
        values["u_cone"] = (1.0 / width, -float(outer) / width)
    return values


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
