"""Shadows in float64 by testing every triangle with the exact filter's own rule: slow; decides where Embree and the filter differ."""

from __future__ import annotations

import numpy as np

from glshadow.core.spaces import Array, Bools
from glshadow.lights import Light
from glshadow.reference.embree import Ints, dot
from glshadow.reference.rays import Rays


def blocked(
    rays: Rays, light: Light, own: Ints, points: Array, bound: tuple[float, float], lifted: Bools | None = None
) -> Bools:
    """Whether a triangle other than the own one lies between points and a light.

    A triangle blocks if the ray to the light meets it (its edges included) and the point lies beyond its plane, seen from the light,
    by more than rounding: distance to the plane, not along the ray.

    Parameters
    ----------
    own : (N,) int32
        Triangles that the points lie on.
    points : (N, 3) float64
        Relative to `rays.origin`.
    bound : (2,) floats
        World units, and share of the sums of coordinates by which the point is away from both triangles' first corners, see
        `core.lists.distance_bound`.
    lifted : (N,) bool, optional
        Points that are off their own triangles, which then count as others do.
    """
    casting = np.flatnonzero(rays.casts)
    corners, normals = rays.corners[casting], rays.normals[casting]
    light, sun = light.relative_to(rays.origin), light.at_infinity
    place = np.asarray(light.place[:3])
    result = np.zeros(len(own), dtype=bool)
    skipped = own if lifted is None else np.where(lifted, np.int32(-1), own)
    for number, point in enumerate(points):
        along = light.rays_to(point)
        across = _across(along)
        flat = (corners - point) @ across.T  # (T, 3, 2): the triangles seen along the ray
        near = (
            (flat.min(axis=1) <= 0.0).all(axis=1) & (flat.max(axis=1) >= 0.0).all(axis=1) & (casting != skipped[number])
        )
        few = np.flatnonzero(near)
        a, b, c = (flat[few, k] for k in range(3))
        area = np.stack([_cross(a, b), _cross(b, c), _cross(c, a)])
        few = few[~((area.min(axis=0) < 0.0) & (area.max(axis=0) > 0.0))]
        gap = dot(np.broadcast_to(point, (len(few), 3)) - corners[few, 0], normals[few])
        side = normals[few] @ place if sun else dot(place - corners[few, 0], normals[few])
        away = np.abs(point - corners[few, 0]).sum(axis=1) + np.abs(point - rays.corners[own[number], 0]).sum()
        rounding = bound[0] + bound[1] * away
        # a light in the triangle's plane sees both sides
        hit = few[(gap * np.sign(side) < -rounding) & (sun | (np.abs(side) > rounding))]
        if len(hit) and rays.masked.any():
            slope = normals[hit] @ along
            t = dot(corners[hit, 0] - point, normals[hit]) / np.where(slope == 0.0, 1.0, slope)
            hit = hit[rays.opaque(casting[hit].astype(np.int32), point + t[:, None] * along)]
        result[number] = len(hit) > 0
    return result


def _across(along: Array) -> Array:
    """Two unit vectors (2, 3) perpendicular to a vector."""
    first = np.cross(along, np.eye(3)[np.argmin(np.abs(along))])
    first /= np.linalg.norm(first)
    return np.stack([first, np.cross(along / np.linalg.norm(along), first)])


def _cross(a: Array, b: Array) -> Array:
    return np.asarray(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])
