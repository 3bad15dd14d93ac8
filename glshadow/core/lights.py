"""The three lights: where light comes from and how strong it arrives."""

from __future__ import annotations

from collections.abc import Hashable, Iterable
from dataclasses import dataclass, fields
from typing import get_args

import numpy as np

from glshadow.core.setting import Settings, instance, number, optional, setting, several, vector
from glshadow.core.spaces import FARTHEST, NEAREST, Array, Triple, direction
from glshadow.errors import SettingsError
from glshadow.shadows.cookie import Cookie
from glshadow.shadows.shadow import Shadow

BRIGHTEST = 1e38  # what float32 holds

NEAR_HELP, FAR_HELP = "near plane of its shadow map, along the light", "far plane of its shadow map, along the light"


@dataclass(frozen=True, kw_only=True)
class BaseLight(Settings):
    """What every light has."""

    color: Triple = setting(vector(3, 0.0, BRIGHTEST), (1.0, 1.0, 1.0), help="linear RGB factor")
    intensity: float = setting(
        number(0.0, BRIGHTEST), 1.0, help="strength: a white surface facing the light gets color * intensity"
    )
    near: float | None = setting(optional(number(-FARTHEST, FARTHEST)), None, help=NEAR_HELP)
    far: float | None = setting(optional(number(-FARTHEST, FARTHEST)), None, help=FAR_HELP)
    shadow: Shadow | None = setting(optional(instance(Shadow), "casts nothing"), factory=Shadow, help="of its shadow")

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.near is not None and self.far is not None and not self.near < self.far:
            name = type(self).__name__
            raise SettingsError(f"{name} near must be less than far, got near={self.near}, far={self.far}")


@dataclass(frozen=True, kw_only=True)
class _LocalLight(BaseLight):
    position: Triple = setting(vector(3, -FARTHEST, FARTHEST), help="where the light is")
    near: float | None = setting(optional(number(NEAREST, FARTHEST)), None, help=NEAR_HELP)
    far: float | None = setting(optional(number(NEAREST, FARTHEST)), None, help=FAR_HELP)
    radius: float = setting(number(0.0, FARTHEST), 0.0, help="radius of the source, world units; 0 is a point")
    range: float | None = setting(
        optional(number(NEAREST, FARTHEST), "no end"), None, help="distance at which the light has faded to nothing"
    )
    falloff: float = setting(number(0.0, 8.0), 0.0, help="exponent of the distance: 0 constant, 2 physical")


