"""Which snippets a shadow's settings need: the rules of the receiver contract, without any OpenGL."""

from __future__ import annotations

from typing import Literal

from glshadow.core.bias import Bias, ConstantBias, NormalOffsetBias, ReceiverPlaneBias
from glshadow.core.kernels import Filter, Hard
from glshadow.core.metric import Target
from glshadow.core.view import Kind

Compare = Literal["metric", "depth_taps", "depth_gather", "depth_gather_raw"]

_PROJECTIONS = {"directional": "orthographic", "spot": "perspective", "point": "cube"}
_METRIC_DEPTHS = {"directional": "affine", "spot": "linear", "point": "radial"}
_MOVES: dict[type, str] = {ConstantBias: "constant", NormalOffsetBias: "normal_offset"}


BLOCKS = {4: (2, 2), 8: (4, 2), 16: (4, 4)}
"""Columns and rows of the block that holds an exact filter's samples of a pixel."""


def light_slot(kind: Kind) -> str:
    """Snippet of slot <light>."""
    return "light/sun.glsl" if kind == "directional" else "light/local.glsl"


def metric_slot(kind: Kind) -> str:
    """Snippet of slot <metric>."""
    return "metric/radial.glsl" if kind == "point" else "metric/projected.glsl"


def open_slots(kind: Kind) -> dict[str, str]:
    """Snippets for a light that casts nothing."""
    return {"light": light_slot(kind), "shadow": "receiver/open.glsl"}


def mapped_slots(kind: Kind, target: Target, bias: Bias, kernel: Filter, compare: Compare) -> dict[str, str]:
    """Snippets for a light with a map; `compare`: how the dialect and the driver read it."""
    depth = "affine" if target.is_depth else _METRIC_DEPTHS[kind]
    return {
        "light": light_slot(kind),
        "shadow": "receiver/mapped.glsl",
        "projection": f"projection/{_PROJECTIONS[kind]}.glsl",
        "depth": f"depth/{depth}.glsl",
        "bias": f"bias/{_MOVES.get(type(bias), 'none')}.glsl",
        "compare": f"compare/{compare}.glsl",
        "filter": "filter/hard.glsl" if isinstance(kernel, Hard) else "filter/pcf.glsl",
    }


def given_slots(kind: Kind) -> dict[str, str]:
    """Snippets for a light whose visibility an earlier pass found."""
    return {"light": light_slot(kind), "shadow": "receiver/given.glsl"}


def exact_slots(kind: Kind, candidates: str) -> dict[str, str]:
    """Snippets for a light whose triangles are asked; `candidates`: "lists" or "numbers"."""
    return {
        "light": light_slot(kind),
        "shadow": "receiver/exact.glsl",
        "candidates": f"exact/{candidates}.glsl",
    }


def exact_defines(kind: Kind, cells: int, ratio: int, masked: bool) -> dict[str, int | str]:
    """Defines that go with `exact_slots`."""
    return {
        "GLS_EXACT": 1,
        "GLS_SUN": int(kind == "directional"),
        "GLS_POINT": int(kind == "point"),
        "GLS_CELLS": cells,
        "GLS_RATIO": ratio,
        "GLS_MASKED": int(masked),
    }


def mapped_defines(
    kind: Kind, target: Target, bias: Bias, kernel: Filter, reversed_depth: bool
) -> dict[str, int | str]:
    """Defines that go with `mapped_slots`. A sun's fit holds every receiver and six faces hold every direction: only a spot is bounded."""
    return {
        "GLS_SUN": int(kind == "directional"),
        "GLS_FOLLOW_PLANE": int(isinstance(bias, ReceiverPlaneBias)),
        "GLS_SLACK_TEXELS": str(float(kernel.slack_texels)),
        "GLS_PCF_RADIUS": kernel.radius,
        "GLS_REVERSED": int(
            reversed_depth and target.is_depth
        ),  # a metric grows away from the light in every convention
        "GLS_BOUNDED": int(kind == "spot"),
        "GLS_PACKED": int(target is Target.RGBA8),
    }
