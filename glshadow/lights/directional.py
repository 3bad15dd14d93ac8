"""DirectionalLight: parallel light, such as the sun's."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np

from glshadow.core.sample_patterns import disc, disc_rings
from glshadow.core.setting import instance, number, optional, setting
from glshadow.core.spaces import (
    FARTHEST,
    Array,
    ClipSpace,
    Triple,
    direction,
    perpendicular,
    rigid_inverse,
    view_axes,
)
from glshadow.core.spelling import vector
from glshadow.geometry.fitting import minimum_rectangle
from glshadow.lights.distant import DistantLight
from glshadow.lights.light import FAR_HELP, NEAR_HELP, Light
from glshadow.shadows.cookie import Cookie
from glshadow.shadows.filters import Filter
from glshadow.shadows.filters.filter import Needs
from glshadow.shadows.view import ShadowView


@dataclass(frozen=True, kw_only=True)
class DirectionalLight(DistantLight):
    """Parallel light from infinitely far away: the sun.

    Parameters
    ----------
    direction : (3,) floats
        The direction in which the light travels; any length but zero. A directional light has no position.
    color, intensity
        Linear RGB factor, and its strength: a white surface that faces the light receives color * intensity.
    angle : float
        Angular diameter of the source, degrees in [0, 90): 0.53 for the sun. 0 is a point at infinity.
    cookie : Cookie, optional
        An image projected along the light that colours it.
    near, far : float, optional
        Depth range of the shadow map along the light, world units from the world origin; None derives it.
    shadow : Shadow or None
        Settings of its shadow. None: the light casts no shadow and draws no shadow map.
    """

    direction: Triple = setting(direction, (-0.55, -0.8, -0.25), help="direction in which the light travels")
    near: float | None = setting(optional(number(-FARTHEST, FARTHEST)), None, help=NEAR_HELP)
    far: float | None = setting(optional(number(-FARTHEST, FARTHEST)), None, help=FAR_HELP)
    angle: float = setting(
        number(0.0, 90.0, unit="degrees", below=True),
        0.0,
        help="angular diameter of the source, degrees; 0.53 for the sun",
    )
    cookie: Cookie | None = setting(optional(instance(Cookie), "none"), None, help="an image that it projects")

    spelling: ClassVar[str] = "sun"
    usage: ClassVar[str] = "sun:dx,dy,dz"
    summary: ClassVar[str] = "parallel light; angle=0.53 is the sun's"
    by_place: ClassVar[tuple[str, ...]] = ("direction",)
    places: ClassVar[tuple[int, int]] = (1, 1)
    snippet: ClassVar[str] = "light/directional.glsl"
    most_views: ClassVar[int] = 1
    sized_by: ClassVar[str] = "angle"
    beside_geometry: ClassVar[frozenset[str]] = DistantLight.beside_geometry | {"near", "far", "cookie"}
    penumbra: ClassVar[Mapping[str, int] | None] = {"GLS_RECT": 0}

    @classmethod
    def from_places(cls, texts: Sequence[str]) -> dict[str, Any]:
        """Read the direction."""
        return {"direction": vector(texts[0])}

    @property
    def projected(self) -> tuple[Cookie, Array] | None:
        """The cookie and its matrix, projected along the light. The centre of the first image is on the line through the world origin."""
        if self.cookie is None:
            return None
        height, width = self.cookie.image.shape[:2]
        matrix = np.eye(4)
        matrix[:3, :3] = view_axes(np.asarray(self.direction))
        across = 1.0 / self.cookie.size
        image = np.array([[across, 0, 0, 0.5], [0, across * width / height, 0, 0.5], [0, 0, 1, 0], [0, 0, 0, 1.0]])
        return self.cookie, np.asarray(image @ matrix)

    # -- size: a cap of directions

    @property
    def has_size(self) -> bool:
        """Whether the light has an angular diameter."""
        return self.angle > 0.0

    @property
    def source_radius(self) -> float:
        """Tangent of half the angular diameter."""
        return float(np.tan(np.radians(0.5 * self.angle)))

    def filter_for(self, requested: Filter) -> Filter:
        """With an angle it is light from many directions."""
        return requested if self.has_size and requested.needs is Needs.DIRECTIONS else super().filter_for(requested)

    def hard_lights(self, count: int) -> tuple[Light, ...]:
        """Hard directional lights in directions of equal solid angle."""
        if not self.has_size:
            return (self,)
        right, up, towards = self.disc_axes
        offsets = self.cap_tangents(disc(count))
        return self._pointing(towards + offsets[:, :1] * right + offsets[:, 1:] * up)

    def extremes(self) -> tuple[Light, ...]:
        """Hard directional lights at the corners of an octagon around the disc."""
        if not self.has_size:
            return (self,)
        right, up, towards = self.disc_axes
        turns = np.pi / 4.0 * np.arange(8)
        reach = self.source_radius / np.cos(np.pi / 8.0)
        return self._pointing(towards + reach * (np.cos(turns)[:, None] * right + np.sin(turns)[:, None] * up))

    def _pointing(self, aims: Array) -> tuple[Light, ...]:
        """Hard directional lights that receivers see in directions (N, 3)."""
        return tuple(replace(self, direction=tuple((-aim).tolist()), angle=0.0) for aim in aims)

    def to_points(self, receivers: Array, count: int) -> Array:
        """Directions to the light's sample points, the same for every receiver."""
        right, up, backward = self.disc_axes
        tangents = self.cap_tangents(disc(count))
        aims = backward + tangents[:, :1] * right + tangents[:, 1:] * up
        return np.broadcast_to(aims, (len(receivers), count, 3))

    def aims(self, points: Array, samples: int, generator: np.random.Generator) -> Iterator[tuple[Array, Array]]:
        """Directions in rings of equal solid angle, see `disc_rings`."""
        towards, distance = self.to_light(points)
        u, v = perpendicular(towards)
        for each in disc_rings(len(points), samples, generator):
            point = self.cap_tangents(each)
            aim = towards + (u * point[:, :1] + v * point[:, 1:])
            yield aim / np.sqrt(np.einsum("ij,ij->i", aim, aim))[:, None], distance

    def cap_tangents(self, points: Array) -> Array:
        """Points of the unit disc (..., 2) as tangents from its middle. Equal areas map to equal solid angles.

        The angle t holds the share (1 - cos t) / (1 - cos a) = (sin(t/2) / sin(a/2))^2 of a cap with half-angle a; the radius r holds the
        share r^2 of the disc. So sin(t/2) = r sin(a/2): Lambert's azimuthal equal-area projection.
        """
        scale = np.sin(0.25 * np.radians(self.angle))
        squared = (scale**2) * (points**2).sum(axis=-1, keepdims=True)
        return np.asarray(points * (2.0 * scale * np.sqrt(1.0 - squared) / (1.0 - 2.0 * squared)))

    def area_points(self, count: int, axes: Array) -> Array:
        """Sample points as tangents, in world axes so that they do not rotate with the frame."""
        return np.asarray(self.cap_tangents(disc(count)) @ (self.disc_axes[:2] @ axes[:2].T))

    # -- shadow map

    @property
    def planes(self) -> tuple[float | None, float | None]:
        """Near and far as given."""
        return (self.near, self.far)

    def views(
        self, bodies: list[Array], casters: Array, clip: ClipSpace, resolution: int, guard: int, fine: bool
    ) -> tuple[ShadowView, ...]:
        """One view, fitted to the receivers' rectangle of least area."""
        points = np.concatenate(bodies)
        origin = 0.5 * (points.min(axis=0) + points.max(axis=0))
        axes = view_axes(np.asarray(self.direction))
        flat = (points - origin) @ axes.T
        angle, rectangle = minimum_rectangle(flat[:, :2])
        cosine, sine = np.cos(angle), np.sin(angle)
        axes = np.array([[cosine, sine, 0.0], [-sine, cosine, 0.0], [0.0, 0.0, 1.0]]) @ axes
        size = np.maximum(np.ptp(rectangle, axis=0), 1e-6 * max(np.ptp(points, axis=0).max(), 1e-300))
        origin = origin + rectangle.mean(axis=0) @ axes[:2]
        half = 0.5 * size * (resolution / (resolution - 2 * guard)) if resolution > 2 * guard else 0.5 * size
        near, far = self.depth_range(points, casters, axes, origin, float(size.max()))
        window = (-float(half[0]), float(half[0]), -float(half[1]), float(half[1]))
        return (ShadowView(self.projection, 0, rigid_inverse(axes, origin), window, near, far, clip, resolution),)