@dataclass(frozen=True, kw_only=True)
class DirectionalLight(BaseLight):
    """Parallel light from infinitely far away: the sun.

    Parameters
    ----------
    direction : (3,) floats
        The way the light travels, of any length but zero. There is no position.
    color, intensity
        Linear RGB factor, and its strength: a white surface that faces the light gets color * intensity.
    angle : float
        Angular diameter of the source, degrees in [0, 90): 0.53 for the sun. 0 is a point at infinity.
    cookie : Cookie, optional
        An image that colours its light.
    near, far : float, optional
        Depth range of the shadow map along the light, world units from the world origin; None derives it.
    shadow : Shadow or None
        Settings of its shadow; None: it casts nothing and gets no map.
    """

    direction: Triple = setting(direction, (-0.55, -0.8, -0.25), help="the way the light travels")
    angle: float = setting(
        number(0.0, 90.0, unit="degrees", below=True),
        0.0,
        help="angular diameter of the source, degrees; 0.53 for the sun",
    )
    cookie: Cookie | None = setting(optional(instance(Cookie), "none"), None, help="an image that it projects")


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
    cookie : Cookie, optional
        An image that colours its light: the square around the cone.
    near, far : float, optional
        Depth range of the shadow map, distances from the light; None derives it.
    """

    direction: Triple = setting(direction, (0.0, -1.0, 0.0), help="the way the light travels")
    inner_angle: float = setting(
        number(0.0, 90.0, unit="degrees", below=True), 20.0, help="degrees from the axis up to which it is full"
    )
    outer_angle: float = setting(
        number(0.0, 90.0, unit="degrees", above=True, below=True),
        30.0,
        help="degrees from the axis beyond which there is none",
    )
    cookie: Cookie | None = setting(optional(instance(Cookie), "none"), None, help="an image that it projects")

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.inner_angle > self.outer_angle:
            raise SettingsError(
                f"SpotLight inner_angle must not be greater than outer_angle (degrees from the axis), "
                f"got inner_angle={self.inner_angle}, outer_angle={self.outer_angle}"
            )


@dataclass(frozen=True, kw_only=True)
class PointLight(_LocalLight):
    """Light from a position in every direction; parameters as for SpotLight."""


@dataclass(frozen=True, kw_only=True)
class RectLight(PointLight):
    """Light from one side of a panel, the same from every point of it in every direction (Lambert).

    A white surface against the panel gets color * intensity; farther away it gets the share of its view that the panel fills, weighed
    by the cosine of Lambert's law (the form factor). So there is no falloff to choose, and scale does not matter.

    Parameters
    ----------
    position : (3,) floats
        The panel's middle.
    direction : (3,) floats
        The way its lit side looks.
    up : (3,) floats
        Along its height; not along the direction.
    width, height : float
        World units.
    color, intensity, range, shadow
        As for PointLight. radius and falloff stay 0.

    References
    ----------
    Lambert 1760, Photometria, for the irradiance of a polygon; Baum, Rushmeier, Winget 1989, "Improving radiosity solutions through
    the use of analytically determined form-factors", SIGGRAPH, for its use.
    """

    direction: Triple = setting(direction, (0.0, -1.0, 0.0), help="the way the panel's lit side looks")
    up: Triple = setting(vector(3, -FARTHEST, FARTHEST), (0.0, 0.0, -1.0), help="along the panel's height")
    width: float = setting(number(NEAREST, FARTHEST), 1.0, help="of the panel, world units")
    height: float = setting(number(NEAREST, FARTHEST), 1.0, help="of the panel, world units")

    def __post_init__(self) -> None:
        super().__post_init__()
        for name in ("radius", "falloff"):
            if getattr(self, name) != 0.0:
                raise SettingsError(
                    f"RectLight {name} must stay 0, got {getattr(self, name):g}: a panel has width and height, and the falloff that "
                    "follows from its size"
                )
        across = np.cross(np.asarray(self.direction), np.asarray(self.up))
        if not np.linalg.norm(across) > 1e-6 * np.linalg.norm(self.up):
            raise SettingsError(
                f"RectLight up must not lie along direction, got up={self.up}, direction={self.direction}"
            )


@dataclass(frozen=True, kw_only=True)
class SkyLight(DirectionalLight):
    """The same light from all of the sky, a dome over the horizon. What it shadows is ambient occlusion.

    A white surface that looks to the zenith gets color * intensity, one that looks elsewhere (1 + cosine of its tilt) / 2 of that: the
    share of the dome that lies before it, weighed by Lambert's law.

    Parameters
    ----------
    direction : (3,) floats
        From the zenith down.
    color, intensity, shadow
        As for DirectionalLight. angle stays 0.

    References
    ----------
    Liu, Jordan 1963, "The long-term average performance of flat-plate solar-energy collectors", Solar Energy 7: the isotropic sky.
    """

    direction: Triple = setting(direction, (0.0, -1.0, 0.0), help="from the zenith down")

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.angle != 0.0:
            raise SettingsError(
                f"SkyLight angle must stay 0, got {self.angle:g}: it is the whole sky; a DirectionalLight has an angle"
            )
        if self.cookie is not None:
            raise SettingsError("SkyLight cookie must stay None: light from everywhere projects no image")


Light = DirectionalLight | SpotLight | PointLight | RectLight | SkyLight

Lights = Iterable[BaseLight] | BaseLight | None
"""An argument that is several lights, one, or the scene's own."""

LIGHTS = several(instance(*get_args(Light)), "DirectionalLight, SpotLight, PointLight, RectLight or SkyLight")
"""The rule of an argument that is several lights."""


_STRENGTH = {"color", "intensity", "inner_angle", "range", "falloff", "cookie", "near", "far", "shadow"}


def geometry_of(light: Light) -> tuple[Hashable, ...]:
    """All of a light that decides where its shadows fall, as a key: its kind, and every setting but those of its strength and its map."""
    return (type(light), *(getattr(light, field.name) for field in fields(light) if field.name not in _STRENGTH))


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
