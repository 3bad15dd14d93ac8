"""Lights: each kind is one file, and says all of itself. Pure float64 and settings; the GLSL twins are in glsl/light."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from glshadow.core.setting import refuse, several
from glshadow.lights.directional import DirectionalLight
from glshadow.lights.light import BRIGHTEST_RADIANCE, Gizmo, Light
from glshadow.lights.point import PointLight
from glshadow.lights.rect import RectLight
from glshadow.lights.sky import SkyLight
from glshadow.lights.spot import SpotLight

LIGHTS: tuple[type[Light], ...] = (DirectionalLight, SpotLight, PointLight, RectLight, SkyLight)
"""All kinds; a new one goes here."""

Lights = Iterable[Light] | Light | None
"""An argument that is several lights, one, or the scene's own."""

TRACED = 256
"""Points of a light that has a size which the tools trace for a truth: off by 1 / (2 sqrt(TRACED)) in a penumbra, at most."""


def as_lights(name: str, value: Any) -> tuple[Light, ...]:
    """The rule of an argument that is several lights, or one."""
    given: tuple[Light, ...] = _several(name, (value,) if isinstance(value, Light) else value)
    return given


def _one(name: str, value: Any) -> Light:
    if not isinstance(value, Light):
        raise refuse(name, _named(), value)
    return value


def _named() -> str:
    *first, last = (kind.__name__ for kind in LIGHTS)
    return f"{', '.join(first)} or {last}"


_several = several(_one, _named())


def traced_points(lights: Iterable[Light]) -> int:
    """Points of each light for a truth: one where none has a size."""
    return TRACED if any(light.has_size for light in lights) else 1


__all__ = [
    "BRIGHTEST_RADIANCE", "LIGHTS", "DirectionalLight", "Gizmo", "Light", "Lights", "PointLight", "RectLight", "SkyLight", "SpotLight",
    "as_lights", "traced_points",
]  # fmt: skip
