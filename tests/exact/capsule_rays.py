"""A float64 tracer for scenes of balls, tubes and triangles: slow, direct formulas, nothing of glshadow's own code for capsules."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

import glshadow as gs
from glshadow.scene.capsules import Capsules

Array = NDArray[np.float64]
FAR = 1e4  # stands for a directional light's distance, in sizes of the scene


@dataclass
class Elements:
    """A scene's elements in the order of their numbers, in world space."""

    corners: Array  # (E, 3, 3); of a capsule: its ends
    radius: Array  # (E,); 0: a triangle


def elements_of(scene: gs.Scene) -> Elements:
    """Elements of all nodes; matrices must be rigid times a uniform scale."""
    corners: list[Array] = []
    radii: list[Array] = []
    for node in scene.nodes:
        mesh, matrix = node.mesh, node.world_from_mesh
        points = mesh.positions @ matrix[:3, :3].T + matrix[:3, 3]
        if isinstance(mesh, Capsules):
            ends = points[mesh.ends]
            corners.append(np.concatenate([ends, ends[:, :1]], axis=1))
            scale = float(np.linalg.norm(matrix[:3, 0]))
            radii.append(np.broadcast_to(mesh.radius * scale, (len(ends),)))
        else:
            corners.append(points[mesh.triangles])
            radii.append(np.zeros(len(mesh.triangles)))
    return Elements(np.concatenate(corners), np.concatenate(radii))


def _dot(a: Array, b: Array) -> Array:
    return np.asarray((a * b).sum(axis=-1))


def entry(elements: Elements, number: int, start: Array, ray: Array) -> Array:
    """Ray parameter (P,) at which rays meet an element; infinite where they do not."""
    a, b, c = elements.corners[number]
    radius = elements.radius[number]
    if radius == 0.0:
        normal = np.cross(b - a, c - a)
        slant = _dot(ray, normal)
        with np.errstate(divide="ignore", invalid="ignore"):
            along = _dot(a - start, normal) / slant
            point = start + along[:, None] * ray
        inside = np.ones(len(along), dtype=bool)
        for p, q in ((a, b), (b, c), (c, a)):
            inside &= _dot(np.cross(q - p, point - p), normal) >= 0.0
        return np.where(inside & (along > 0.0), along, np.inf)
    best = np.full(len(start), np.inf)
    length2 = _dot(ray, ray)
    for centre in (a, b):
        offset = start - centre
        half = _dot(offset, ray)
        root = half**2 - length2 * (_dot(offset, offset) - radius**2)
        along = (-half - np.sqrt(np.maximum(root, 0.0))) / length2
        best = np.where((root >= 0.0) & (along > 0.0) & (along < best), along, best)
    axis = b - a
    if axis.any():
        unit = axis / np.linalg.norm(axis)
        offset = start - a
        across, beside = ray - _dot(ray, unit)[:, None] * unit, offset - _dot(offset, unit)[:, None] * unit
        square, half = _dot(across, across), _dot(across, beside)
        root = half**2 - square * (_dot(beside, beside) - radius**2)
        with np.errstate(divide="ignore", invalid="ignore"):
            along = (-half - np.sqrt(np.maximum(root, 0.0))) / square
            share = _dot(offset + along[:, None] * ray, unit) / np.linalg.norm(axis)
        hit = (square > 0.0) & (root >= 0.0) & (share > 0.0) & (share < 1.0) & (along > 0.0) & (along < best)
        best = np.where(hit, along, best)
    return best


def normals(elements: Elements, number: Array, points: Array, ray: Array) -> Array:
    """Unit normals (P, 3) of elements at points of them, on the side that is seen."""
    a, b, c = (elements.corners[number, k] for k in range(3))
    axis = b - a
    length2 = _dot(axis, axis)
    share = np.clip(_dot(points - a, axis) / np.where(length2 > 0.0, length2, 1.0), 0.0, 1.0)
    found = np.where(
        (elements.radius[number] > 0.0)[:, None], points - a - share[:, None] * axis, np.cross(axis, c - a)
    )
    found /= np.linalg.norm(found, axis=1, keepdims=True)
    return np.where((_dot(found, ray) > 0.0)[:, None], -found, found)


def _gap(a: Array, b: Array, start: Array, end: Array) -> Array:
    """Distance (P,) between a segment and segments (P, 3) to (P, 3), by the closest of interior and end points."""
    d, e = np.broadcast_to(b - a, start.shape), end - start
    best = np.full(len(start), np.inf)

    def from_point(p: Array, origin: Array, along: Array) -> Array:
        length2 = _dot(along, along)
        share = np.clip(_dot(p - origin, along) / np.where(length2 > 0.0, length2, 1.0), 0.0, 1.0)
        return np.asarray(np.linalg.norm(p - origin - share[:, None] * along, axis=1))

    origin = np.broadcast_to(a, start.shape)
    for each in (
        from_point(start, origin, d),
        from_point(end, origin, d),
        from_point(origin, start, e),
        from_point(origin + d, start, e),
    ):
        best = np.minimum(best, each)
    dd, de, ee, w = _dot(d, d), _dot(d, e), _dot(e, e), origin - start
    det = dd * ee - de**2
    with np.errstate(divide="ignore", invalid="ignore"):
        s, t = (de * _dot(e, w) - ee * _dot(d, w)) / det, (dd * _dot(e, w) - de * _dot(d, w)) / det
        inner = np.linalg.norm(w + s[:, None] * d - t[:, None] * e, axis=1)
    return np.where((det > 0.0) & (s > 0.0) & (s < 1.0) & (t > 0.0) & (t < 1.0), np.minimum(best, inner), best)


def visible(elements: Elements, light: Any, number: Array, points: Array, ray: Array, size: float) -> NDArray[np.bool_]:
    """Whether points of elements see a light."""
    facing = normals(elements, number, points, ray)
    if light.at_infinity:
        to_light = np.broadcast_to(-np.asarray(light.direction) / np.linalg.norm(light.direction), points.shape)
        end = points + FAR * size * to_light
    else:
        end = np.broadcast_to(np.asarray(light.position), points.shape)
        to_light = end - points
    lit = _dot(facing, to_light) > 0.0
    for k in range(len(elements.radius)):
        other = number != k
        if elements.radius[k] == 0.0:
            along = entry(elements, k, points, end - points)
            blocked = (along > 1e-9) & (along < 1.0)
        else:
            blocked = _gap(elements.corners[k, 0], elements.corners[k, 1], points, end) < elements.radius[k]
        lit &= ~(blocked & other)
    if hasattr(light, "outer_angle"):
        axis = np.asarray(light.direction) / np.linalg.norm(light.direction)
        away = -to_light / np.linalg.norm(to_light, axis=1, keepdims=True)
        lit &= away @ axis > np.cos(np.radians(light.outer_angle))
    return lit
