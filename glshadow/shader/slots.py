"""The snippets that a shadow's settings need: the rules of the receiver contract, independent of OpenGL."""

from __future__ import annotations

from typing import Literal

from glshadow.errors import SettingsError
from glshadow.lights import Light
from glshadow.shadows.bias import Bias
from glshadow.shadows.filters import Filter
from glshadow.shadows.metric import Target
from glshadow.shadows.view import Projection

Compare = Literal["metric", "depth_taps", "depth_taps_raw", "depth_gather", "depth_gather_raw"]

Shape = Literal["plain", "cascades", "warped"]

Lit = Light | type[Light]
"""A light or its class: only class attributes are used here."""

_METRIC_DEPTHS: dict[Projection, str] = {"orthographic": "affine", "perspective": "linear", "cube": "radial"}


def parallel_define(projection: Projection) -> dict[str, int | str]:
    """The define for whether the rays of views, and of the grids of triangle lists, are parallel."""
    return {"GLS_AT_INFINITY": int(projection == "orthographic")}


def projection_defines(projection: Projection) -> dict[str, int | str]:
    """That define, and the one for the faces of a cube."""
    return {**parallel_define(projection), "GLS_POINT": int(projection == "cube")}


def metric_slot(projection: Projection) -> str:
    """Snippet of slot <metric>."""
    return "metric/radial.glsl" if projection == "cube" else "metric/projected.glsl"


def open_slots(light: Lit) -> dict[str, str]:
    """Snippets for a light that casts no shadow."""
    return {"light": light.snippet, "shadow": "receiver/open.glsl"}


def mapped_slots(
    light: Lit, target: Target, bias: Bias, filter: Filter, compare: Compare, shape: Shape = "plain"
) -> dict[str, str]:
    """Snippets for a light with a shadow map. `compare`: how dialect and driver read it; `shape`: how a directional light's is laid out.

    Raises
    ------
    SettingsError
        If the filter has no snippet: no other filter is drawn instead.
    """
    if not filter.snippet:
        raise SettingsError(f"{filter!r} has no snippet for a shadow map")
    common = {
        "light": light.snippet,
        "projection": f"projection/{light.projection if shape == 'plain' else shape}.glsl",
        "bias": bias.snippet,
        "filter": filter.snippet,
    }
    if filter.encoding:
        return {**common, "shadow": "receiver/moments.glsl"}
    depth = "affine" if target.is_depth else _METRIC_DEPTHS[light.projection]
    return {
        **common,
        "shadow": "receiver/mapped.glsl",
        "depth": f"depth/{depth}.glsl",
        "compare": f"compare/{compare}.glsl",
    }


def precomputed_slots(light: Lit) -> dict[str, str]:
    """Snippets for a light whose visibility earlier passes found."""
    return {"light": light.snippet, "shadow": "receiver/precomputed.glsl"}


def exact_slots(light: Lit) -> dict[str, str]:
    """Snippets for a light whose shadow rays are tested against per-cell triangle lists."""
    return {
        "light": light.snippet,
        "shadow": "receiver/exact.glsl",
        "candidates": "exact/lists.glsl",
    }


def area_slots(light: Lit, between: str) -> dict[str, str]:
    """Snippets of pass/penumbra.frag; `between`: "silhouettes", "region" or "found"."""
    return {**exact_slots(light), "between": f"exact/{between}.glsl"}


def exact_defines(
    projection: Projection, cells: int, ratio: int, masked: bool, huge: bool = False
) -> dict[str, int | str]:
    """Defines for `exact_slots`. `masked`: some casters are alpha-tested; `huge`: some extend far beyond the rest."""
    return {
        "GLS_EXACT": 1,
        **projection_defines(projection),
        "GLS_CELLS": cells,
        "GLS_RATIO": ratio,
        "GLS_MASKED": int(masked),
        "GLS_HUGE": int(huge),
    }


def mapped_defines(
    light: Lit, target: Target, bias: Bias, filter: Filter, reversed_depth: bool, bounded: bool
) -> dict[str, int | str]:
    """Defines for `mapped_slots`. `bounded`: some receivers are outside the map, as for a spot light they always may be."""
    return {
        **parallel_define(light.projection),
        "GLS_FOLLOW_PLANE": int(bias.follows_plane),
        "GLS_SLACK_TEXELS": str(float(filter.slack_texels)),
        "GLS_REVERSED": int(
            reversed_depth and target.is_depth
        ),  # a metric grows away from the light in every convention
        "GLS_BOUNDED": int(bounded or light.projection == "perspective"),
        "GLS_PACKED": int(target is Target.RGBA8),
        **filter.defines(),
    }


def direction_slots() -> dict[str, str]:
    """Snippets of the pass that samples the maps of a light's directions: it is lit by none in particular."""
    return {"light": "light/directional.glsl", "shadow": "receiver/open.glsl"}
