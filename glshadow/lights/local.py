"""LocalLight: what lights at a position have in common; SphereLight: what those have that shine from a sphere."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar, Self

import numpy as np

from glshadow.core.sample_patterns import GOLDEN_ANGLE, ball, disc
from glshadow.core.setting import number, optional, setting, vector
from glshadow.core.spaces import (
    FARTHEST,
    NEAREST,
    Array,
    Bools,
    ClipSpace,
    Triple,
    perpendicular,
    rigid_inverse,
    transform,
)
from glshadow.lights.light import FAR_HELP, NEAR_HELP, Light
from glshadow.shadows.view import FACES, Projection, ShadowView

# Shares of the far plane's distance: a derived near plane lies at the first, or before receivers that are nearer, but no nearer than the
# second. Casters nearer still cast, clamped to it (depth clamp), but do not darken what is nearer too. Only reversed float depth, which is
# near / depth, rounds alike whatever near is, and can afford a close one; of others the step at far is far / share of the format's.
USUAL_SHARE, NEAREST_SHARE = {True: 1e-4, False: 5e-3}, {True: 2.0**-30, False: 5e-3}


@dataclass(frozen=True, kw_only=True)
class LocalLight(Light):
    """Base of lights at a position. A heir that says nothing else has a map of six views."""

    position: Triple = setting(vector(3, -FARTHEST, FARTHEST), help="where the light is")
    range: float | None = setting(
        optional(number(NEAREST, FARTHEST), "no end"), None, help="distance at which the light has faded to nothing"
    )

    projection: ClassVar[Projection] = "cube"
    most_views: ClassVar[int] = 6
    beside_geometry: ClassVar[frozenset[str]] = Light.beside_geometry | {"range"}

    @property
    def place(self) -> tuple[float, float, float, float]:
        """Its position, and 1."""
        return (*self.position, 1.0)

    def rays_to(self, points: Array) -> Array:
        """From its position."""
        return np.asarray(points - np.asarray(self.position))

    def to_light(self, points: Array) -> tuple[Array, Array]:
        """To its position; where the light itself is, (0, 0, 0)."""
        offset = np.asarray(self.position) - points
        distance = np.linalg.norm(offset, axis=-1)
        return offset / np.where(distance > 0, distance, 1.0)[..., None], distance

    def relative_to(self, origin: Array) -> Self:
        """Its position moved."""
        return replace(self, position=tuple((np.asarray(self.position) - origin).tolist()))

    def turned(self, turn: Array, middle: Array) -> Self:
        """Its position turned."""
        return replace(self, position=tuple((middle + turn @ (np.asarray(self.position) - middle)).tolist()))

    def nudged(self, tilt: float, shift: float) -> Self:
        """Its position raised."""
        x, y, z = self.position
        return replace(self, position=(x, y + shift, z))

    def strength(self, points: Array) -> Array:
        """The window of its range, (1 - (d / range)^4)^2: glTF KHR_lights_punctual."""
        share = self.to_light(points)[1] * (0.0 if self.range is None else 1.0 / self.range)
        return np.asarray(np.maximum(1.0 - share**4, 0.0) ** 2)

    def reaches(self, points: Array) -> Bools:
        """Within its range too."""
        shone = self.shines_on(points)
        return shone if self.range is None else shone & (self.to_light(points)[1] < self.range)

    def touches(self, low: Array, high: Array) -> Bools:
        """Whether its ball does."""
        place, radius = np.asarray(self.position), self.source_radius
        return np.asarray(((low - radius <= place) & (place <= high + radius)).all(axis=1))

    def views(
        self, bodies: list[Array], casters: Array, clip: ClipSpace, resolution: int, guard: int, fine: bool
    ) -> tuple[ShadowView, ...]:
        """Up to six: those of the faces of a cube that see a receiver. One depth range: one metric across all faces."""
        found = [self.face_view(i, FACES[i], 1.0, bodies, clip, resolution, guard, fine) for i in range(len(FACES))]
        used = [view for view in found if view is not None]
        near, far = min((view.near for view in used), default=0.0), max((view.far for view in used), default=0.0)
        return tuple(replace(view, near=near, far=far) for view in used)

    def face_view(
        self, face: int, axes: Array, edge: float, bodies: list[Array], clip: ClipSpace, resolution: int, guard: int, fine: bool
    ) -> ShadowView | None:  # fmt: skip
        """A view with axes (3, 3) through a square window of half-width `edge`; None if it shows no receiver."""
        view, cube = rigid_inverse(axes, np.asarray(self.position)), self.projection == "cube"
        low, high, nearest, farthest, close = np.full(2, np.inf), np.full(2, -np.inf), np.inf, 0.0, np.inf
        for points in bodies:
            local = transform(view, points)
            depth = -local[:, 2]
            lateral = np.concatenate([local[:, :2], -local[:, :2]], axis=1)
            if depth.max() <= 0.0 or (lateral > edge * depth[:, None]).all(axis=0).any():
                continue  # behind the light, or wholly beyond one side of the window
            # the metric of a cube is the distance: sqrt(3) more in a corner
            reach = np.linalg.norm(local, axis=1) if cube else depth
            nearest, farthest = min(nearest, float(depth.min())), max(farthest, float(reach.max()))
            close = min(close, _distance_of_box(points, np.asarray(self.position)))
            if depth.min() <= USUAL_SHARE[True] * depth.max():
                low, high = np.full(2, -edge), np.full(2, edge)  # reaches around the light: every direction
            else:
                tangents = local[:, :2] / depth[:, None]
                low, high = np.minimum(low, tangents.min(axis=0)), np.maximum(high, tangents.max(axis=0))
        if farthest == 0.0:
            return None
        if cube:  # all faces share one window, so that they share the shader's scale
            low, high = np.full(2, -edge), np.full(2, edge)
        low, high = np.clip(low, -edge, edge), np.clip(high, -edge, edge)
        near, far = self.planes
        far = 1.001 * farthest if far is None else far
        if near is None:
            in_a_corner = 0.5 * close / float(np.hypot(1.0, np.sqrt(2.0) * edge))  # depth of what is so close there
            near = max(0.5 * nearest, min(USUAL_SHARE[fine] * far, in_a_corner), NEAREST_SHARE[fine] * far)
        half = 0.5 * np.maximum(high - low, 1e-6 * edge) * resolution / (resolution - 2 * guard)
        middle = 0.5 * (low + high)
        window = (
            float(middle[0] - half[0]), float(middle[0] + half[0]), float(middle[1] - half[1]), float(middle[1] + half[1]),
        )  # fmt: skip
        return ShadowView(self.projection, face, view, window, near, max(far, 1.001 * near), clip, resolution)

    def frame(self, views: Sequence[ShadowView], origin: Array) -> Array:
        """World axes about its position, for all faces."""
        return rigid_inverse(np.eye(3), np.asarray(self.position))

    def map_texel(self, points: Array, seen: Bools, resolution: int) -> Array | float:
        """The width of the cone, or of a cube's face, at the point's distance, divided by the resolution."""
        distance = np.linalg.norm(points - np.asarray(self.position), axis=-1)
        return np.asarray(2.0 * (1.0 if self.projection == "cube" else self.edge) / resolution * distance)

    def uniforms(self, axes: Array) -> dict[str, Any]:
        """Also its range and falloff."""
        return {**super().uniforms(axes), "u_reach": (0.0 if self.range is None else 1.0 / self.range, 0.0)}


@dataclass(frozen=True, kw_only=True)
class SphereLight(LocalLight):
    """Base of lights that shine from a sphere round their position, which is seen as a disc from everywhere."""

    near: float | None = setting(optional(number(NEAREST, FARTHEST)), None, help=NEAR_HELP)
    far: float | None = setting(optional(number(NEAREST, FARTHEST)), None, help=FAR_HELP)
    radius: float = setting(number(0.0, FARTHEST), 0.0, help="radius of the source, world units; 0 is a point")
    falloff: float = setting(number(0.0, 8.0), 0.0, help="exponent of the distance: 0 constant, 2 physical")

    sized_by: ClassVar[str] = "radius"
    beside_geometry: ClassVar[frozenset[str]] = LocalLight.beside_geometry | {"near", "far", "falloff"}
    penumbra: ClassVar[Mapping[str, int] | None] = {"GLS_RECT": 0}

    def strength(self, points: Array) -> Array:
        """The window of its range, and its falloff."""
        return np.asarray(super().strength(points) * np.maximum(self.to_light(points)[1], 1e-30) ** -self.falloff)

    @property
    def has_size(self) -> bool:
        """Whether it has a radius."""
        return self.radius > 0.0

    @property
    def source_radius(self) -> float:
        """Its radius."""
        return self.radius

    def hard_lights(self, count: int) -> tuple[Light, ...]:
        """Points of its ball that fill the disc evenly from every side."""
        return self._at(ball(count)) if self.has_size else (self,)

    def extremes(self) -> tuple[Light, ...]:
        """The corners of a cube round it."""
        signs = np.array([(x, y, z) for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)])
        return self._at(signs) if self.has_size else (self,)

    def _at(self, points: Array) -> tuple[Light, ...]:
        """Lights at points (N, 3) of the unit ball."""
        places = np.asarray(self.position) + self.radius * points
        return tuple(replace(self, position=tuple(place.tolist()), radius=0.0) for place in places)

    def to_points(self, receivers: Array, count: int) -> Array:
        """Of the disc that a receiver sees. It turns with the receiver by the shortest way from its axis, so that neighbours have nearly
        the same points, and there is a seam only opposite to that axis."""
        right, up, backward = self.disc_axes
        points = self.radius * disc(count)
        away = receivers - np.asarray(self.position)
        away /= np.linalg.norm(away, axis=1, keepdims=True)
        both = (away - backward) / np.maximum(1.0 - away @ backward, 1e-6)[:, None]
        rights, ups = right - (away @ right)[:, None] * both, up - (away @ up)[:, None] * both
        offsets = points[:, 0, None] * rights[:, None] + points[:, 1, None] * ups[:, None]
        return np.asarray(np.asarray(self.position) + offsets - receivers[:, None])

    def aims(self, points: Array, samples: int, generator: np.random.Generator) -> Iterator[tuple[Array, Array]]:
        """Rings of equal area of the disc, a golden angle apart (Vogel 1979); the place within a ring is random."""
        towards, distance = self.to_light(points)
        turn = generator.uniform(0.0, 2.0 * np.pi, len(points))
        u, v = perpendicular(towards)
        for ring in range(samples):
            radius = np.sqrt((ring + generator.uniform(size=len(points))) / samples)
            angle = turn + ring * GOLDEN_ANGLE
            point = self.radius * np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=-1)
            yield unit_and_length(towards * distance[:, None] + (u * point[:, :1] + v * point[:, 1:]))

    def area_points(self, count: int, axes: Array) -> Array:
        """Of the unit disc."""
        return disc(count)

    @property
    def planes(self) -> tuple[float | None, float | None]:
        """As given."""
        return (self.near, self.far)

    def uniforms(self, axes: Array) -> dict[str, Any]:
        """Also its range and falloff."""
        return {**super().uniforms(axes), "u_reach": (0.0 if self.range is None else 1.0 / self.range, self.falloff)}


def unit_and_length(vectors: Array) -> tuple[Array, Array]:
    """Vectors (N, 3) scaled to length 1, and their lengths (N,); zero stays zero."""
    length = np.sqrt(np.einsum("ij,ij->i", vectors, vectors))
    return vectors / np.where(length > 0.0, length, 1.0)[:, None], length


def _distance_of_box(points: Array, position: Array) -> float:
    """From a position to the box along the world's axes around points (N, 3)."""
    return float(
        np.linalg.norm(np.maximum(np.maximum(points.min(axis=0) - position, position - points.max(axis=0)), 0.0))
    )
