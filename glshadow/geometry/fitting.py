"""Light frustum fitting: the part of the world that a shadow map must cover. Pure functions, float64.

Receivers are known by their boxes. The visible part of a box is the intersection of two convex bodies, and each of its corners is on
an edge of one of them: so the edges of each are clipped by the faces of the other.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from glshadow.core.spaces import Array, view_axes

_CORNERS = np.array([[i, j, k] for i in (0, 1) for j in (0, 1) for k in (0, 1)])
_BLOCK = 4096  # boxes clipped at a time, 10 kB each
_EDGES = np.array([(a, b) for a in range(8) for b in range(a + 1, 8) if np.abs(_CORNERS[a] - _CORNERS[b]).sum() == 1])


_MANY = 50_000  # points (of thousands of boxes); from this count on most are discarded before the hull is computed
_NEAR = 1e-9  # share of their extent; a map of 2048 has texels of 5e-4


@dataclass(frozen=True, eq=False)
class Frustum:
    """The volume that a view sees.

    Parameters
    ----------
    corners : (8, 3) float64
        World space.
    normals, limits : (6, 3), (6,) float64
        Its faces: a world point p is inside if normals @ p >= limits. Not normalised.
    """

    corners: Array
    normals: Array
    limits: Array


def frustum_of(
    window: tuple[float, float, float, float],
    near: float,
    far: float,
    view_from_world: Array,
    is_perspective: bool = True,
) -> Frustum:
    """The frustum of a view; `window` is left, right, bottom, top as tangents, or in world units for an orthographic view.

    The faces are computed from the window, not from the corners: far from the origin, corners of a narrow frustum round to one point.
    """
    left, right, bottom, top = window
    rotation, offset = view_from_world[:3, :3], view_from_world[:3, 3]
    tangents = np.array([left, bottom, right, top]).reshape(2, 2)
    distance = np.array([near, far])[_CORNERS[:, 2]]
    scale = distance if is_perspective else np.ones(8)
    corners_v = np.stack([tangents[_CORNERS[:, 0], 0] * scale, tangents[_CORNERS[:, 1], 1] * scale, -distance], axis=-1)
    # x >= left * depth, and so on, with depth = -z; for an orthographic view x >= left
    edges, none = np.array([left, -right, bottom, -top]), np.zeros(4)
    lean, first = (edges, none) if is_perspective else (none, edges)
    sides = np.column_stack([[1.0, -1.0, 0.0, 0.0], [0.0, 0.0, 1.0, -1.0], lean])
    normals_v = np.concatenate([sides, [[0.0, 0.0, -1.0], [0.0, 0.0, 1.0]]])
    limits = np.concatenate([first, [near, -far]]) - normals_v @ offset
    return Frustum((corners_v - offset) @ rotation, normals_v @ rotation, limits)


def visible_corners(bounds: Array, world_from_mesh: Array, frustum: Frustum) -> list[Array]:
    """Corners of the parts of boxes that are inside a frustum.

    Parameters
    ----------
    bounds : (N, 2, 3) float64
        Boxes in mesh space.
    world_from_mesh : (N, 4, 4) float64
    frustum : Frustum

    Returns
    -------
    list of N arrays (M, 3)
        World points whose convex hull is the intersection of box and frustum; M = 0 if they do not overlap.
    """
    linear, offset = world_from_mesh[:, :3, :3], world_from_mesh[:, :3, 3]
    low, high = bounds[:, 0], bounds[:, 1]
    pad = 1e-9 * np.maximum((high - low).max(axis=1, keepdims=True), np.abs(bounds).max(axis=(1, 2))[:, None] * 1e-3)
    low, high = low - pad, high + pad  # so that a flat box is crossed, not touched
    local = np.where(_CORNERS[None, :, :] == 0, low[:, None], high[:, None])
    corners = np.einsum("nij,nkj->nki", linear, local) + offset[:, None]
    size = np.abs(linear).max(axis=(1, 2))
    regular = np.abs(np.linalg.det(linear)) > 1e-12 * size**3
    found = list(corners)  # flattened by its matrix: use the whole box
    # Most boxes of a large scene are entirely on one side of every face and need no clipping.
    gap = corners @ frustum.normals.T - frustum.limits
    apart, within = regular & (gap < 0.0).all(axis=1).any(axis=1), regular & (gap > 0.0).all(axis=(1, 2))
    for i in np.flatnonzero(apart):
        found[i] = np.zeros((0, 3))
    start, end = corners[within][:, _EDGES[:, 0]], corners[within][:, _EDGES[:, 1]]
    for i, points in zip(np.flatnonzero(within), np.concatenate([start, start + (end - start)], axis=1), strict=True):
        found[i] = points
    crossed = np.flatnonzero(regular & ~apart & ~within)
    for block in np.split(crossed, range(_BLOCK, len(crossed), _BLOCK)):
        parts = _clipped(corners[block], linear[block], offset[block], low[block], high[block], frustum)
        for i, points in zip(block, parts, strict=True):
            found[i] = points
    return found


def _clipped(corners: Array, linear: Array, offset: Array, low: Array, high: Array, frustum: Frustum) -> list[Array]:
    """The same for regular matrices and padded boxes from (N, 3) to (N, 3), with known world corners (N, 8, 3)."""
    inside_frustum, box_points = _clip(
        corners[:, _EDGES[:, 0]],
        corners[:, _EDGES[:, 1]],
        np.broadcast_to(frustum.normals, (len(corners), 6, 3)),
        frustum.limits[None, :],
    )
    inverse = np.linalg.inv(linear)
    frustum_local = np.einsum("nij,nkj->nki", inverse, frustum.corners[None] - offset[:, None])
    axes = np.broadcast_to(np.concatenate([np.eye(3), -np.eye(3)]), (len(corners), 6, 3))
    inside_box, frustum_points = _clip(
        frustum_local[:, _EDGES[:, 0]], frustum_local[:, _EDGES[:, 1]], axes, np.concatenate([low, -high], axis=1)
    )
    frustum_points = np.einsum("nij,nkj->nki", linear, frustum_points) + offset[:, None]
    return [
        np.concatenate([box_points[i][inside_frustum[i]], frustum_points[i][inside_box[i]]])
        for i in range(len(corners))
    ]


def _clip(start: Array, end: Array, normals: Array, limits: Array) -> tuple[NDArray[np.bool_], Array]:
    """Segments (N, E, 3) clipped by half-spaces (N, K, 3), (N, K); which ends exist (N, 2E) and their positions (N, 2E, 3)."""
    before = np.einsum("nkj,nej->nek", normals, start) - limits[:, None]
    after = np.einsum("nkj,nej->nek", normals, end) - limits[:, None]
    crossing = np.sign(before) * np.sign(after) < 0
    where = np.where(crossing, before / np.where(crossing, before - after, 1.0), 0.0)
    enter = np.where(crossing & (before < 0), where, 0.0).max(axis=-1)
    leave = np.where(crossing & (after < 0), where, 1.0).min(axis=-1)
    outside = ((before < 0) & (after < 0) | (before < 0) & (after == 0) | (before == 0) & (after < 0)).any(axis=-1)
    exists = (enter <= leave) & ~outside
    direction = end - start
    points = np.concatenate([start + enter[..., None] * direction, start + leave[..., None] * direction], axis=1)
    return np.concatenate([exists, exists], axis=1), points


# A map is fitted to the casters' shadow volume if that is less than this share of the visible part: texels shrink at least by half.
_SPARSE = 0.25


def shaded_receivers(
    direction: Array, seen: list[Array], casters: Array, bounds: Array, world_from_mesh: Array
) -> list[Array] | None:
    """The parts of bodies that parallel light can shadow, if they are a small share of the visible parts.

    Parameters
    Direction in which the light travels.
    direction : (3,) float64
        The way the light travels.
    seen : list of (M, 3) float64
        Corners of the visible part of each body.
    casters : (K, 3) float64
        World corners of all casters.
    bounds, world_from_mesh : (N, 2, 3), (N, 4, 4) float64
        The bodies' boxes.

    Returns
    -------
    list of (M, 3) float64, or None
        Corners of each body inside the column behind all casters, empty arrays for bodies outside; None if the share is not small.
    """
    points = np.concatenate(seen)
    axes = view_axes(direction)
    middle = 0.5 * (casters.min(axis=0) + casters.max(axis=0))
    lit, shade = (convex_hull((each - middle) @ axes[:2].T) for each in (points, casters))
    common = clip_polygon(lit, shade)
    if not polygon_area(common) < _SPARSE * polygon_area(lit):
        return None
    first, last = -((casters - middle) @ axes[2]).max(), -((points - middle) @ axes[2]).min()
    if len(common) < 3 or last <= first:
        return [points[:0] for _ in bounds]
    angle, rectangle = minimum_rectangle(common)
    axes = np.array([[np.cos(angle), np.sin(angle), 0.0], [-np.sin(angle), np.cos(angle), 0.0], [0.0, 0.0, 1.0]]) @ axes
    ends = np.stack([np.append(rectangle[0], -last), np.append(rectangle[1], -first)])
    local = np.take_along_axis(ends, _CORNERS, axis=0)
    normals = np.concatenate([axes, -axes])
    limits = np.concatenate([ends[0], -ends[1]]) + normals @ middle
    return visible_corners(bounds, world_from_mesh, Frustum(local @ axes + middle, normals, limits))


def clip_polygon(polygon: Array, window: Array) -> Array:
    """The part (M, 2) of a convex polygon (N, 2) inside another one (K, 2), both counter-clockwise; empty if they do not overlap.

    References
    ----------
    Sutherland, Hodgman 1974, "Reentrant Polygon Clipping", CACM 17.
    """
    if len(window) < 3:
        return polygon[:0]
    for a, b in zip(window, np.roll(window, -1, axis=0), strict=True):
        if len(polygon) == 0:
            break
        side = (b[0] - a[0]) * (polygon[:, 1] - a[1]) - (b[1] - a[1]) * (polygon[:, 0] - a[0])
        after, far = np.roll(polygon, -1, axis=0), np.roll(side, -1)
        crossing = (side < 0.0) != (far < 0.0)
        share = np.where(crossing, side / np.where(crossing, side - far, 1.0), 0.0)
        corners = np.stack([polygon, polygon + share[:, None] * (after - polygon)], axis=1)
        polygon = corners[np.stack([side >= 0.0, crossing], axis=1)]
    return polygon


def polygon_area(polygon: Array) -> float:
    """Area of a polygon (N, 2), counter-clockwise positive."""
    if len(polygon) < 3:
        return 0.0
    x, y = (polygon - polygon[0]).T
    return 0.5 * float((x * np.roll(y, -1) - y * np.roll(x, -1)).sum())


def minimum_rectangle(points: Array) -> tuple[float, Array]:
    """Rectangle of least area around points in a plane.

    Parameters
    ----------
    points : (N, 2) float64

    Returns
    -------
    angle_rad : float
        Rotation of the x axis, in [0, pi/2).
    rectangle : (2, 2) float64
        Least and greatest corner in the rotated axes (cos x + sin y, -sin x + cos y).

    References
    ----------
    Freeman, Shapira 1975: one of its sides is on an edge of the convex hull.
    """
    hull = convex_hull(points)
    edges = np.diff(np.concatenate([hull, hull[:1]]), axis=0)
    angles = np.unique(np.concatenate([[0.0], np.mod(np.arctan2(edges[:, 1], edges[:, 0]), np.pi / 2)]))
    cosine, sine = np.cos(angles), np.sin(angles)
    x = hull[:, :1] * cosine + hull[:, 1:] * sine
    y = hull[:, 1:] * cosine - hull[:, :1] * sine
    area = np.ptp(x, axis=0) * np.ptp(y, axis=0)
    best = int(np.argmin(area))
    rectangle = np.array([[x[:, best].min(), y[:, best].min()], [x[:, best].max(), y[:, best].max()]])
    return float(angles[best]), rectangle


def convex_hull(points: Array) -> Array:
    """Corners (M, 2) of the convex hull of points (N, 2), counter-clockwise; Andrew's monotone chain.

    Points inside the polygon of 32 extreme points are discarded first (Akl, Toussaint 1978), which keeps the loop short. Of very many
    points, those inside, or insignificantly outside, a polygon of 8 are discarded before.
    """
    if len(points) > _MANY:
        points = _outermost(points, _around(8) @ _rounding(points[:: len(points) // _MANY]), -_NEAR)
    kept = sorted({(x, y) for x, y in _outermost(points, _around(32), _NEAR).tolist()})
    if len(kept) < 3:
        return np.array(kept)
    chains = []
    for ordered in (kept, kept[::-1]):
        chain: list[tuple[float, float]] = []
        for x, y in ordered:
            while len(chain) > 1:
                (ax, ay), (bx, by) = chain[-2], chain[-1]
                if (bx - ax) * (y - ay) - (by - ay) * (x - ax) > 0.0:
                    break
                chain.pop()
            chain.append((x, y))
        chains.append(chain[:-1])
    return np.array(chains[0] + chains[1])


def _around(count: int) -> Array:
    angles = np.arange(count) * (2.0 * np.pi / count)
    return np.stack([np.cos(angles), np.sin(angles)], axis=1)


def _rounding(points: Array) -> Array:
    """A (2, 2) matrix that makes an elongated point cloud about as wide as it is long, so that few directions find all its ends."""
    values, vectors = np.linalg.eigh(np.cov(points.T))
    return np.asarray(vectors / np.sqrt(np.maximum(values, _NEAR**2 * max(values[1], 1e-300))) @ vectors.T)


def _outermost(points: Array, directions: Array, depth: float) -> Array:
    """Points (N, 2) without those inside the polygon of extreme points in directions (K, 2); the extreme points come last.

    Parameters
    ----------
    depth : float
        How far inside, in extents of the points; negative: also discard those that far outside.
    """
    extreme = points[np.argmax(directions @ points.T, axis=1)]
    following = np.roll(extreme, -1, axis=0)
    side = np.stack([extreme[:, 1] - following[:, 1], following[:, 0] - extreme[:, 0]], axis=1)  # inward normals (K, 2)
    length = np.linalg.norm(side, axis=1)
    extent = float(np.ptp(points, axis=0).max())
    long = length > _NEAR * extent  # two extremes that coincide except for rounding have no side between them
    if not long.any():
        return points
    limits = np.einsum("kj,kj->k", extreme, side) + depth * extent * length
    inside = np.ones(len(points), dtype=bool)
    for normal, limit in zip(side[long], limits[long], strict=True):
        inside &= points @ normal > limit
    return np.concatenate([points[~inside], extreme])
