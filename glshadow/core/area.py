"""Lights that have a size, as hard lights at points of it: well spread, the same for every pixel, so that their mean has no noise."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from glshadow.core.lights import DirectionalLight, Light, PointLight, RectLight, SkyLight
from glshadow.core.spaces import Array, view_axes

TRACED = 256
"""Points of a light that has a size which the tools ask of a truth: off by 1 / (2 sqrt(TRACED)) in a penumbra, at most."""

GOLDEN_ANGLE = np.pi * (3.0 - np.sqrt(5.0))


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

    A sun is a disc of directions; a lamp a sphere, which from everywhere is seen as a disc. Points of equal share of that disc, of a panel
    or of the sky, whose directions are then weighed by Lambert's law.
    """
    if not has_size(light):
        return (light,)
    if isinstance(light, SkyLight):
        aims = hemisphere(count) @ disc_axes(light)
        return tuple(DirectionalLight(direction=tuple((-aim).tolist()), shadow=light.shadow) for aim in aims)
    if isinstance(light, RectLight):
        return tuple(
            PointLight(position=tuple(place.tolist()), shadow=light.shadow) for place in _on_panel(light, count)
        )
    if isinstance(light, DirectionalLight):
        right, up, towards = disc_axes(light)
        offsets = np.tan(np.radians(0.5 * light.angle)) * disc(count)
        aims = towards + offsets[:, :1] * right + offsets[:, 1:] * up
        return tuple(replace(light, direction=tuple((-aim).tolist()), angle=0.0) for aim in aims)
    places = np.asarray(light.position) + light.radius * ball(count)
    return tuple(replace(light, position=tuple(place.tolist()), radius=0.0) for place in places)


def extremes(light: Light) -> tuple[Light, ...]:
    """Lights without size whose convex hull holds all of a light's points."""
    if not has_size(light):
        return (light,)
    if isinstance(light, SkyLight | RectLight):
        return hard_lights(light, 64) if isinstance(light, SkyLight) else _corners(light)
    if isinstance(light, DirectionalLight):
        right, up, towards = view_axes(np.asarray(light.direction))
        turns = np.pi / 4.0 * np.arange(8)
        reach = radius_of(light) / np.cos(np.pi / 8.0)  # of a disc's octagon
        aims = towards + reach * (np.cos(turns)[:, None] * right + np.sin(turns)[:, None] * up)
        return tuple(replace(light, direction=tuple((-aim).tolist()), angle=0.0) for aim in aims)
    signs = np.array([(x, y, z) for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)])
    places = np.asarray(light.position) + light.radius * signs
    return tuple(replace(light, position=tuple(place.tolist()), radius=0.0) for place in places)


def disc(count: int) -> Array:
    """Points (count, 2) of the unit disc, each for an equal share of its area: a spiral (Vogel 1979)."""
    i = np.arange(count)
    radius, angle = np.sqrt((i + 0.5) / count), i * GOLDEN_ANGLE
    return np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=-1)


def square(count: int) -> Array:
    """Points (count, 2) of the square from -1 to 1, each for an equal share: a lattice by the golden ratio."""
    i = np.arange(count)
    return np.stack([(2.0 * i + 1.0) / count, 2.0 * ((i + 0.5) * (np.sqrt(5.0) - 1.0) / 2.0 % 1.0)], axis=-1) - 1.0


def hemisphere(count: int) -> Array:
    """Directions (count, 3) about z, each for an equal solid angle: a spiral."""
    i = np.arange(count)
    height, angle = (i + 0.5) / count, i * GOLDEN_ANGLE
    across = np.sqrt(1.0 - height**2)
    return np.stack([across * np.cos(angle), across * np.sin(angle), height], axis=-1)


def panel_axes(light: RectLight) -> Array:
    """Half its width along, half its height along, and the unit vector of the way it looks: rows (3, 3), world space."""
    forward, up = np.asarray(light.direction), np.asarray(light.up)
    right = np.cross(forward, up)
    right /= np.linalg.norm(right)
    return np.stack([0.5 * light.width * right, 0.5 * light.height * np.cross(right, forward), forward])


def _on_panel(light: RectLight, count: int) -> Array:
    return np.asarray(np.asarray(light.position) + square(count) @ panel_axes(light)[:2])


