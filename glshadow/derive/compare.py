"""Uniforms that turn a receiver into a depth comparable with a map, for glsl/projection, depth, bias and compare."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from glshadow.core.spaces import bias_matrix
from glshadow.shadows.bias import FACET_SLOPE, WINDOW_PER_CLIP, Bias
from glshadow.shadows.filters import Filter
from glshadow.shadows.metric import Target, metric_range
from glshadow.shadows.view import ShadowView

# A receiver's position is a sum of products in float32: ray x depth, plus the eye, back onto the plane, into the light's view. The
# caster's vertex has its own matrix product. 16 roundings of relative size 2^-24 bound the sum.
_ROUNDINGS = 16.0


def rounding_of(reach: float) -> float:
    """Bound of a receiver's displacement by float32, world units, if its coordinates stay below `reach` in every frame on its way."""
    return _ROUNDINGS * 2.0**-24 * reach


def map_uniforms(
    views: Sequence[ShadowView], size: tuple[int, int], target: Target, bias: Bias, filter: Filter, rounding: float
) -> dict[str, Any]:
    """Uniforms of a receiver that samples a map.

    Parameters
    ----------
    views : sequence of ShadowView
        All with the scale of the first.
    size : (2,) ints
        Of their atlas, texels.
    rounding : float
        Bound of a receiver's displacement by float32 along the light, world units, see `rounding_of`; used only by a bias that follows the
        receiver's plane.

    Returns
    -------
    dict
        Floats, tuples of floats, and for `u_face_tile` float32 bytes.
    """
    view = views[0]
    left, _, bottom, _ = view.window
    x, y = view.texel
    tile = (
        view.tile if view.projection != "cube" else (0, 0)
    )  # a point light's tile is added after its face is selected
    tiles = np.zeros((6, 2), dtype=np.float32)
    for each in views:
        tiles[each.face] = each.tile
    allowance = _allowance(view, bias, filter, rounding)
    scale, depth = _depth_uniforms(view, target, bias, filter, allowance)
    return {
        "u_texel_from_lv": (1.0 / x, 1.0 / y, tile[0] - left / x, tile[1] - bottom / y),
        "u_base": (scale, scale * x, scale * y),
        # the dominant axis selects a point light's face, so no receiver is outside
        "u_tile": (-1e9, -1e9, 1e9, 1e9)
        if view.projection == "cube"
        else (*(c + view.inset for c in tile), *(c + view.resolution - view.inset for c in tile)),
        "u_face_tile": tiles.tobytes(),
        "u_map_texel": (1.0 / size[0], 1.0 / size[1]),
        "u_depth": depth,
        "u_allowance": allowance,
        "u_bias": bias.amount,
        **(_cascade_uniforms(views, target, bias, filter) if view.cascade else {}),
        **({} if view.warp is None else _warp_uniforms(view, bias, filter, rounding)),
    }


def _cascade_uniforms(views: Sequence[ShadowView], target: Target, bias: Bias, filter: Filter) -> dict[str, Any]:
    """Uniforms that differ between the views of a directional light; depth is the same in all, except for the slack of larger texels."""
    first = views[0]
    assert first.cascade is not None
    scale, _ = _depth_uniforms(first, target, bias, filter, (0.0, 0.0))
    texels, tiles, scales, ends = [], [], [], []
    for view in views:
        assert view.cascade is not None
        (left, _, bottom, _), (x, y) = view.window, view.texel
        texels.append((1.0 / x, 1.0 / y, view.tile[0] - left / x, view.tile[1] - bottom / y))
        low, high = (np.add(view.tile, end) for end in (view.inset, view.resolution - view.inset))
        tiles.append((*low, *high))
        facet = FACET_SLOPE * filter.reach_texels * (max(x, y) - max(first.texel)) if bias.follows_plane else 0.0
        scales.append((scale * x, scale * y, scale * facet, max(x, y) / max(first.texel)))
        ends.append((view.cascade.start, view.cascade.end))
    world_from_lv = np.linalg.inv(first.view_from_world)
    return {
        "u_cascade_texel": np.array(texels, dtype=np.float32).tobytes(),
        "u_cascade_tile": np.array(tiles, dtype=np.float32).tobytes(),
        "u_cascade_scale": np.array(scales, dtype=np.float32).tobytes(),
        "u_cascade_end": np.array(ends, dtype=np.float32).tobytes(),
        "u_view_depth": tuple((first.cascade.depth_of @ world_from_lv).tolist()),
        "u_blend": first.cascade.blend,
    }


