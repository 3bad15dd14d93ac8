"""A panel of light: its axes, its points, and what it gives to a surface."""

from __future__ import annotations

import numpy as np

from glshadow.core.lights import RectLight
from glshadow.core.sample_patterns import square
from glshadow.core.spaces import Array

_RING = np.array([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)])


def panel_axes(light: RectLight) -> Array:
    """Half its width along, half its height along, and the unit vector of the way it looks: rows (3, 3), world space."""
    forward, up = np.asarray(light.direction), np.asarray(light.up)
    right = np.cross(forward, up)
    right /= np.linalg.norm(right)
    return np.stack([0.5 * light.width * right, 0.5 * light.height * np.cross(right, forward), forward])


def panel_points(light: RectLight, count: int) -> Array:
    """Places (count, 3) on it, each for an equal share."""
    return np.asarray(np.asarray(light.position) + square(count) @ panel_axes(light)[:2])


def panel_corners(light: RectLight) -> Array:
    """Its corners (4, 3)."""
    return np.asarray(np.asarray(light.position) + _RING @ panel_axes(light)[:2])


def panel_factor(light: RectLight, points: Array, normals: Array) -> tuple[Array, Array]:
    """What a panel gives to surfaces (N, 3) with unit normals (N, 3), and how much of it is above their horizon: shares (N,), (N,).

    The form factor of the polygon that the horizon leaves of the panel (Lambert 1760). GLSL twin: glsl/light/panel.glsl
    """
    right, up, forward = panel_axes(light)
    middle = np.asarray(light.position) - points
    factor, above = np.zeros((2, len(points)))
    for row in range(len(points)):
        if not -(middle[row] @ forward) > 0.0:
            continue
        corners = middle[row] + _RING @ np.stack([right, up])
        heights = corners @ normals[row]
        kept, place = [], []
        for i in range(4):
            j = (i + 1) % 4
            if heights[i] > 0.0:
                kept.append(corners[i])
                place.append(_RING[i])
            if (heights[i] > 0.0) != (heights[j] > 0.0):
                share = heights[i] / (heights[i] - heights[j])
                kept.append(corners[i] + share * (corners[j] - corners[i]))
                place.append(_RING[i] + share * (_RING[j] - _RING[i]))
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
