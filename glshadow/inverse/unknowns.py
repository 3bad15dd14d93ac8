"""The free settings of a light as a vector of numbers of about 1, and the light of such a vector."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np

from glshadow.core.setting import one_of, refuse, several
from glshadow.core.spaces import Array, perpendicular
from glshadow.errors import SettingsError
from glshadow.lights import Light

SIZES = ("angle", "radius", "width", "height", "intensity")
"""Settings that are positive: fitted by their logarithm."""
FREE = ("direction", "position", *SIZES)
LEAST_ANGLE, MOST_ANGLE = 0.05, 89.0  # degrees
STEP_TURN, STEP_PLACE, STEP_SIZE = np.radians(0.5), 0.01, 0.1
"""Half steps of central differences: radians, share of the scene's size, logarithm. The image of a light of 64 points is no smoother."""


@dataclass(frozen=True, eq=False)
class Unknowns:
    """What is free of a light.

    Attributes
    ----------
    light : Light
        The light of the vector 0.
    free : tuple of str
    size : float
        World units that a position's coordinate of 1 stands for.
    """

    light: Light
    free: tuple[str, ...]
    size: float

    @classmethod
    def of(cls, light: Light, free: Any, size: float) -> Unknowns:
        """The unknowns of a light; raises SettingsError for a setting that it has not, or that cannot be fitted."""
        names: tuple[str, ...] = several(one_of(*FREE), "settings")("free", (free,) if isinstance(free, str) else free)
        own = {each.name for each in fields(light)}
        if not names or not own.issuperset(names) or len(set(names)) < len(names):
            allowed = ", ".join(each for each in FREE if each in own)
            raise refuse("free", f"different settings of {type(light).__name__}: of {allowed}", free)
        if light.wide and light.at_infinity:
            raise SettingsError(f"a light from all around cannot be fitted, got {type(light).__name__}")
        for name, least in (("angle", 1.0), ("radius", 0.01 * size)):  # a size of zero has no logarithm
            if name in names and getattr(light, name) == 0.0:
                grown: dict[str, Any] = {name: least}
                light = replace(light, **grown)
        if "intensity" in names and light.intensity == 0.0:
            raise SettingsError("a light whose intensity is free must begin with one above 0")
        return cls(light, names, size)

    @property
    def steps(self) -> Array:
        """(K,) half steps of central differences."""
        parts: list[float] = []
        for name in self.free:
            parts += [STEP_TURN] * 2 if name == "direction" else [STEP_PLACE] * 3 if name == "position" else [STEP_SIZE]
        return np.array(parts)

    def at(self, vector: Array) -> Light:
        """The light of a vector (K,)."""
        given: dict[str, Any] = {}
        values = iter(vector.tolist())
        for name in self.free:
            base = getattr(self.light, name)
            if name == "direction":
                given[name] = _turned(np.asarray(base), next(values), next(values))
            elif name == "position":
                given[name] = tuple(each + self.size * next(values) for each in base)
            else:
                size = base * float(np.exp(np.clip(next(values), -20.0, 20.0)))
                given[name] = float(np.clip(size, LEAST_ANGLE, MOST_ANGLE)) if name == "angle" else size
        return replace(self.light, **given)

    def gradient(self, slopes: Array) -> dict[str, Array]:
        """Derivatives (...) by each free setting, from those (K,) by the vector at 0. A direction's is by a vector of length 1."""
        found: dict[str, Array] = {}
        first = 0
        for name in self.free:
            base = np.asarray(getattr(self.light, name))
            if name == "direction":
                u, v = (each[0] for each in perpendicular(base[None]))
                found[name] = slopes[first] * u + slopes[first + 1] * v
                first += 2
            elif name == "position":
                found[name] = slopes[first : first + 3] / self.size
                first += 3
            else:
                found[name] = slopes[first] / base
                first += 1
        return found


def _turned(direction: Array, x: float, y: float) -> tuple[float, ...]:
    """A direction turned by angles about two axes across it."""
    u, v = (each[0] for each in perpendicular(direction[None]))
    angle = float(np.hypot(x, y))
    if angle == 0.0:
        return tuple(direction.tolist())
    across = (x * u + y * v) / angle
    return tuple((np.cos(angle) * direction + np.sin(angle) * across).tolist())


def turns_around(most: float) -> Sequence[tuple[float, float]]:
    """Angles (radians) about both axes: rings around 0, ten degrees apart, up to `most` degrees."""
    found = [(0.0, 0.0)]
    for ring in range(1, int(most // 10.0) + 1):
        for k in range(6 * ring):
            turn = 2.0 * np.pi * k / (6 * ring)
            found.append((np.radians(10.0 * ring) * float(np.cos(turn)), np.radians(10.0 * ring) * float(np.sin(turn))))
    return found
