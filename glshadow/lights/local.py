"""LocalLight: base of lights at a position. SphereLight: base of those that shine from a sphere."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar, Self

import numpy as np

from glshadow.core.sample_patterns import ball, disc, disc_rings
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

# Shares of the far plane's distance. A derived near plane is at the first share, or in front of nearer receivers, but never nearer
# than the second. Casters nearer still are clamped to it (depth clamp) and still cast, but do not darken nearer receivers. Only reversed
# float depth, near / depth, rounds alike for any near plane and allows a close one; otherwise the depth step at far is far / share
# times the format's.
USUAL_SHARE, NEAREST_SHARE = {True: 1e-4, False: 5e-3}, {True: 2.0**-30, False: 5e-3}


@dataclass(frozen=True, kw_only=True)
class LocalLight(Light):
    """Base of lights at a position. By default the shadow map has six views."""

    position: Triple = setting(vector(3, -FARTHEST, FARTHEST), help="position of the light")
    range: float | None = setting(
        optional(number(NEAREST, FARTHEST), "no end"), None, help="distance at which the light has faded to zero"
    )

    projection: ClassVar[Projection] = "cube"
    most_views: ClassVar[int] = 6
    beside_geometry: ClassVar[frozenset[str]] = Light.beside_geometry | {"range"}

    @property
    def place(self) -> tuple[float, float, float, float]:
        """Homogeneous position: (x, y, z, 1)."""
        return (*self.position, 1.0)

    def rays_to(self, points: Array) -> Array:
        """Vectors from its position to the points."""
        return np.asarray(points - np.asarray(self.position))

    def to_light(self, points: Array) -> tuple[Array, Array]:
        """Unit vectors to its position; (0, 0, 0) at the light's own position."""
        offset = np.asarray(self.position) - points
        distance = np.linalg.norm(offset, axis=-1)
        return offset / np.where(distance > 0, distance, 1.0)[..., None], distance

    def relative_to(self, origin: Array) -> Self:
        """The light with its position moved."""
        return replace(self, position=tuple((np.asarray(self.position) - origin).tolist()))

    def turned(self, turn: Array, middle: Array) -> Self:
        """The light with its position rotated."""
        return replace(self, position=tuple((middle + turn @ (np.asarray(self.position) - middle)).tolist()))

    def nudged(self, tilt: float, shift: float) -> Self:
        """The light with its position raised."""
        x, y, z = self.position
        return replace(self, position=(x, y + shift, z))

    def strength(self, points: Array) -> Array:
        """The window of its range, (1 - (d / range)^4)^2 (glTF KHR_lights_punctual)."""
        share = self.to_light(points)[1] * (0.0 if self.range is None else 1.0 / self.range)
        return np.asarray(np.maximum(1.0 - share**4, 0.0) ** 2)

    def reaches(self, points: Array) -> Bools:
        """Whether points are lit and within the range."""
        shone = self.shines_on(points)
        return shone if self.range is None else shone & (self.to_light(points)[1] < self.range)

    def touches(self, low: Array, high: Array) -> Bools:
        """Whether the ball that holds the source overlaps the boxes."""
        place, radius = np.asarray(self.position), self.source_radius
        return np.asarray(((low - radius <= place) & (place <= high + radius)).all(axis=1))

    def views(
        self, bodies: list[Array], casters: Array, clip: ClipSpace, resolution: int, guard: int, fine: bool
    ) -> tuple[ShadowView, ...]:
        """Up to six views: the cube faces that see a receiver. All faces share one depth range, hence one metric."""
        found = [self.face_view(i, FACES[i], 1.0, bodies, clip, resolution, guard, fine) for i in range(len(FACES))]
        used = [view for view in found if view is not None]
        near, far = min((view.near for view in used), default=0.0), max((view.far for view in used), default=0.0)
        return tuple(replace(view, near=near, far=far) for view in used)

    def face_view(
        self, face: int, axes: Array, edge: float, bodies: list[Array], clip: ClipSpace, resolution: int, guard: int, fine: bool
    ) -> ShadowView | None:  # fmt: skip
        """A view with axes (3, 3) through a square window of half-width `edge`. None if it sees no receiver."""
        view, cube = rigid_inverse(axes, np.asarray(self.position)), self.projection == "cube"
        low, high, nearest, farthest, close = np.full(2, np.inf), np.full(2, -np.inf), np.inf, 0.0, np.inf
        for points in bodies:
            local = transform(view, points)
            depth = -local[:, 2]
            lateral = np.concatenate([local[:, :2], -local[:, :2]], axis=1)
            if depth.max() <= 0.0 or (lateral > edge * depth[:, None]).all(axis=0).any():
                continue  # behind the light, or entirely outside one side of the window
            # the metric of a cube is the distance: larger by sqrt(3) in a corner
            reach = np.linalg.norm(local, axis=1) if cube else depth
            nearest, farthest = min(nearest, float(depth.min())), max(farthest, float(reach.max()))
            close = min(close, _distance_of_box(points, np.asarray(self.position)))
            if depth.min() <= USUAL_SHARE[True] * depth.max():
                low, high = np.full(2, -edge), np.full(2, edge)  # contains the light: every direction
            else:
                tangents = local[:, :2] / depth[:, None]
                low, high = np.minimum(low, tangents.min(axis=0)), np.maximum(high, tangents.max(axis=0))
        if farthest == 0.0:
            return None
        if cube:  # all faces share one window, so that the shader uses one scale
            low, high = np.full(2, -edge), np.full(2, edge)
        low, high = np.clip(low, -edge, edge), np.clip(high, -edge, edge)
        near, far = self.planes
        far = 1.001 * farthest if far is None else far
        if near is None:
            # depth of a caster that close, in a corner
            in_a_corner = 0.5 * close / float(np.hypot(1.0, np.sqrt(2.0) * edge))
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
        """Texel width: the width of the cone or cube face at the point's distance, divided by the resolution."""
        distance = np.linalg.norm(points - np.asarray(self.position), axis=-1)
        return np.asarray(2.0 * (1.0 if self.projection == "cube" else self.edge) / resolution * distance)

    def uniforms(self, axes: Array) -> dict[str, Any]:
        """Uniforms of a light, with its range and falloff."""
        return {**super().uniforms(axes), "u_reach": (0.0 if self.range is None else 1.0 / self.range, 0.0)}


