"""The region that triangles in a plane cover, from the edges that they do not share."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshadow.core.spaces import Array
from glshadow.errors import GlshadowError
from glshadow.geometry.parts import representatives
from glshadow.outlines.casters import Indices

THIN = 1e-13
"""Slivers of less than this mean width, relative to coordinates of about 1, are rounding: they are removed, and filled as holes."""
_TOGETHER = 2000  # edges of small parts that are intersected at once
_STRIPS = 2048


def import_shapely() -> Any:
    """shapely, or an error that says how to install it."""
    try:
        import shapely
    except ImportError as error:
        raise GlshadowError(
            f"outlines need shapely ({error}); install it with: pip install 'glshadow[outline]'"
        ) from error
    return shapely


def covered(points: Array, triangles: Indices) -> list[Any]:
    """Polygons whose union is that of triangles.

    Each triangle is turned counter-clockwise. Edges that two triangles pass in opposite directions cancel; around a point, the others
    wind as often as triangles cover it. So all edges within the region drop out before anything is intersected, and of a closed mesh
    its silhouette edges remain.

    Parameters
    ----------
    points : (V, 2) float64
        Of about 1.
    triangles : (T, 3) int64

    Returns
    -------
    list of shapely polygons, which may overlap
    """
    shapely = import_shapely()
    a, b, c = (points[triangles[:, k]] for k in range(3))
    area = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])
    flat = area == 0.0
    triangles = np.where((area < 0.0)[:, None], triangles[:, ::-1], triangles)[~flat]
    if not len(triangles):
        return []
    start, end, times = _unshared(triangles, len(points))
    part = representatives(triangles[:, :2].T.ravel(), triangles[:, 1:].T.ravel(), len(points))
    single = np.bincount(part[triangles[:, 0]], minlength=len(points)) == 1
    alone = single[part[triangles[:, 0]]]
    found: list[Any] = list(shapely.polygons(points[triangles[alone]]))
    rest = ~single[part[start]]
    start, end, times = start[rest], end[rest], times[rest]
    for group in _groups(points, part[start], start):
        found += _wound(points[start[group]], points[end[group]], times[group])
    return found


def _unshared(triangles: Indices, count: int) -> tuple[Indices, Indices, Indices]:
    """Directed edges that are left over, from and to vertices, and how many times each is passed."""
    start, end = triangles.T.ravel(), np.roll(triangles, -1, axis=1).T.ravel()
    low, high = np.minimum(start, end), np.maximum(start, end)
    keys, where = np.unique(low * np.int64(count) + high, return_inverse=True)
    times = np.bincount(where.ravel(), np.where(start < end, 1.0, -1.0), len(keys)).astype(np.int64)
    left = times != 0
    low, high, times = keys[left] // count, keys[left] % count, times[left]
    forward = times > 0
    return np.where(forward, low, high), np.where(forward, high, low), np.abs(times)


def _groups(points: Array, part: NDArray[np.int32], start: Indices) -> list[Indices]:
    """Edges in groups: those of a large connected part, or of small parts that are near each other."""
    if not len(part):
        return []
    parts, where, sizes = np.unique(part, return_inverse=True, return_counts=True)
    low = np.full((len(parts), 2), np.inf)
    np.minimum.at(low, where.ravel(), points[start])
    cells = np.clip((low * 256.0).astype(np.int64) + 512, 0, 1023)  # coordinates are about 1
    key = np.zeros(len(parts), dtype=np.int64)
    for bit in range(10):
        key |= ((cells[:, 0] >> bit) & 1) << (2 * bit) | ((cells[:, 1] >> bit) & 1) << (2 * bit + 1)
    order = np.lexsort((np.arange(len(parts)), key))
    rank = np.zeros(len(parts), dtype=np.int64)
    rank[order] = np.arange(len(parts))
    batch = np.cumsum(sizes[order]) // _TOGETHER
    edges = np.argsort(rank[where.ravel()], kind="stable")
    return np.split(edges, np.flatnonzero(np.diff(batch[rank[where.ravel()]][edges])) + 1)


def _wound(start: Array, end: Array, times: Indices) -> list[Any]:
    """Polygons around which directed edges (E, 2) to (E, 2) wind."""
    shapely = import_shapely()
    lines = shapely.union_all(shapely.linestrings(np.stack([start, end], axis=1)))
    faces = shapely.get_parts(shapely.polygonize(shapely.get_parts(lines)))
    if not len(faces):
        return []
    inner = shapely.get_coordinates(shapely.point_on_surface(faces))
    kept = faces[winding(inner, start, end, times) != 0]
    return list(shapely.get_parts(shapely.coverage_union_all(kept))) if len(kept) else []


def winding(points: Array, start: Array, end: Array, times: Indices) -> Indices:
    """How often directed edges from (E, 2) to (E, 2), each passed several times, wind around points (N, 2).

    References
    ----------
    Hormann, Agathos 2001, "The point in polygon problem for arbitrary polygons", Computational Geometry 20.
    """
    low, high = np.minimum(start[:, 1], end[:, 1]), np.maximum(start[:, 1], end[:, 1])
    bottom, top = float(low.min()), float(high.max())
    strips = int(np.clip(np.sqrt(len(start)), 1, _STRIPS))
    scale = strips / (top - bottom) if top > bottom else 0.0

    def strip(y: Array) -> Indices:
        return np.clip(((y - bottom) * scale).astype(np.int64), 0, strips - 1)

    first, last = strip(low), strip(high)
    length = last - first + 1
    edge = np.repeat(np.arange(len(start)), length)
    at = np.arange(len(edge)) - np.repeat(np.cumsum(length) - length, length) + np.repeat(first, length)
    order = np.argsort(at, kind="stable")
    edge, ends = edge[order], np.searchsorted(at[order], np.arange(strips + 1))
    own = strip(points[:, 1])
    rows = np.argsort(own, kind="stable")
    borders = np.searchsorted(own[rows], np.arange(strips + 1))
    result = np.zeros(len(points), dtype=np.int64)
    sign = np.where(end[:, 1] > start[:, 1], times, -times)
    for k in range(strips):
        mine, here = rows[borders[k] : borders[k + 1]], edge[ends[k] : ends[k + 1]]
        step = max(4_000_000 // max(len(here), 1), 1)
        for i in range(0, len(mine), step):
            some = mine[i : i + step]
            x, y = points[some, 0, None], points[some, 1, None]
            a, b = start[here], end[here]
            spans = (low[here] <= y) & (y < high[here])
            side = (b[:, 0] - a[:, 0]) * (y - a[:, 1]) - (x - a[:, 0]) * (b[:, 1] - a[:, 1])
            result[some] = ((spans & (side * np.sign(sign[here]) > 0.0)) * sign[here]).sum(axis=1)
    return result


def united(polygons: list[Any]) -> Any:
    """The union of polygons as a MultiPolygon, without slivers; exteriors counter-clockwise."""
    shapely = import_shapely()
    return tidy(shapely.union_all(np.array(polygons, dtype=object)) if polygons else shapely.MultiPolygon())


def tidy(region: Any) -> Any:
    """The polygons of a region as a MultiPolygon, without slivers; exteriors counter-clockwise."""
    shapely = import_shapely()
    kept = []
    for part in shapely.get_parts(region):
        if part.geom_type != "Polygon" or _thin(part.exterior):
            continue
        holes = [each for each in part.interiors if not _thin(each)]
        kept.append(shapely.Polygon(part.exterior, holes) if len(holes) < len(part.interiors) else part)
    return shapely.orient_polygons(shapely.MultiPolygon(kept))


def _thin(ring: Any) -> bool:
    shapely = import_shapely()
    return bool(shapely.area(shapely.polygons(ring)) <= THIN * ring.length)
