"""A light relative to the origin of the rays, as its middle or as points on its area."""

from __future__ import annotations

from itertools import islice

import numpy as np

from glshadow.core.spaces import Array, Bools, perpendicular
from glshadow.lights import Light
from glshadow.reference.embree import Ints, dot
from glshadow.reference.rays import LIFT, Rays
from glshadow.reference.receivers import Receivers

TOGETHER = 2**14
"""Rays traced at once: with fewer, the overhead is larger than the tracing."""


class AimedLight:
    """A light relative to the rays' origin."""

    def __init__(self, light: Light, origin: Array) -> None:
        self.light = light.relative_to(origin)

    def towards(self, points: Array) -> tuple[Array, Array]:
        """Unit vectors (N, 3) to the light and distances (N,)."""
        return self.light.to_light(points)

    def receivers(self, rays: Rays, own: Ints, points: Array, side: Array, whole: bool = True) -> Receivers:
        """Receivers at points (N, 3) on triangles (N,), on the side that vectors (N, 3) point to.

        `whole`: for all points of a light that has a size, otherwise for its middle.
        """
        spread = self.light.source_radius if whole else 0.0

        def lowest(places: Array, faces: Array) -> Array:
            towards, distance = self.towards(places)
            middle = dot(towards, faces)
            away = 1.0 if self.light.at_infinity else np.maximum(distance, 1e-300)
            return np.asarray(middle - spread / away * np.sqrt(np.maximum(1.0 - middle * middle, 0.0)))

        return Receivers.of(rays, own, points, side, lowest)

    def visibility(
        self, rays: Rays, own: Ints, points: Array, side: Array, samples: int, generator: np.random.Generator
    ) -> tuple[Array, Array]:
        """Mean and variance (N,) of visibility over samples of the light, from points (N, 3) on triangles (N,) on the side that vectors
        (N, 3) point to. Samples below the horizon count as dark."""
        many = samples > 1 and self.light.has_size
        samples = samples if many else 1
        receivers = self.receivers(rays, own, points, side, many)
        points, count = receivers.points, len(own)
        total, weights = np.zeros((2, count))
        aims = self.light.aims(points, samples, generator) if many else iter([self.towards(points)])
        while batch := list(islice(aims, max(TOGETHER // max(count, 1), 1))):
            aim, end = (np.concatenate(each) for each in zip(*batch, strict=True))
            repeated = receivers.tiled(len(batch))
            cosine, open_to = dot(repeated.normals, aim), repeated.open_to(aim)
            open_to &= self.light.shines_on(repeated.points)
            weight = np.maximum(cosine, 0.0) if many and self.light.weighted else np.ones(len(aim))
            if self.light.shadow is not None:
                tested = open_to & rays.receives[repeated.own]
                open_to[tested] = ~repeated.blocked(rays, aim[tested], end[tested], tested)
            total += (weight * open_to).reshape(-1, count).sum(axis=0)
            weights += weight.reshape(-1, count).sum(axis=0)
        mean = total / np.where(weights > 0.0, weights, 1.0)
        return mean, mean * (1.0 - mean)

    def lit(self, rays: Rays, own: Ints, points: Array, side: Array) -> Bools:
        """Whether the middle of the light shines on points (N, 3) on triangles (N,) unoccluded, also from below their horizon. Points of
        smooth meshes are moved to the side that vectors (N, 3) point to."""
        receivers = self.receivers(rays, own, points, side, False)
        shone = self.light.shines_on(receivers.points)
        if self.light.shadow is None:
            return shone
        return shone & (~receivers.blocked(rays, *self.towards(receivers.points)) | ~rays.receives[receivers.own])


def moved_over(
    rays: Rays, source: AimedLight, own: Ints, points: Array, reach: Array, angle: float
) -> tuple[Ints, Array]:
    """Points moved in the light plane and projected along the light to the nearest surface; returns triangles and points."""
    towards, _ = source.towards(points)
    u, v = perpendicular(towards)
    moved = points + reach[:, None] * (np.cos(angle) * u + np.sin(angle) * v)
    ray, distance = source.towards(moved)
    # Onto the plane of the point's own triangle, unless that is behind the light.
    normal = rays.facing(own, points)
    slope = dot(normal, ray)
    step = -rays.tangent_distance(own, points, moved) / np.where(slope == 0.0, 1.0, slope)
    step = np.where((slope == 0.0) | (step >= distance), 0.0, step)
    start = moved + step[:, None] * ray
    # Both rays start on the other side of the plane, so that both find a surface at the point itself.
    back = (normal * np.sign(slope)[:, None]) * (2.0 * LIFT * rays.reach[own])[:, None]
    found, place, gap = own, start, np.full(len(own), np.inf)
    for sign, length in ((-1.0, np.full(len(own), np.inf)), (1.0, np.maximum(distance - step, 0.0))):
        hit, at = rays.first_hits(start - sign * back, sign * ray, length)
        far = np.where(hit >= 0, np.linalg.norm(at - start, axis=1), np.inf)
        nearer = far < gap
        found, gap = np.where(nearer, hit, found), np.where(nearer, far, gap)
        place = np.where(nearer[:, None], at, place)
    return found, place