@dataclass(frozen=True, kw_only=True)
class SphereLight(LocalLight):
    """Base of lights that shine from a sphere around their position. Every receiver sees a disc."""

    near: float | None = setting(optional(number(NEAREST, FARTHEST)), None, help=NEAR_HELP)
    far: float | None = setting(optional(number(NEAREST, FARTHEST)), None, help=FAR_HELP)
    radius: float = setting(number(0.0, FARTHEST), 0.0, help="radius of the source, world units; 0 is a point")
    falloff: float = setting(number(0.0, 8.0), 0.0, help="exponent of the distance: 0 constant, 2 physical")

    sized_by: ClassVar[str] = "radius"
    beside_geometry: ClassVar[frozenset[str]] = LocalLight.beside_geometry | {"near", "far", "falloff"}
    penumbra: ClassVar[Mapping[str, int] | None] = {"GLS_RECT": 0}

    def strength(self, points: Array) -> Array:
        """The window of its range, times its falloff."""
        return np.asarray(super().strength(points) * np.maximum(self.to_light(points)[1], 1e-30) ** -self.falloff)

    @property
    def has_size(self) -> bool:
        """Whether the radius is positive."""
        return self.radius > 0.0

    @property
    def source_radius(self) -> float:
        """The radius of the sphere."""
        return self.radius

    def hard_lights(self, count: int) -> tuple[Light, ...]:
        """Hard lights at points of the ball that cover the visible disc evenly from every side."""
        return self._at(ball(count)) if self.has_size else (self,)

    def extremes(self) -> tuple[Light, ...]:
        """Hard lights at the corners of a cube around the sphere."""
        signs = np.array([(x, y, z) for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)])
        return self._at(signs) if self.has_size else (self,)

    def _at(self, points: Array) -> tuple[Light, ...]:
        """Hard lights at points (N, 3) of the unit ball."""
        places = np.asarray(self.position) + self.radius * points
        return tuple(replace(self, position=tuple(place.tolist()), radius=0.0) for place in places)

    def to_points(self, receivers: Array, count: int) -> Array:
        """Vectors to points of the disc that a receiver sees. The disc is turned from its axis to the receiver by the shortest rotation:
        neighbours get nearly the same points, and the only seam is opposite to the axis."""
        right, up, backward = self.disc_axes
        points = self.radius * disc(count)
        away = receivers - np.asarray(self.position)
        away /= np.linalg.norm(away, axis=1, keepdims=True)
        both = (away - backward) / np.maximum(1.0 - away @ backward, 1e-6)[:, None]
        rights, ups = right - (away @ right)[:, None] * both, up - (away @ up)[:, None] * both
        offsets = points[:, 0, None] * rights[:, None] + points[:, 1, None] * ups[:, None]
        return np.asarray(np.asarray(self.position) + offsets - receivers[:, None])

    def aims(self, points: Array, samples: int, generator: np.random.Generator) -> Iterator[tuple[Array, Array]]:
        """Points in rings of equal area of the disc that faces each receiver, see `disc_rings`."""
        towards, distance = self.to_light(points)
        u, v = perpendicular(towards)
        for each in disc_rings(len(points), samples, generator):
            point = self.radius * each
            yield unit_and_length(towards * distance[:, None] + (u * point[:, :1] + v * point[:, 1:]))

    def area_points(self, count: int, axes: Array) -> Array:
        """Sample points of the unit disc."""
        return disc(count)

    @property
    def planes(self) -> tuple[float | None, float | None]:
        """Near and far as given."""
        return (self.near, self.far)

    def uniforms(self, axes: Array) -> dict[str, Any]:
        """Uniforms of a local light, with its range and falloff."""
        return {**super().uniforms(axes), "u_reach": (0.0 if self.range is None else 1.0 / self.range, self.falloff)}


def unit_and_length(vectors: Array) -> tuple[Array, Array]:
    """Vectors (N, 3) scaled to length 1, and their lengths (N,); zero stays zero."""
    length = np.sqrt(np.einsum("ij,ij->i", vectors, vectors))
    return vectors / np.where(length > 0.0, length, 1.0)[:, None], length


def _distance_of_box(points: Array, position: Array) -> float:
    """Distances from a position to the axis-aligned box around points (N, 3)."""
    return float(
        np.linalg.norm(np.maximum(np.maximum(points.min(axis=0) - position, position - points.max(axis=0)), 0.0))
    )
