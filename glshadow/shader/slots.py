"""Which snippets a shadow's settings need: the rules of the receiver contract, without any OpenGL."""

from __future__ import annotations

from typing import Literal

from glshadow.core.lights import Light, RectLight, SkyLight
from glshadow.errors import SettingsError
from glshadow.shadows.bias import Bias
from glshadow.shadows.filters import Filter
from glshadow.shadows.metric import Target
from glshadow.shadows.view import Kind

Compare = Literal["metric", "depth_taps", "depth_taps_raw", "depth_gather", "depth_gather_raw"]

Shape = Literal["plain", "cascades", "warped"]

_PROJECTIONS = {"directional": "orthographic", "spot": "perspective", "point": "cube"}
_METRIC_DEPTHS = {"directional": "affine", "spot": "linear", "point": "radial"}


def light_slot(kind: Kind) -> str:
    """Snippet of slot <light>."""
    return "light/sun.glsl" if kind == "directional" else "light/local.glsl"


def shape_slots(light: Light) -> dict[str, str]:
    """In place of a light's snippet, where it is no single direction from each receiver."""
    shapes = {RectLight: "light/panel.glsl", SkyLight: "light/sky.glsl"}
    return {"light": shapes[type(light)]} if type(light) in shapes else {}


def metric_slot(kind: Kind) -> str:
    """Snippet of slot <metric>."""
    return "metric/radial.glsl" if kind == "point" else "metric/projected.glsl"


def open_slots(kind: Kind) -> dict[str, str]:
    """Snippets for a light that casts nothing."""
    return {"light": light_slot(kind), "shadow": "receiver/open.glsl"}


def mapped_slots(
    kind: Kind, target: Target, bias: Bias, filter: Filter, compare: Compare, shape: Shape = "plain"
) -> dict[str, str]:
    """Snippets for a light with a map; `compare`: how the dialect and the driver read it; `shape`: how a sun's is laid out.

    Raises
    ------
    SettingsError
        If the filter has no snippet: nothing else is drawn in its place.
    """
    if not filter.snippet:
        raise SettingsError(f"{filter!r} has no snippet for a shadow map: it cannot be asked of one")
    common = {
        "light": light_slot(kind),
        "projection": f"projection/{_PROJECTIONS[kind] if shape == 'plain' else shape}.glsl",
        "bias": bias.snippet,
        "filter": filter.snippet,
    }
    if filter.encoding:
        return {**common, "shadow": "receiver/moments.glsl"}
    depth = "affine" if target.is_depth else _METRIC_DEPTHS[kind]
    return {
        **common,
        "shadow": "receiver/mapped.glsl",
        "depth": f"depth/{depth}.glsl",
        "compare": f"compare/{compare}.glsl",
    }


def given_slots(kind: Kind) -> dict[str, str]:
    """Snippets for a light whose visibility earlier passes found."""
    return {"light": light_slot(kind), "shadow": "receiver/given.glsl"}


def exact_slots(kind: Kind) -> dict[str, str]:
    """Snippets for a light whose rays are tested against the triangles of lists."""
    return {
        "light": light_slot(kind),
        "shadow": "receiver/exact.glsl",
        "candidates": "exact/lists.glsl",
    }


def area_slots(kind: Kind, between: str) -> dict[str, str]:
    """Snippets of pass/penumbra.frag; `between`: "outlines", "region" or "found"."""
    return {**exact_slots(kind), "between": f"exact/{between}.glsl"}


def exact_defines(kind: Kind, cells: int, ratio: int, masked: bool, huge: bool = False) -> dict[str, int | str]:
    """Defines that go with `exact_slots`; `masked`, `huge`: some casters are cut out by their texture, reach far beyond the rest."""
    return {
        "GLS_EXACT": 1,
        "GLS_SUN": int(kind == "directional"),
        "GLS_POINT": int(kind == "point"),
        "GLS_CELLS": cells,
        "GLS_RATIO": ratio,
        "GLS_MASKED": int(masked),
        "GLS_HUGE": int(huge),
    }


def mapped_defines(
    kind: Kind, target: Target, bias: Bias, filter: Filter, reversed_depth: bool, bounded: bool
) -> dict[str, int | str]:
    """Defines that go with `mapped_slots`; `bounded`: some receivers lie outside the map, as those of a spot always may."""
    return {
        "GLS_SUN": int(kind == "directional"),
        "GLS_FOLLOW_PLANE": int(bias.follows_plane),
        "GLS_SLACK_TEXELS": str(float(filter.slack_texels)),
        "GLS_REVERSED": int(reversed_depth and target.is_depth),  # a metric grows away in every convention
        "GLS_BOUNDED": int(bounded or kind == "spot"),
        "GLS_PACKED": int(target is Target.RGBA8),
        **filter.defines(),
    }
