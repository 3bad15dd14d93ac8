"""Triangulates polygons with any number of corners: exactly for simple planar ones, approximately for all others."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from glshadow.core.spaces import Array
from glshadow.io.limits import Budget
from glshadow.io.sweep import swept

Indices = NDArray[np.int64]

FEW = 8  # up to this many corners, every corner is tried as the apex of a fan, for all polygons at once: faster than one call per polygon
MANY = 4_000  # above this many corners the sweep is tried first: ear clipping takes 10 ms there, and grows with K squared (measured)
MOST = 10_000  # up to this many corners, ears are clipped however often a polygon crosses itself: .2 s for noise (measured)
SAMPLED = 32  # edges that estimate how often
FLAT = 1e-12  # share of the polygon's squared area: rounding error of a triangle without area
CROSSED = 1e-6  # share of the area that the triangles of a simple polygon may miss by rounding


def triangulated(
    positions: Array, corners: Indices, counts: Indices, notes: list[str], budget: Budget
) -> tuple[Indices, Indices]:
    """Triangles of polygons, in the polygons' order and winding.

    A fan whose triangles all face as the polygon does covers a simple polygon exactly: the winding number of the outline is the sum of
    those of the triangles. Convex polygons, and most with few corners, need only such a fan.

    Parameters
    ----------
    positions : (V, 3)
    corners : (C,)
        Vertex indices, polygon by polygon.
    counts : (P,)
        Corners of each polygon. Polygons with fewer than 3 give no triangle, and a note, as do those that cross themselves.

    Returns
    -------
    triangles : (T, 3)
        Indices into `corners`.
    polygon : (T,)
        The polygon of each triangle.
    """
    starts = np.cumsum(counts) - counts
    short = int((counts < 3).sum())
    if short:
        notes.append(f"{short} face(s) with fewer than 3 corners left out")
    budget.limits.check("triangles", float(np.maximum(counts - 2, 0).sum()), "its faces")
    if (counts == 3).all():
        return np.arange(len(corners)).reshape(-1, 3), np.arange(len(counts))
    triangles, owners, crossed, left_out = [], [], 0, 0
    for size in np.unique(counts[counts >= 3]).tolist():
        mine = np.flatnonzero(counts == size)
        slots = starts[mine, None] + np.arange(size)
        fans, hard = _fans(positions, corners, slots)
        easy = np.delete(np.arange(len(mine)), hard)
        triangles.append(fans[easy].reshape(-1, 3))
        owners.append(np.repeat(mine[easy], size - 2))
        if len(hard):
            cut, number, wrong = _cut(_flat(positions[corners[slots[hard]]]), budget)
            triangles.append(slots[hard[number, None], cut])
            owners.append(mine[hard[number]])
            crossed += int(wrong.sum())
            left_out += int((np.bincount(number, minlength=len(hard)) == 0).sum())
    if crossed:
        notes.append(
            f"{crossed} polygon(s) cross themselves: {left_out} left out, the triangles of the others are a guess"
        )
    if not triangles:
        return np.zeros((0, 3), dtype=np.int64), np.zeros(0, dtype=np.int64)
    polygon = np.concatenate(owners)
    order = np.argsort(polygon, kind="stable")
    return np.concatenate(triangles)[order], polygon[order]


def _fans(positions: Array, corners: Indices, slots: Indices) -> tuple[Indices, Indices]:
    """Fans (N, K - 2, 3) of polygons (N, K), and the indices of polygons for which no tried apex gives a valid fan."""
    size = slots.shape[1]
    ring = np.arange(1, size - 1)
    fan = np.stack([np.zeros_like(ring), ring, ring + 1], axis=1)
    found = slots[:, fan]
    if size == 3:
        return found, np.zeros(0, dtype=np.int64)
    with np.errstate(all="ignore"):  # values that are not finite are detected later, where they are used
        points = positions[corners[slots]]
        areas = _areas(points, fan)
        normal = areas.sum(axis=1)
        floor = -FLAT * np.einsum("ni,ni->n", normal, normal)
        hard = np.flatnonzero((np.einsum("nti,ni->nt", areas, normal) < floor[:, None]).any(axis=1))
        for apex in range(1, size if size <= FEW else 1):
            turned = (fan + apex) % size
            facing = np.einsum("nti,ni->nt", _areas(points[hard], turned), normal[hard])
            good = (facing >= floor[hard, None]).all(axis=1)
            found[hard[good]] = slots[hard[good]][:, turned]
            hard = hard[~good]
        hard = hard[np.isfinite(points[hard]).all(axis=(1, 2))]
    return found, hard


def _areas(points: Array, triangles: Indices) -> Array:
    """Twice the area vectors (N, T, 3) of triangles (T, 3) among points (N, K, 3)."""
    a, b, c = (points[:, triangles[:, k]] for k in range(3))
    return np.cross(b - a, c - a)


def _flat(points: Array) -> Array:
    """Polygons (N, K, 3) projected along the axis nearest to their normals, as (N, K, 2) inside the unit square,
    counter-clockwise."""
    quarters = points / 4.0  # so that differences of the largest numbers do not overflow
    quarters -= quarters.min(axis=1, keepdims=True)
    size = quarters.max(axis=(1, 2), keepdims=True)
    quarters /= np.where(size > 0.0, size, 1.0)
    normal = np.cross(quarters, np.roll(quarters, -1, axis=1)).sum(axis=1)
    axis = np.abs(normal).argmax(axis=1)
    row = np.arange(len(points))
    planes = np.stack([quarters[row, :, (axis + 1) % 3], quarters[row, :, (axis + 2) % 3]], axis=2)
    below = normal[row, axis] < 0.0
    planes[below] = planes[below][:, :, ::-1]
    return planes


def _cut(planes: Array, budget: Budget) -> tuple[Indices, Indices, NDArray[np.bool_]]:
    """Concave polygons (N, K, 2) as triangles (T, 3), with the polygon of each (T,), and the polygons (N,) not covered exactly.

    Polygons that cross themselves too often get no triangles.
    """
    found = []
    for plane in planes:
        budget.check_time("its polygons")
        found.append(_swept(plane) if len(plane) > MANY else _ears(plane))
    cut = np.concatenate(found)
    number = np.repeat(np.arange(len(found)), [len(triangles) for triangles in found])
    return cut, number, _missed(planes, cut, number)


def _missed(planes: Array, cut: Indices, number: Indices) -> NDArray[np.bool_]:
    """Whether the triangles (T, 3) of a polygon (N,) have a smaller total area than it, or a larger one: some overlap."""
    a, b, c = (planes[number, cut[:, k]] for k in range(3))
    area = _crossed(planes, np.roll(planes, -1, axis=1)).sum(axis=1)
    covered = np.bincount(number, np.abs(_crossed(b - a, c - a)), minlength=len(planes))
    return np.asarray(np.abs(covered - area) > CROSSED * np.abs(area))


def _crossed(a: Array, b: Array) -> Array:
    return np.asarray(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])


def _ears(plane: Array) -> Indices:
    import mapbox_earcut

    ends = np.array([len(plane)], dtype=np.uint32)
    return np.asarray(mapbox_earcut.triangulate_float64(plane, ends).astype(np.int64).reshape(-1, 3))


def _swept(plane: Array) -> Indices:
    """Triangles of a polygon with very many corners; none if it crosses itself too often for ear clipping."""
    triangles = swept(plane)
    if triangles is not None and not _missed(plane[None], triangles, np.zeros(len(triangles), dtype=np.int64))[0]:
        return triangles
    if len(plane) > MOST and _crossings(plane) > 1.0:
        return np.zeros((0, 3), dtype=np.int64)
    return _ears(plane)


def _crossings(plane: Array) -> float:
    """How many other edges an edge crosses, averaged over a few."""
    ends = np.roll(plane, -1, axis=0)
    total = 0
    for edge in np.linspace(0, len(plane) - 1, SAMPLED).astype(int).tolist():
        a, b = plane[edge], ends[edge]
        apart = np.sign(_crossed(b - a, plane - a)) * np.sign(_crossed(b - a, ends - a)) < 0.0
        parted = np.sign(_crossed(ends - plane, a - plane)) * np.sign(_crossed(ends - plane, b - plane)) < 0.0
        total += int((apart & parted).sum())
    return total / SAMPLED
