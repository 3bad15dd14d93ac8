"""The three lights: where light comes from and how strong it arrives."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from glshadow.core.shadow import Shadow
from glshadow.core.spaces import FARTHEST, NEAREST, Array, finite_vector, unit
from glshadow.errors import SettingsError

Triple = tuple[float, float, float]


def _set(light: Any, name: str, value: Any) -> None:
    object.__setattr__(light, name, value)  # the dataclasses are frozen; __post_init__ normalises once


def _triple(vector: Array) -> Triple:
    return (float(vector[0]), float(vector[1]), float(vector[2]))


@dataclass(frozen=True, kw_only=True)
class _Light:
    color: Triple = (1.0, 1.0, 1.0)
    intensity: float = 1.0
    near: float | None = None
    far: float | None = None
    shadow: Shadow | None = field(default_factory=Shadow)

    def __post_init__(self) -> None:
        color = finite_vector("color", self.color)
        if (color < 0).any():
            raise SettingsError(f"color must not be negative, got {self.color!r}")
        _set(self, "color", _triple(color))
        _check("intensity", self.intensity, 0.0, np.inf)
        if self.shadow is not None and not isinstance(self.shadow, Shadow):
            raise SettingsError(f"shadow must be a glshadow.Shadow or None (casts nothing), got {self.shadow!r}")
        for name, plane in (("near", self.near), ("far", self.far)):
            if plane is not None and not abs(plane) <= FARTHEST:
                raise SettingsError(f"{name} must be in [{-FARTHEST:g}, {FARTHEST:g}] or None (derived), got {plane!r}")
        if self.near is not None and self.far is not None and not self.near < self.far:
            raise SettingsError(f"near must be less than far, got near={self.near}, far={self.far}")


def _check(name: str, value: float, low: float, high: float, *, open_high: bool = True) -> None:
    if not (np.isfinite(value) and low <= value and (value < high if open_high else value <= high)):
        raise SettingsError(f"{name} must be in [{low:g}, {high:g}{')' if open_high else ']'}, got {value!r}")


@dataclass(frozen=True, kw_only=True)
class _LocalLight(_Light):
    position: Triple
    radius: float = 0.0
    range: float | None = None
    falloff: float = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        _set(self, "position", _triple(finite_vector("position", self.position, largest=FARTHEST)))
        _check("radius", self.radius, 0.0, FARTHEST, open_high=False)
        _check("falloff", self.falloff, 0.0, 8.0, open_high=False)
        if self.range is not None and not NEAREST <= self.range <= FARTHEST:
            raise SettingsError(f"range must be in [{NEAREST:g}, {FARTHEST:g}] or None (no end), got {self.range!r}")
        for name, plane in (("near", self.near), ("far", self.far)):
            if plane is not None and plane < NEAREST:
                raise SettingsError(
                    f"{name} must be positive for a light with a position, {NEAREST:g} or more, got {plane!r}"
                )


@dataclass(frozen=True, kw_only=True)
class DirectionalLight(_Light):
    """Parallel light from infinitely far away: the sun.

    Parameters
    ----------
    direction : (3,) floats
        The way the light travels, of any length but zero. There is no position.
    color, intensity
        Linear RGB factor, and its strength: a white surface that faces the light gets color * intensity.
    angle : float
        Angular diameter of the source, degrees in [0, 90): 0.53 for the sun. 0 is a point at infinity.
    near, far : float, optional
        Depth range of the shadow map along the light, world units from the world origin; None derives it.
    shadow : Shadow or None
        Settings of its shadow; None: it casts nothing and gets no map.
    """

    direction: Triple = (-0.55, -0.8, -0.25)
    angle: float = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        _set(self, "direction", _triple(unit("direction", self.direction)))
        _check("angle", self.angle, 0.0, 90.0)


@dataclass(frozen=True, kw_only=True)
class SpotLight(_LocalLight):
    """Light from a position into a cone.

    Parameters
    ----------
    position, direction : (3,) floats
        Where the light is and the way it travels.
    inner_angle, outer_angle : float
        Degrees **from the axis**: full strength up to the inner, none beyond the outer, smooth between. 0 <= inner <= outer < 90;
        the shadow map's field of view is twice the outer angle, so 90 and more (180 across) has no map.
    radius : float
        Radius of the source, world units. 0 is a point.
    range : float, optional
        Distance at which the light has faded to nothing (window (1 - (d/range)^4)^2, glTF KHR_lights_punctual); None: no end.
    falloff : float
        Exponent p of the distance: strength ~ 1 / distance^p. 0 (default): constant, so that scale does not matter;
        2: physical, intensity is then in candela.
    near, far : float, optional
        Depth range of the shadow map, distances from the light; None derives it.
    """

    direction: Triple = (0.0, -1.0, 0.0)
    inner_angle: float = 20.0
    outer_angle: float = 30.0

    def __post_init__(self) -> None:
        super().__post_init__()
        _set(self, "direction", _triple(unit("direction", self.direction)))
        _check("outer_angle", self.outer_angle, 0.0, 90.0)
        _check("inner_angle", self.inner_angle, 0.0, 90.0)
        if self.outer_angle <= 0.0 or self.inner_angle > self.outer_angle:
            raise SettingsError(
                f"a cone needs 0 <= inner_angle <= outer_angle and outer_angle > 0 (degrees from the axis), "
                f"got inner_angle={self.inner_angle}, outer_angle={self.outer_angle}"
            )


@dataclass(frozen=True, kw_only=True)
class PointLight(_LocalLight):
    """Light from a position in every direction; parameters as for SpotLight."""


Light = DirectionalLight | SpotLight | PointLight


def to_light(light: Light, points: Array) -> tuple[Array, Array]:
    """Unit vectors towards the light and distances to it.

    Parameters
    ----------
    points : (..., 3) float64
        World positions.

    Returns
    -------
    (..., 3) float64, (...) float64
        Unit vectors; distances, infinite for a directional light.
    """
    if isinstance(light, DirectionalLight):
        towards = np.broadcast_to(-np.asarray(light.direction), points.shape)
        return towards, np.full(points.shape[:-1], np.inf)
    offset = np.asarray(light.position) - points
    distance = np.linalg.norm(offset, axis=-1)
    return offset / np.where(distance > 0, distance, 1.0)[..., None], distance


def cone(light: SpotLight, points: Array) -> Array:
    """Strength of the cone at world positions (..., 3): 1 inside the inner, 0 outside the outer angle; (...)."""
    towards, _ = to_light(light, points)
    cosine = -(towards @ np.asarray(light.direction))
    inner, outer = np.cos(np.radians([light.inner_angle, light.outer_angle]))
    if inner == outer:
        return np.where(cosine >= outer, 1.0, 0.0)
    x = np.clip((cosine - outer) / (inner - outer), 0.0, 1.0)
    return np.asarray(x * x * (3.0 - 2.0 * x))
