"""SkyLight: uniform light from the whole sky."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from glshadow.core.sample_patterns import GOLDEN_ANGLE, hemisphere
from glshadow.core.setting import setting
from glshadow.core.spaces import Array, Triple
from glshadow.lights.directional import DirectionalLight
from glshadow.lights.distant import downward
from glshadow.lights.dome import DomeLight
from glshadow.lights.light import Light


@dataclass(frozen=True, kw_only=True)
class SkyLight(DomeLight):
    """Uniform light from the whole sky, a dome above the horizon. Its shadow is ambient occlusion.

    A white surface that faces the zenith receives color * intensity. A tilted one receives (1 + cosine of its tilt) / 2 of that: the share
    of the dome in front of it, weighted by Lambert's law.

    Parameters
    ----------
    direction : (3,) floats
        Direction from the zenith down.
    color, intensity
        As for DirectionalLight.
    shadow : Shadow or None
        By default `DirectionMaps()`: a small shadow map for each of many directions. A filter for one shadow map becomes
        `LightSamples(of=that filter)`: 64 shadow maps, because one map cannot represent the whole sky.

    References
    ----------
    Liu, Jordan 1963, "The long-term average performance of flat-plate solar-energy collectors", Solar Energy 7: the isotropic sky.
    """

    direction: Triple = setting(downward, (0.0, -1.0, 0.0), help="direction from the zenith down")

    spelling: ClassVar[str] = "sky"
    usage: ClassVar[str] = "sky"
    summary: ClassVar[str] = "uniform light from the whole sky"
    snippet: ClassVar[str] = "light/sky.glsl"

    def irradiance(self, points: Array, normals: Array) -> Array:
        """Share of the dome in front of the surface, weighted by Lambert's law."""
        return np.asarray(0.5 - 0.5 * (normals @ np.asarray(self.direction)))

    def hard_lights(self, count: int) -> tuple[Light, ...]:
        """Hard directional lights of equal solid angle."""
        aims = hemisphere(count) @ self.disc_axes
        return tuple(DirectionalLight(direction=tuple((-aim).tolist()), shadow=self.shadow) for aim in aims)

    def extremes(self) -> tuple[Light, ...]:
        """Directions whose hull covers the dome except its rim: good for estimates, not for proofs."""
        return self.hard_lights(64)

    def to_points(self, receivers: Array, count: int) -> Array:
        """Directions to the sample points, the same for every receiver."""
        return np.broadcast_to(hemisphere(count) @ self.disc_axes, (len(receivers), count, 3))

    def aims(self, points: Array, samples: int, generator: np.random.Generator) -> Iterator[tuple[Array, Array]]:
        """Directions in rings of equal solid angle, a golden angle apart, random within each ring."""
        turn = generator.uniform(0.0, 2.0 * np.pi, len(points))
        far = np.full(len(points), np.inf)
        for ring in range(samples):
            height = (ring + generator.uniform(size=len(points))) / samples
            across, angle = np.sqrt(1.0 - height**2), turn + ring * GOLDEN_ANGLE
            yield (
                np.stack([across * np.cos(angle), across * np.sin(angle), height], axis=-1) @ self.disc_axes,
                far,
            )