def _corners(light: RectLight) -> tuple[Light, ...]:
    places = (
        np.asarray(light.position)
        + np.array([(x, y) for x in (-1.0, 1.0) for y in (-1.0, 1.0)]) @ panel_axes(light)[:2]
    )
    return tuple(PointLight(position=tuple(place.tolist()), shadow=light.shadow) for place in places)


def panel_factor(light: RectLight, points: Array, normals: Array) -> tuple[Array, Array]:
    """What a panel gives to surfaces (N, 3) with unit normals (N, 3), and how much of it is above their horizon: shares (N,), (N,).

    The form factor of the polygon that the horizon leaves of the panel (Lambert 1760). GLSL twin: glsl/light/panel.glsl
    """
    right, up, forward = panel_axes(light)
    middle = np.asarray(light.position) - points
    ring = np.array([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)])
    factor, above = np.zeros((2, len(points)))
    for row in range(len(points)):
        if not -(middle[row] @ forward) > 0.0:
            continue
        corners = middle[row] + ring @ np.stack([right, up])
        heights = corners @ normals[row]
        kept, place = [], []
        for i in range(4):
            j = (i + 1) % 4
            if heights[i] > 0.0:
                kept.append(corners[i])
                place.append(ring[i])
            if (heights[i] > 0.0) != (heights[j] > 0.0):
                share = heights[i] / (heights[i] - heights[j])
                kept.append(corners[i] + share * (corners[j] - corners[i]))
                place.append(ring[i] + share * (ring[j] - ring[i]))
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


def points_seen(light: Light, receivers: Array, count: int) -> Array:
    """The points of a light that has a size, for each receiver (N, 3) in world space: places (N, count, 3) of a lamp, directions of a sun.

    Of a lamp the disc that a receiver sees; it turns with the receiver by the shortest way from the lamp's axis, so that neighbours have
    nearly the same points, and there is a seam only opposite to that axis.
    """
    if isinstance(light, RectLight):
        return np.broadcast_to(_on_panel(light, count), (len(receivers), count, 3))
    points = radius_of(light) * disc(count)
    right, up, backward = disc_axes(light)
    if isinstance(light, DirectionalLight):
        aims = backward + points[:, :1] * right + points[:, 1:] * up
        return np.broadcast_to(aims, (len(receivers), count, 3))
    away = receivers - np.asarray(light.position)
    away /= np.linalg.norm(away, axis=1, keepdims=True)
    both = (away - backward) / np.maximum(1.0 - away @ backward, 1e-6)[:, None]
    rights, ups = right - (away @ right)[:, None] * both, up - (away @ up)[:, None] * both
    offsets = points[:, 0, None] * rights[:, None] + points[:, 1, None] * ups[:, None]
    return np.asarray(np.asarray(light.position) + offsets)


def disc_axes(light: Light) -> Array:
    """Right, up and backward (3, 3) of a light's points: a sun's and a spot's about its direction, a point light's about the way down; of a
    panel half its width, half its height and the way back."""
    if isinstance(light, RectLight):
        return np.asarray(panel_axes(light) * np.array([[1.0], [1.0], [-1.0]]))
    return view_axes(np.array([0.0, -1.0, 0.0]) if isinstance(light, PointLight) else np.asarray(light.direction))


def ball(count: int) -> Array:
    """Points (count, 3) of the unit ball that, seen from any side, fill the disc evenly.

    Their density is 1 / sqrt(1 - r^2): of all that depend on the radius alone the one whose projection is even (the inverse Abel
    transform of a constant). Directions along a spiral from pole to pole, radii in the order of the multiples of the root of 2. Of a
    straight edge across the disc the share is off by at most 0.65 / sqrt(count), from every side (tests/unit/test_area.py).
    """
    i = np.arange(count)
    height = 1.0 - (2.0 * i + 1.0) / count
    across, angle = np.sqrt(1.0 - height**2), i * GOLDEN_ANGLE
    directions = np.stack([across * np.cos(angle), across * np.sin(angle), height], axis=-1)
    shares = (i * np.sqrt(2.0) + 0.5 / count) % 1.0
    return directions * _radius(shares)[:, None]


def _radius(share: Array) -> Array:
    """Radius within which a share of the ball's points lies: the inverse of 2 / pi (asin t - t sqrt(1 - t^2))."""
    t = np.linspace(0.0, 1.0, 4097)
    within = 2.0 / np.pi * (np.arcsin(t) - t * np.sqrt(1.0 - t**2))
    return np.interp(share, within, t)
