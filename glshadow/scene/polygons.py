"""Polygons with any number of corners -> triangles: exact for simple planar ones, something sensible for all others."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from glshadow.core.spaces import Array
from glshadow.scene.limits import Budget
from glshadow.scene.sweep import swept

Indices = NDArray[np.int64]

FEW = 8  # corners up to which every corner is tried as the apex of a fan, all polygons at once: faster than one call for each
MANY = 4_000  # corners above which the sweep is asked first: ear clipping takes 10 ms there, and K squared (measured)
MOST = 10_000  # corners up to which ears are clipped where the sweep gave up: .2 s for noise (measured)
FLAT = 1e-12  # of the polygon's squared area: what rounding makes of a triangle without area
NOBODY = -1
CROSSED = 1e-6  # of the area by which the triangles of a polygon that does not cross itself may miss it: rounding


def triangulated(
    positions: Array, corners: Indices, counts: Indices, notes: list[str], budget: Budget
) -> tuple[Indices, Indices]:
    """Triangles of polygons, in the polygons' order and winding.

    A fan whose triangles all face as the polygon does covers a simple polygon exactly: the winding number of the outline is the
    sum of those of the triangles. So convex polygons, and most of few corners, need no more than finding such a fan.

    Parameters
    ----------
    positions : (V, 3)
    corners : (C,)
        Vertices, polygon after polygon.
    counts : (P,)
        Corners of each polygon; those of fewer than 3 give nothing, which is noted, as is what crosses itself.

    Returns
    -------
    triangles : (T, 3)
        Indices into `corners`.
    polygon : (T,)
        The polygon that each triangle belongs to.
    """
    starts = np.cumsum(counts) - counts
    short = int((counts < 3).sum())
    if short:
        notes.append(f"{short} face(s) with fewer than 3 corners left out")
    budget.limits.check("triangles", float(np.maximum(counts - 2, 0).sum()), "its faces")
    if (counts == 3).all():
        return np.arange(len(corners)).reshape(-1, 3), np.arange(len(counts))
    triangles, owners, crossed = [], [], 0
    for size in np.unique(counts[counts >= 3]).tolist():
        mine = np.flatnonzero(counts == size)
        slots = starts[mine, None] + np.arange(size)
        found, hard = _fans(positions, corners, slots)
        owner = np.repeat(mine[:, None], size - 2, axis=1)
        for number in hard.tolist():
            budget.check_time("its polygons")
            points = positions[corners[slots[number]]]
            cut = _ears(points)
            crossed += cut is None or not _covers(points, cut)
            if cut is not None:
                owner[number] = NOBODY
                triangles.append(slots[number][cut])
                owners.append(np.full(len(cut), mine[number]))
        triangles.append(found.reshape(-1, 3))
        owners.append(owner.ravel())
    if crossed:
        notes.append(f"{crossed} polygon(s) cross themselves: their triangles are a guess")
    if not triangles:
        return np.zeros((0, 3), dtype=np.int64), np.zeros(0, dtype=np.int64)
    polygon = np.concatenate(owners)
    order = np.argsort(polygon, kind="stable")
    order = order[np.count_nonzero(polygon == NOBODY) :]
    return np.concatenate(triangles)[order], polygon[order]


def _fans(positions: Array, corners: Indices, slots: Indices) -> tuple[Indices, Indices]:
    """Fans (N, K - 2, 3) of polygons (N, K), and the numbers of those for which no apex that was tried gives a good one."""
    size = slots.shape[1]
    ring = np.arange(1, size - 1)
    fan = np.stack([np.zeros_like(ring), ring, ring + 1], axis=1)
    found = slots[:, fan]
    if size == 3:
        return found, np.zeros(0, dtype=np.int64)
    with np.errstate(all="ignore"):  # what is not finite is found later, where it is used
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
    """The polygon (K, 3) along the axis that its normal is nearest to, as (K, 2) inside the unit square, turned counter-clockwise."""
    low = points.min(axis=0)
    points = points / 4.0 - low / 4.0  # quarters: the difference of the largest numbers is none
    size = float(points.max())
    points = points / (size if size > 0.0 else 1.0)
    normal = np.cross(points, np.roll(points, -1, axis=0)).sum(axis=0)
    axis = int(np.abs(normal).argmax())
    plane = points[:, [(axis + 1) % 3, (axis + 2) % 3]]
    return np.ascontiguousarray(plane if normal[axis] >= 0.0 else plane[:, ::-1])


def _ears(points: Array) -> Indices | None:
    """Triangles (T, 3) of one concave polygon (K, 3); None if only a fan is left."""
    plane = _flat(points)
    if len(plane) > MANY:
        found = swept(plane)
        if found is not None or len(plane) > MOST:
            return found
    import mapbox_earcut

    cut = mapbox_earcut.triangulate_float64(plane, np.array([len(plane)], dtype=np.uint32))
    triangles = cut.astype(np.int64).reshape(-1, 3)
    if len(triangles) == 0:
        return None
    return triangles if _signed(plane, triangles).sum() >= 0.0 else triangles[:, ::-1]


def _signed(plane: Array, triangles: Indices) -> Array:
    a, b, c = (plane[triangles[:, k]] for k in range(3))
    return np.asarray((b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0]))


def _covers(points: Array, triangles: Indices) -> bool:
    """Whether the triangles together are as large as the polygon, and none lies over another."""
    plane = _flat(points)
    x, y = plane.T
    area = float((x * np.roll(y, -1) - y * np.roll(x, -1)).sum())
    return abs(float(np.abs(_signed(plane, triangles)).sum()) - area) <= CROSSED * abs(area)
