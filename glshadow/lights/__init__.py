"""Lights: settings and float64 formulas, one file per kind of light. The GLSL twins are in glsl/light."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from glshadow.core.setting import refuse, several
from glshadow.lights.directional import DirectionalLight
from glshadow.lights.environment import EnvironmentLight
from glshadow.lights.environment_map import EnvironmentMap
from glshadow.lights.light import BRIGHTEST_RADIANCE, Gizmo, Light
from glshadow.lights.point import PointLight
from glshadow.lights.rect import RectLight
from glshadow.lights.sky import SkyLight
from glshadow.lights.spot import SpotLight

LIGHTS: tuple[type[Light], ...] = (DirectionalLight, SpotLight, PointLight, RectLight, SkyLight, EnvironmentLight)
"""All kinds of light. A new kind is added here."""

Lights = Iterable[Light] | Light | None
"""An argument that takes several lights, one light, or the scene's own lights."""

TRACED = 256
"""Points traced on a light that has a size, for a reference: the error in a penumbra is at most 1 / (2 sqrt(TRACED))."""


def as_lights(name: str, value: Any) -> tuple[Light, ...]:
    """Check an argument that takes several lights or one light."""
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
    """Points traced on each light for a reference: 1 if no light has a size."""
    return TRACED if any(light.has_size for light in lights) else 1


__all__ = [
    "BRIGHTEST_RADIANCE", "LIGHTS", "DirectionalLight", "EnvironmentLight", "EnvironmentMap", "Gizmo", "Light", "Lights", "PointLight",
    "RectLight", "SkyLight", "SpotLight", "as_lights", "traced_points",
]  # fmt: skip
