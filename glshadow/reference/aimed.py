"""A light as rays ask it: relative to their origin, at its middle or at points of its size."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import islice

import numpy as np

from glshadow.core.area import cap_tangents, has_size, radius_of
from glshadow.core.lights import DirectionalLight, Light, RectLight, SkyLight, to_light
from glshadow.core.panel import panel_axes
from glshadow.core.sample_patterns import GOLDEN_ANGLE, GOLDEN_SHARE
from glshadow.core.spaces import Array, Bools, view_axes
from glshadow.reference.rays import LIFT, Ints, Rays, dot
from glshadow.reference.receivers import Receivers

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

    def receivers(self, rays: Rays, own: Ints, points: Array, side: Array, whole: bool = True) -> Receivers:
        """What asks it: points (N, 3) on triangles (N,) seen from the side that vectors (N, 3) point to.

        `whole`: all of a light that has a size is asked, else its middle.
        """
        spread = self.spread if whole and not isinstance(self.light, SkyLight) else 0.0

        def lowest(places: Array, faces: Array) -> Array:
            towards, distance = self.towards(places)
            middle = dot(towards, faces)
            away = 1.0 if self.position is None else np.maximum(distance, 1e-300)
            return np.asarray(middle - spread / away * np.sqrt(np.maximum(1.0 - middle * middle, 0.0)))

        return Receivers.of(rays, own, points, side, lowest)

    def visibility(
        self, rays: Rays, own: Ints, points: Array, side: Array, samples: int, generator: np.random.Generator
    ) -> tuple[Array, Array]:
        """Mean and variance (N,) over samples of the source seen from points (N, 3) on triangles (N,), from the side that vectors (N, 3)
        point to; parts of it below their horizon count as dark."""
        many = samples > 1 and has_size(self.light)
        samples = samples if many else 1
        receivers = self.receivers(rays, own, points, side, many)
        points, count = receivers.points, len(own)
        total, weights = np.zeros((2, count))
        aims = self._aims(points, samples, generator) if many else iter([self.towards(points)])
        while batch := list(islice(aims, max(TOGETHER // max(count, 1), 1))):
            aim, end = (np.concatenate(each) for each in zip(*batch, strict=True))
            asking = receivers.tiled(len(batch))
            cosine, open_to = dot(asking.normals, aim), asking.open_to(aim)
            if isinstance(self.light, RectLight):
                open_to &= (asking.points - self._place) @ np.asarray(self.light.direction) > 0.0
            weight = np.maximum(cosine, 0.0) if many and isinstance(self.light, SkyLight) else np.ones(len(aim))
            if self.light.shadow is not None:
                asked = open_to & rays.receives[asking.own]
                open_to[asked] = ~asking.blocked(rays, aim[asked], end[asked], asked)
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

    def lit(self, rays: Rays, own: Ints, points: Array, side: Array) -> Bools:
        """Whether the middle of the light sees points (N, 3) on triangles (N,), also below their horizon; of smooth meshes those over
        the side that vectors (N, 3) point to."""
        if self.light.shadow is None:
            return np.ones(len(own), dtype=bool)
        receivers = self.receivers(rays, own, points, side, False)
        return ~receivers.blocked(rays, *self.towards(receivers.points)) | ~rays.receives[receivers.own]


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
