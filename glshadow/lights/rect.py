"""RectLight: light from one side of a rectangle."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar, Self

import numpy as np

from glshadow.core.sample_patterns import GOLDEN_SHARE, square
from glshadow.core.setting import number, setting
from glshadow.core.setting import vector as vector_rule
from glshadow.core.spaces import FARTHEST, NEAREST, Array, Bools, Triple, direction
from glshadow.core.spelling import numbers, vector
from glshadow.errors import SettingsError
from glshadow.lights.light import Gizmo, Light
from glshadow.lights.local import LocalLight, unit_and_length
from glshadow.lights.point import PointLight, arms

_RING = np.array([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)])


@dataclass(frozen=True, kw_only=True)
class RectLight(LocalLight):
    """Rectangular area light: one side of a rectangle emits, equally from every point in every direction (Lambert).

    A white surface that touches it receives color * intensity. Farther away it receives the share of its view that the rectangle covers,
    weighted by the cosine of Lambert's law (the form factor). So there is no falloff to choose, and scale does not matter.

    Parameters
    ----------
    position : (3,) floats
        Centre of the rectangle.
    direction : (3,) floats
        The direction that its lit side faces.
    up : (3,) floats
        Direction along its height; not parallel to `direction`.
    width, height : float
        Size in world units.
    color, intensity, range
        As for PointLight.
    shadow : Shadow or None
        Settings of its shadow. A filter that supports only point lights draws the hard shadow of the centre; `Used.fallbacks` reports it.

    References
    ----------
    Lambert 1760, Photometria, for the irradiance of a polygon; Baum, Rushmeier, Winget 1989, "Improving radiosity solutions through
    the use of analytically determined form-factors", SIGGRAPH, for its use.
    """

    direction: Triple = setting(direction, (0.0, -1.0, 0.0), help="direction that its lit side faces")
    up: Triple = setting(vector_rule(3, -FARTHEST, FARTHEST), (0.0, 0.0, -1.0), help="direction along its height")
    width: float = setting(number(NEAREST, FARTHEST), 1.0, help="width, world units")
    height: float = setting(number(NEAREST, FARTHEST), 1.0, help="height, world units")

    spelling: ClassVar[str] = "rect"
    usage: ClassVar[str] = "rect:px,py,pz:dx,dy,dz:width,height"
    summary: ClassVar[str] = "one side of a rectangle"
    by_place: ClassVar[tuple[str, ...]] = ("position", "direction", "width", "height")
    places: ClassVar[tuple[int, int]] = (3, 3)
    snippet: ClassVar[str] = "light/rect.glsl"
    wide: ClassVar[bool] = True
    penumbra: ClassVar[Mapping[str, int] | None] = {"GLS_RECT": 1}

    def __post_init__(self) -> None:
        super().__post_init__()
        across = np.cross(np.asarray(self.direction), np.asarray(self.up))
        if not np.linalg.norm(across) > 1e-6 * np.linalg.norm(self.up):
            raise SettingsError(
                f"RectLight up must not be parallel to direction, got up={self.up}, direction={self.direction}"
            )

    @classmethod
    def from_places(cls, texts: Sequence[str]) -> dict[str, Any]:
        """Read position, direction, width and height. The height is vertical unless the light faces up or down."""
        width, height = numbers(texts[2], 2)
        forward = vector(texts[1])
        given: dict[str, Any] = {"position": vector(texts[0]), "direction": forward, "width": width, "height": height}
        level = abs(forward[1]) < 0.9 * math.hypot(*forward)
        return {**given, "up": (0.0, 1.0, 0.0)} if level else given

    def turned(self, turn: Array, middle: Array) -> Self:
        """The light with its position and axes rotated."""
        direction, up = (tuple((turn @ np.asarray(each)).tolist()) for each in (self.direction, self.up))
        return replace(super().turned(turn, middle), direction=direction, up=up)

    # -- irradiance

    @property
    def axes(self) -> Array:
        """Rows (3, 3) in world space: half the width along its axis, half the height along its axis, and the normal of the lit side."""
        forward, up = np.asarray(self.direction), np.asarray(self.up)
        right = np.cross(forward, up)
        right /= np.linalg.norm(right)
        return np.stack([0.5 * self.width * right, 0.5 * self.height * np.cross(right, forward), forward])

    def shines_on(self, points: Array) -> Bools:
        """Whether points are in front of the lit side."""
        return np.asarray(self.rays_to(points) @ np.asarray(self.direction) > 0.0)

    def irradiance(self, points: Array, normals: Array) -> Array:
        """The form factor times the window of its range."""
        factor, _ = self.form_factor(points.reshape(-1, 3), normals.reshape(-1, 3))
        return np.asarray(factor.reshape(points.shape[:-1]) * self.strength(points))

    def form_factor(self, points: Array, normals: Array) -> tuple[Array, Array]:
        """Irradiance on surfaces (N, 3) with unit normals (N, 3), and how much of the light is above their horizon: shares (N,), (N,).

        The form factor of the polygon clipped to the horizon (Lambert 1760). GLSL twin: glsl/light/rect.glsl
        """
        right, up, forward = self.axes
        middle = np.asarray(self.position) - points
        factor, above = np.zeros((2, len(points)))
        for row in range(len(points)):
            if not -(middle[row] @ forward) > 0.0:
                continue
            corners = middle[row] + _RING @ np.stack([right, up])
            heights = corners @ normals[row]
            kept, place = [], []
            for i in range(4):
                j = (i + 1) % 4
                if heights[i] > 0.0:
                    kept.append(corners[i])
                    place.append(_RING[i])
                if (heights[i] > 0.0) != (heights[j] > 0.0):
                    share = heights[i] / (heights[i] - heights[j])
                    kept.append(corners[i] + share * (corners[j] - corners[i]))
                    place.append(_RING[i] + share * (_RING[j] - _RING[i]))
            if len(kept) < 3:
                continue
            unit = np.array(kept) / np.linalg.norm(kept, axis=1, keepdims=True)
            following = np.roll(unit, -1, axis=0)
            turn = np.cross(unit, following)
            size = np.linalg.norm(turn, axis=1)
            angle = np.arctan2(size, (unit * following).sum(axis=1))
            factor[row] = abs(float((angle / np.where(size > 0.0, size, 1.0)) @ (turn @ normals[row]))) / (2.0 * np.pi)
            flat = np.array(place)
            around = np.roll(flat, -1, axis=0)
            above[row] = abs(float((flat[:, 0] * around[:, 1] - flat[:, 1] * around[:, 0]).sum())) / 8.0
        return factor, above

    # -- size

    @property
    def has_size(self) -> bool:
        """Always."""
        return True

    @property
    def source_radius(self) -> float:
        """Half the diagonal of the rectangle."""
        return 0.5 * float(np.hypot(self.width, self.height))

    def hard_lights(self, count: int) -> tuple[Light, ...]:
        """Hard point lights on the rectangle."""
        return self._at(square(count))

    def extremes(self) -> tuple[Light, ...]:
        """Hard point lights at its corners."""
        return self._at(_RING)

    def _at(self, points: Array) -> tuple[Light, ...]:
        """Point lights at points (N, 2) of the square from -1 to 1."""
        places = np.asarray(self.position) + points @ self.axes[:2]
        return tuple(PointLight(position=tuple(place.tolist()), shadow=self.shadow) for place in places)

    def to_points(self, receivers: Array, count: int) -> Array:
        """Vectors to sample points, the same points for every receiver."""
        return np.asarray(np.asarray(self.position) + square(count) @ self.axes[:2] - receivers[:, None])

    def aims(self, points: Array, samples: int, generator: np.random.Generator) -> Iterator[tuple[Array, Array]]:
        """Points of a lattice that is shifted at random for each receiver."""
        right, up, _ = self.axes
        shift = generator.uniform(size=(2, len(points)))
        for row in range(samples):
            u = 2.0 * ((row / samples + shift[0]) % 1.0) - 1.0
            v = 2.0 * ((row * GOLDEN_SHARE + shift[1]) % 1.0) - 1.0
            yield unit_and_length(np.asarray(self.position) + u[:, None] * right + v[:, None] * up - points)

    def area_points(self, count: int, axes: Array) -> Array:
        """Sample points of the square from -1 to 1."""
        return square(count)

    def area_uniforms(self, axes: Array) -> dict[str, Any]:
        """Uniforms of pass/penumbra.frag: its axes."""
        return {"u_rect": axes @ self.axes.T}

    def uniforms(self, axes: Array) -> dict[str, Any]:
        """Uniforms of a local light, with its axes."""
        return {**super().uniforms(axes), "u_rect": axes @ self.axes.T}

    def gizmo(self, size: float, far: float) -> Gizmo:
        """Three lines along the world's axes."""
        return Gizmo(arms(np.asarray(self.position), size), rays=8)
