"""EnvironmentLight: light from an image of the surroundings."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar, Self

import numpy as np

from glshadow.core.setting import number, setting
from glshadow.core.spaces import Array, Triple
from glshadow.lights.directional import DirectionalLight
from glshadow.lights.distant import downward
from glshadow.lights.dome import DomeLight
from glshadow.lights.environment_map import EnvironmentMap
from glshadow.lights.environment_reflection import split_table
from glshadow.lights.light import Gizmo, Light
from glshadow.lights.table import LightTable

_SIDES = 48


def _map(name: str, value: Any) -> EnvironmentMap:
    return value if isinstance(value, EnvironmentMap) else EnvironmentMap(value)


@dataclass(frozen=True, kw_only=True)
class EnvironmentLight(DomeLight):
    """Light from an equirectangular image of the surroundings, infinitely far away.

    A white surface in a uniform image of radiance 1 receives color * intensity. What it receives, and its shadow, differ by channel.
    The image itself is not drawn.

    Parameters
    ----------
    image : EnvironmentMap, or what it takes: a file (.hdr, .exr, ...) or (H, W, 3) numbers, linear, or sRGB if uint8 or uint16
        Rows from the zenith down, its centre column towards -z.
    turn : float
        Degrees by which it is turned about the vertical, counterclockwise as seen from above. -90: its centre is towards +x, as that of
        three.js is.
    direction : (3,) floats
        Direction from the zenith down. For another axis than y, axes turn with the zenith by the shortest rotation.
    color, intensity
        As for DirectionalLight.
    shadow : Shadow or None
        Shadows of directions chosen by their luminance; see SkyLight. `visibility` is the share of the luminance.

    References
    ----------
    Debevec 1998, "Rendering synthetic objects into real scenes", SIGGRAPH: images of the surroundings as light. Ramamoorthi, Hanrahan
    2001, "An efficient representation for irradiance environment maps", SIGGRAPH: irradiance as a function of the normal.
    """

    image: EnvironmentMap = setting(
        _map, help="equirectangular image, linear radiance: a .hdr or .exr file", kw_only=False
    )
    turn: float = setting(number(-360.0, 360.0, unit="degrees"), 0.0, help="degrees about the vertical")
    direction: Triple = setting(downward, (0.0, -1.0, 0.0), help="direction from the zenith down")

    spelling: ClassVar[str] = "environment"
    usage: ClassVar[str] = "environment:FILE"
    summary: ClassVar[str] = "an equirectangular image of the surroundings, .hdr or .exr; turn=DEGREES"
    by_place: ClassVar[tuple[str, ...]] = ("image",)
    places: ClassVar[tuple[int, int]] = (1, 1)
    snippet: ClassVar[str] = "light/environment.glsl"
    per_channel: ClassVar[bool] = True

    @classmethod
    def from_places(cls, texts: Sequence[str]) -> dict[str, Any]:
        """Read the file's name."""
        return {"image": texts[0]}

    @property
    def axes(self) -> Array:
        """(3, 3) from world directions to those of the map: its right, up and backward."""
        right, up, backward = self._level()
        cosine, sine = np.cos(np.radians(self.turn)), np.sin(np.radians(self.turn))
        return np.array([cosine * right - sine * backward, up, sine * right + cosine * backward])

    def _level(self) -> Array:
        """The axes before they are turned: the world's, rotated by the shortest way from y to the zenith."""
        x, y, z = (-each for each in self.direction)
        if y < -0.5:  # not far from upside down: turned about x first
            return _shortest(x, -y, -z) @ np.diag([1.0, -1.0, -1.0])
        return _shortest(x, y, z)

    def turned(self, turn: Array, middle: Array) -> Self:
        """The light with its image rotated."""
        axes = self.axes @ turn.T
        moved = replace(self, direction=tuple((-axes[1]).tolist()))
        right, _, backward = moved._level()
        return replace(moved, turn=float(np.degrees(np.arctan2(-axes[0] @ backward, axes[0] @ right))))

    def irradiance(self, points: Array, normals: Array) -> Array:
        """Irradiance (..., 3) of each channel, over that of a uniform image of radiance 1."""
        return self.image.irradiance(normals @ self.axes.T)

    @property
    def tables(self) -> Mapping[str, Callable[[], LightTable]]:
        """Irradiance by normal; what surfaces reflect, by roughness."""
        image = self.image
        return {
            "u_irradiance": lambda: image.irradiance_table,
            "u_reflection": lambda: image.reflection_table,
            "u_split": split_table,
        }

    def hard_lights(self, count: int) -> tuple[Light, ...]:
        """Hard directional lights, at most `count`, whose colours are what each stands for; see `EnvironmentMap.directions`."""
        aims, shares = self.image.directions(count)
        aims = aims @ self.axes
        return tuple(
            DirectionalLight(direction=tuple((-aim).tolist()), color=tuple(share.tolist()), shadow=self.shadow)
            for aim, share in zip(aims, shares, strict=True)
        )

    def extremes(self) -> tuple[Light, ...]:
        """Directions that stand for the image: good for estimates, not for proofs."""
        return self.hard_lights(64)

    def to_points(self, receivers: Array, count: int) -> Array:
        """Directions of the hard lights, the same for every receiver."""
        aims = self.image.directions(count)[0] @ self.axes
        return np.broadcast_to(aims, (len(receivers), *aims.shape))

    def aims(self, points: Array, samples: int, generator: np.random.Generator) -> Iterator[tuple[Array, Array]]:
        """A random direction in each of `samples` equal shares of the luminance."""
        far = np.full(len(points), np.inf)
        for aims in self.image.random_directions(len(points), samples, generator):
            yield aims @ self.axes, far

    def uniforms(self, axes: Array) -> dict[str, Any]:
        """Also the rotation to the map's axes."""
        return {**super().uniforms(axes), "u_map_from_lv": self.axes @ axes.T}

    def gizmo(self, size: float, far: float) -> Gizmo:
        """A globe's meridians and equator above the scene's origin, and a disc with rays."""
        angle = 2.0 * np.pi * np.arange(_SIDES + 1) / _SIDES
        ring, flat = np.stack([np.cos(angle), np.sin(angle)], axis=-1), np.zeros(_SIDES + 1)
        rings = np.stack(
            [
                np.stack([ring[:, 0], flat, ring[:, 1]], axis=-1),
                np.stack([ring[:, 0], ring[:, 1], flat], axis=-1),
                np.stack([flat, ring[:, 1], ring[:, 0]], axis=-1),
            ]
        )
        rings = 0.35 * size * (rings @ self.axes)
        return Gizmo(np.stack([rings[:, :-1], rings[:, 1:]], axis=2).reshape(-1, 2, 3), opacity=0.5, rays=12)


def _shortest(x: float, y: float, z: float) -> Array:
    """Rows right, up and backward: the rotation by the shortest way from y to the unit vector (x, y, z); y > -1."""
    k = 1.0 / (1.0 + y)
    return np.array([[1.0 - k * x * x, -x, -k * x * z], [x, y, z], [-k * x * z, -z, 1.0 - k * z * z]])
