"""A light as rays ask it: relative to their origin, at its middle or at points of its size."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import islice

import numpy as np

from glshadow.core.area import cap_tangents, has_size, radius_of
from glshadow.core.lights import DirectionalLight, Light, RectLight, SkyLight, to_light
from glshadow.core.panel import panel_axes
from glshadow.core.spaces import Array, Bools, view_axes
from glshadow.core.spread import GOLDEN_ANGLE, GOLDEN_SHARE
from glshadow.reference.rays import LIFT, Ints, Rays, dot

TOGETHER = 2**14
"""Rays asked at once: fewer cost more for the asking than for the answer."""


class AimedLight:
    """A light relative to the rays' origin."""

    def __init__(self, light: Light, origin: Array) -> None:
        self.light = light
        self.position = None if isinstance(light, DirectionalLight) else np.asarray(light.position) - origin

    @property
    def _place(self) -> Array:
        assert self.position is not None
        return self.position

    def towards(self, points: Array) -> tuple[Array, Array]:
        """Unit vectors (N, 3) to the light and distances (N,)."""
        if self.position is None:
            return to_light(self.light, points)
        offset = self.position - points
        distance = np.sqrt(dot(offset, offset))
        return offset / np.where(distance > 0.0, distance, 1.0)[:, None], distance

    @property
    def spread(self) -> float:
        """Radius of the source as a tangent seen from the receiver (sun), or in world units."""
        return radius_of(self.light)

    def visibility(
        self, rays: Rays, own: Ints, points: Array, normals: Array, samples: int, generator: np.random.Generator
    ) -> tuple[Array, Array]:
        """Mean and variance (N,) over samples of the source seen from points (N, 3) on triangles (N,); parts of it below a point's
        horizon count as dark."""
        many = samples > 1 and has_size(self.light)
        samples = samples if many else 1
        count = len(own)
        total, weights = np.zeros((2, count))
        aims = self._aims(points, samples, generator) if many else iter([self.towards(points)])
        while batch := list(islice(aims, max(TOGETHER // max(count, 1), 1))):
            aim, end = (np.concatenate(each) for each in zip(*batch, strict=True))
            triangle, point = np.tile(own, len(batch)), np.tile(points, (len(batch), 1))
            cosine = dot(np.tile(normals, (len(batch), 1)), aim)
            open_to = cosine > 0.0
            if isinstance(self.light, RectLight):
                open_to &= (point - self._place) @ np.asarray(self.light.direction) > 0.0
            weight = np.maximum(cosine, 0.0) if many and isinstance(self.light, SkyLight) else np.ones(len(aim))
            if self.light.shadow is not None:
                asked = open_to & rays.receives[triangle]
                open_to[asked] = ~rays.blocked(triangle[asked], point[asked], aim[asked], end[asked])[0]
            total += (weight * open_to).reshape(-1, count).sum(axis=0)
            weights += weight.reshape(-1, count).sum(axis=0)
        mean = total / np.where(weights > 0.0, weights, 1.0)
        return mean, mean * (1.0 - mean)

    def _aims(self, points: Array, samples: int, generator: np.random.Generator) -> Iterator[tuple[Array, Array]]:
        """Unit vectors (N, 3) and distances (N,) to points of the source, one of each equal share of it, at random within it."""
        towards, distance = self.towards(points)
        light, count = self.light, len(points)
        if isinstance(light, RectLight):
            right, up, _ = panel_axes(light)
            shift = generator.uniform(size=(2, count))  # a lattice, moved at random from pixel to pixel
            for number in range(samples):
                u = 2.0 * ((number / samples + shift[0]) % 1.0) - 1.0
                v = 2.0 * ((number * GOLDEN_SHARE + shift[1]) % 1.0) - 1.0
                offset = self._place + u[:, None] * right + v[:, None] * up - points
                length = np.sqrt(dot(offset, offset))
                yield offset / np.where(length > 0.0, length, 1.0)[:, None], length
            return
        turn = generator.uniform(0.0, 2.0 * np.pi, count)
        if isinstance(light, SkyLight):
            axes = view_axes(np.asarray(light.direction))
            for number in range(samples):
                height = (number + generator.uniform(size=count)) / samples
                across, angle = np.sqrt(1.0 - height**2), turn + number * GOLDEN_ANGLE
                yield np.stack([across * np.cos(angle), across * np.sin(angle), height], axis=-1) @ axes, distance
            return
        u, v = perpendicular(towards)
        for number in range(samples):
            # Rings of equal area, or a sun's of equal solid angle, a golden angle apart (Vogel); the place within the ring is random.
            radius = np.sqrt((number + generator.uniform(size=count)) / samples)
            angle = turn + number * GOLDEN_ANGLE
            point = np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=-1)
            point = cap_tangents(light, point) if isinstance(light, DirectionalLight) else self.spread * point
            offset = u * point[:, :1] + v * point[:, 1:]
            aim = towards + offset if self.position is None else towards * distance[:, None] + offset
            length = np.sqrt(dot(aim, aim))
            yield aim / np.where(length > 0.0, length, 1.0)[:, None], distance if self.position is None else length

    def lit(self, rays: Rays, own: Ints, points: Array) -> Bools:
        """Whether the middle of the light sees points (N, 3) on triangles (N,), whichever side they are seen from."""
        if self.light.shadow is None:
            return np.ones(len(own), dtype=bool)
        return ~rays.blocked(own, points, *self.towards(points))[0] | ~rays.receives[own]


def perpendicular(directions: Array) -> tuple[Array, Array]:
    """Two unit vectors (N, 3) that span the plane perpendicular to unit vectors (N, 3)."""
    axis = np.eye(3)[np.abs(directions).argmin(axis=1)]
    u = np.cross(axis, directions)
    u /= np.linalg.norm(u, axis=1, keepdims=True)
    return u, np.cross(directions, u)


def moved_over(
    rays: Rays, source: AimedLight, own: Ints, points: Array, reach: Array, angle: float
) -> tuple[Ints, Array]:
    """Points moved in the light plane and put back on the nearest surface along the light; triangles and points."""
    towards, _ = source.towards(points)
    u, v = perpendicular(towards)
    moved = points + reach[:, None] * (np.cos(angle) * u + np.sin(angle) * v)
    ray, distance = source.towards(moved)
    # Onto the plane of the own triangle, as long as that is not behind the light.
    normal, slope = rays.normals[own], dot(rays.normals[own], ray)
    step = -rays.plane_distance(own, moved) / np.where(slope == 0.0, 1.0, slope)
    step = np.where((slope == 0.0) | (step >= distance), 0.0, step)
    start = moved + step[:, None] * ray
    # Both rays start on the other side of the plane, so that a surface at the point itself is found by both.
    back = (normal * np.sign(slope)[:, None]) * (2.0 * LIFT * rays.reach[own])[:, None]
    found, place, gap = own, start, np.full(len(own), np.inf)
    for sign, length in ((-1.0, np.full(len(own), np.inf)), (1.0, np.maximum(distance - step, 0.0))):
        hit, at = rays.first_hits(start - sign * back, sign * ray, length)
        far = np.where(hit >= 0, np.linalg.norm(at - start, axis=1), np.inf)
        nearer = far < gap
        found, gap = np.where(nearer, hit, found), np.where(nearer, far, gap)
        place = np.where(nearer[:, None], at, place)
    return found, place
