"""Lights that have a size, as points of it."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from glshadow.core.lights import DirectionalLight, Light, PointLight, RectLight, SkyLight, SpotLight
from glshadow.core.panel import panel_corners, panel_points
from glshadow.core.sample_patterns import ball, disc, hemisphere
from glshadow.core.spaces import Array, view_axes

TRACED = 256
"""Points of a light that has a size which the tools ask of a truth: off by 1 / (2 sqrt(TRACED)) in a penumbra, at most."""


def has_size(light: Light) -> bool:
    """Whether it has any: a sun's angle, a lamp's radius, a panel, the sky."""
    return (
        isinstance(light, RectLight | SkyLight)
        or (light.angle if isinstance(light, DirectionalLight) else light.radius) > 0.0
    )


def radius_of(light: Light) -> float:
    """Radius of the source: of a sun the tangent under which a receiver sees it, of a lamp world units; of what lies round a panel."""
    if isinstance(light, RectLight):
        return 0.5 * float(np.hypot(light.width, light.height))
    return float(np.tan(np.radians(0.5 * light.angle))) if isinstance(light, DirectionalLight) else light.radius


def traced_points(lights: Iterable[Light]) -> int:
    """Points of each light for a truth: one where none has a size."""
    return TRACED if any(map(has_size, lights)) else 1


def hard_lights(light: Light, count: int) -> tuple[Light, ...]:
    """Lights without size at `count` points of a light: their mean visibility is the share of the light that is seen.

    A sun is a cap of directions, a lamp a sphere, which from everywhere is seen as a disc. Points of equal solid angle of the cap, of equal
    share of the disc or of a panel; or of equal solid angle of the sky, whose directions are then weighed by Lambert's law.
    """
    if not has_size(light):
        return (light,)
    if isinstance(light, SkyLight):
        aims = hemisphere(count) @ disc_axes(light)
        return tuple(DirectionalLight(direction=tuple((-aim).tolist()), shadow=light.shadow) for aim in aims)
    if isinstance(light, RectLight):
        return _point_lights(light, panel_points(light, count))
    if isinstance(light, DirectionalLight):
        right, up, towards = disc_axes(light)
        offsets = cap_tangents(light, disc(count))
        aims = towards + offsets[:, :1] * right + offsets[:, 1:] * up
        return tuple(replace(light, direction=tuple((-aim).tolist()), angle=0.0) for aim in aims)
    places = np.asarray(light.position) + light.radius * ball(count)
    return tuple(replace(light, position=tuple(place.tolist()), radius=0.0) for place in places)


def without_cone(light: Light) -> Light:
    """A spot as a point light: the cone of one of its points ends elsewhere than the light's own, which alone bounds what is lit."""
    return PointLight(position=light.position, shadow=light.shadow) if isinstance(light, SpotLight) else light


def extremes(light: Light) -> tuple[Light, ...]:
    """Lights without size whose convex hull holds all of a light's points."""
    if not has_size(light):
        return (light,)
    if isinstance(light, SkyLight):
        return hard_lights(light, 64)
    if isinstance(light, RectLight):
        return _point_lights(light, panel_corners(light))
    if isinstance(light, DirectionalLight):
        right, up, towards = view_axes(np.asarray(light.direction))
        turns = np.pi / 4.0 * np.arange(8)
        reach = radius_of(light) / np.cos(np.pi / 8.0)  # of a disc's octagon
        aims = towards + reach * (np.cos(turns)[:, None] * right + np.sin(turns)[:, None] * up)
        return tuple(replace(light, direction=tuple((-aim).tolist()), angle=0.0) for aim in aims)
    signs = np.array([(x, y, z) for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)])
    places = np.asarray(light.position) + light.radius * signs
    return tuple(replace(light, position=tuple(place.tolist()), radius=0.0) for place in places)


def points_seen(light: Light, receivers: Array, count: int) -> Array:
    """The points of a light that has a size, for each receiver (N, 3) in world space: places (N, count, 3) of a lamp, directions of a sun.

    Of a lamp the disc that a receiver sees; it turns with the receiver by the shortest way from the lamp's axis, so that neighbours have
    nearly the same points, and there is a seam only opposite to that axis.
    """
    if isinstance(light, RectLight):
        return np.broadcast_to(panel_points(light, count), (len(receivers), count, 3))
    right, up, backward = disc_axes(light)
    if isinstance(light, DirectionalLight):
        tangents = cap_tangents(light, disc(count))
        aims = backward + tangents[:, :1] * right + tangents[:, 1:] * up
        return np.broadcast_to(aims, (len(receivers), count, 3))
    points = radius_of(light) * disc(count)
    away = receivers - np.asarray(light.position)
    away /= np.linalg.norm(away, axis=1, keepdims=True)
    both = (away - backward) / np.maximum(1.0 - away @ backward, 1e-6)[:, None]
    rights, ups = right - (away @ right)[:, None] * both, up - (away @ up)[:, None] * both
    offsets = points[:, 0, None] * rights[:, None] + points[:, 1, None] * ups[:, None]
    return np.asarray(np.asarray(light.position) + offsets)


def cap_tangents(light: DirectionalLight, points: Array) -> Array:
    """Points of the unit disc (..., 2) as directions of a sun: tangents from its middle, such that equal areas are equal solid angles.

    Within the angle t of a cap of half its angle a lies the share (1 - cos t) / (1 - cos a) = (sin(t/2) / sin(a/2))^2, of the disc within r
    the share r^2: so sin(t/2) = r sin(a/2), Lambert's azimuthal equal-area projection.
    """
    scale = np.sin(0.25 * np.radians(light.angle))
    squared = (scale**2) * (points**2).sum(axis=-1, keepdims=True)
    return np.asarray(points * (2.0 * scale * np.sqrt(1.0 - squared) / (1.0 - 2.0 * squared)))


def disc_axes(light: Light) -> Array:
    """Right, up and backward (3, 3) of the disc of a light's points: a sun's and a spot's about its direction, a point light's about the
    way down."""
    return view_axes(np.array([0.0, -1.0, 0.0]) if isinstance(light, PointLight) else np.asarray(light.direction))


def _point_lights(light: Light, places: Array) -> tuple[Light, ...]:
    return tuple(PointLight(position=tuple(place.tolist()), shadow=light.shadow) for place in places)