def _warp_uniforms(view: ShadowView, bias: Bias, filter: Filter, rounding: float) -> dict[str, Any]:
    """Of a perspective-warped map: light view space to texels and stored depth, for points and, inverted, for planes."""
    side = float(view.resolution)
    place = np.array([[side, 0, 0, view.tile[0]], [0, side, 0, view.tile[1]], [0, 0, 1, 0], [0, 0, 0, 1.0]])
    matrix = place @ bias_matrix(view.clip) @ view.clip_from_view
    facet = FACET_SLOPE * filter.reach_texels if bias.follows_plane else 0.0
    x, y = view.texel
    return {
        "u_warp": matrix,
        "u_unwarp": np.linalg.inv(matrix).T,
        "u_slack": (rounding if bias.follows_plane else 0.0, facet * x, facet * y),
    }


def _allowance(view: ShadowView, bias: Bias, filter: Filter, rounding: float) -> tuple[float, float]:
    """World units, and share of the distance, by which a receiver's distance is reduced; (0, 0) unless its plane is followed."""
    if not bias.follows_plane:
        return 0.0, 0.0
    facet = FACET_SLOPE * filter.reach_texels * max(view.texel)
    return (rounding + facet, 0.0) if view.projection == "orthographic" else (rounding, facet)


def _depth_uniforms(
    view: ShadowView, target: Target, bias: Bias, filter: Filter, allowance: tuple[float, float]
) -> tuple[float, float | tuple[float, float, float]]:
    """Factor of the base, and stored depth from the base minus the constant slack: see glsl/depth."""
    quantum = target.quantum if bias.follows_plane else 0.0
    if filter.encoding:
        per_unit, near = 1.0 / (view.far - view.near), view.near
        constant = -near * per_unit - quantum - bias.of_compare
        if view.projection == "orthographic":
            return per_unit, (constant - per_unit * allowance[0], 0.0, 0.0)
        return 1.0, (constant, per_unit, 0.0)
    if target is Target.DEPTH32F and view.clip.reversed and view.clip.zero_to_one:
        quantum = 0.0  # reversed 0..1 floats round relative to 1 / depth, which `rounding` covers
    shift = bias.of_compare
    if target.is_depth:
        x, y = window_depth_line(view)
        x -= view.clip.sign * (quantum + shift * WINDOW_PER_CLIP)
        if view.warp is not None:  # the matrix gives the depth
            return y, -view.clip.sign * (quantum + shift * WINDOW_PER_CLIP)
        return y, x - y * allowance[0] if view.projection == "orthographic" else x
    low, high = metric_range(view.projection, view.clip, view.near, view.far)
    slack = quantum + shift
    if view.projection == "cube":
        return 1.0, (low / (low + high) - slack, 1.0 / (low + high), view.texel[0])
    matrix, sign = view.clip_from_view, view.clip.sign
    y, x = -sign * matrix[2, 2] / (low + high), (sign * matrix[2, 3] + low) / (low + high) - slack
    return (y, x - y * allowance[0]) if view.projection == "orthographic" else (1.0, (x, y, 0.0))


def window_depth_line(view: ShadowView) -> tuple[float, float]:
    """(x, y) with window depth = x + y * d; d is the depth in a directional light's view, or 1 / depth in a local light's."""
    matrix = bias_matrix(view.clip) @ view.clip_from_view
    if view.projection == "orthographic":
        return matrix[2, 3], -matrix[2, 2]
    return -matrix[2, 2], matrix[2, 3]
