"""A light as rays ask it: relative to their origin, at its middle or at points of its size."""

from __future__ import annotations

import numpy as np

from glshadow.core.area import GOLDEN_ANGLE, radius_of
from glshadow.core.lights import DirectionalLight, Light, to_light
from glshadow.core.spaces import Array, Bools
from glshadow.reference.rays import LIFT, Ints, Rays, dot


class AimedLight:
    """A light relative to the rays' origin."""

    def __init__(self, light: Light, origin: Array) -> None:
        self.light = light
        self.position = None if isinstance(light, DirectionalLight) else np.asarray(light.position) - origin

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
        towards, distance = self.towards(points)
        total = np.zeros(len(own))
        samples = samples if self.spread > 0.0 else 1
        u, v = perpendicular(towards)
        turn = generator.uniform(0.0, 2.0 * np.pi, len(own)) if samples > 1 else np.zeros(len(own))
        for number in range(samples):
            # Rings of equal area, a golden angle apart (Vogel); the place within the ring is random.
            place = generator.uniform(size=len(own)) if samples > 1 else 0.0
            radius = np.sqrt((number + place) / samples) * self.spread if samples > 1 else 0.0
            angle = turn + number * GOLDEN_ANGLE
            offset = u * (radius * np.cos(angle))[:, None] + v * (radius * np.sin(angle))[:, None]
            aim = towards + offset if self.position is None else towards * distance[:, None] + offset
            length = np.sqrt(dot(aim, aim))
            aim = aim / np.where(length > 0.0, length, 1.0)[:, None]
            end = distance if self.position is None else length
            open_to = dot(normals, aim) > 0.0
            if self.light.shadow is not None:
                asked = open_to & rays.receives[own]
                open_to[asked] = ~rays.blocked(own[asked], points[asked], aim[asked], end[asked])[0]
            total += open_to
        mean = total / samples
        return mean, mean * (1.0 - mean)

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
