"""Smooth normals of polygons without normals: averaged around each vertex, up to edges that are creases."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from glshadow.core.spaces import Array
from glshadow.geometry.parts import representatives
from glshadow.geometry.smooth import unit_vectors
from glshadow.geometry.welding import welded

Indices = NDArray[np.int64]

MOST_AROUND = 8
"""Polygons at one edge up to which those that belong together are found; more meet at a crease."""
_RIGHT = 0.5 * np.pi  # radians; where more than two polygons meet, front and back of a sheet are kept apart
_ROUNDING = (
    1e-5  # relative error of an angle in a file of float32: an edge of just the crease angle is a crease, everywhere
)
_FLAT = 1e-6  # radians between smooth and flat normals below which nothing is smooth


@np.errstate(all="ignore")  # overflows: such coordinates cannot be drawn, which is said later
def smooth_normals(
    positions: Array, corners: Indices, counts: Indices, crease_rad: float | None, groups: Indices | None = None
) -> tuple[Array, Indices] | None:
    """Normals of polygons, as rows and the row of each corner.

    An edge is smooth if two polygons traverse it in opposite directions and the angle between their normals is below `crease_rad`, or, with
    `groups`, if both are in one group. A corner's normal is the mean of the normals of the polygons that smooth edges
    connect around the vertex, each weighted by its angle there, so that triangulation does not change it (Thürmer and Wüthrich
    1998, "Computing Vertex Normals from Polygonal Facets", Journal of Graphics Tools 3).

    Parameters
    ----------
    positions : (V, 3)
        Equal positions are one vertex.
    corners : (C,)
        Vertex of each corner, polygon by polygon.
    counts : (P,)
        Corners of each polygon.
    crease_rad : float, optional
        None: only `groups` counts.
    groups : (P,), optional
        Smoothing group of each polygon; 0: flat.

    Returns
    -------
    normals : (N, 3) float64
    of : (C,)
        Row of each corner.
        None instead of both if all normals are those of the polygons.
    """
    vertex = welded(positions)[corners]
    polygon = np.repeat(np.arange(len(counts)), counts)
    following, previous = _around(counts, polygon)
    faces, angles = _faces(np.ascontiguousarray(positions.T), corners, counts, polygon, following, previous)
    first, second, several = _across(vertex, following)
    a, b = faces[:, polygon[first]], faces[:, polygon[second]]
    bend = np.arctan2(_length(_cross(a, b)), _dot(a, b))
    smooth = (
        a.any(axis=0) & b.any(axis=0) & (bend < np.pi * (1.0 - _ROUNDING))
    )  # not the two sides of one sheet, at its border
    if crease_rad is not None:
        smooth &= bend < crease_rad * (1.0 - _ROUNDING)
    if groups is not None:
        smooth &= (groups[polygon[first]] == groups[polygon[second]]) & (groups[polygon[first]] != 0)
        smooth &= ~several | (bend < _RIGHT)
    if not (bend[smooth] > _FLAT).any():
        return None
    first, second = first[smooth], second[smooth]
    root = representatives(
        np.concatenate([first, following[first]]), np.concatenate([following[second], second]), len(corners)
    )
    first_of = root == np.arange(len(corners), dtype=np.int32)
    of = (np.cumsum(first_of) - 1)[root]
    total = np.stack([np.bincount(of, angles * column[polygon]).astype(np.float64) for column in faces], axis=1)
    lost = ~total.any(axis=1)
    total[lost] = faces.T[polygon[first_of][lost]]
    return unit_vectors(total), of


def _around(counts: Indices, polygon: Indices) -> tuple[Indices, Indices]:
    """The corners (C,) that follow and precede each corner in its polygon."""
    base = (np.cumsum(counts) - counts)[polygon]
    place = np.arange(len(polygon)) - base
    size = counts[polygon]
    following: Indices = base + np.where(place + 1 < size, place + 1, 0)
    previous: Indices = base + np.where(place > 0, place, size) - 1
    return following, previous


def _faces(
    places: Array, corners: Indices, counts: Indices, polygon: Indices, following: Indices, previous: Indices
) -> tuple[Array, Array]:
    """Unit normals (3, P) of polygons, zero without area; and the angle (C,) at each corner. `places`: (3, V)."""
    if (counts == 3).all():
        a, b, c = (places[:, corners[k::3]] for k in range(3))
        ab, ac, bc = b - a, c - a, c - b
        areas = _cross(ab, ac)
        across = _length(areas)
        angles = np.stack(
            [np.arctan2(across, _dot(ab, ac)), np.arctan2(across, -_dot(ab, bc)), np.arctan2(across, _dot(ac, bc))],
            axis=1,
        )
        return areas / np.where(across > 0.0, across, 1.0), angles.ravel()
    starts = np.cumsum(counts) - counts
    points = places[:, corners]
    relative = points - points[:, starts[polygon]]  # so that a polygon far from the origin keeps its precision
    parts = _cross(relative, relative[:, following])
    areas = np.stack([np.bincount(polygon, column, len(counts)).astype(np.float64) for column in parts])
    size = _length(areas)
    ahead = points[:, following] - points
    behind = -ahead[:, previous]
    return areas / np.where(size > 0.0, size, 1.0), np.arctan2(_length(_cross(ahead, behind)), _dot(ahead, behind))


# vectors are (3, N) here: numpy reduces and multiplies columns several times as fast as rows of three


def _cross(a: Array, b: Array) -> Array:
    return np.stack([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])


def _dot(a: Array, b: Array) -> Array:
    found: Array = a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
    return found


def _length(a: Array) -> Array:
    return np.sqrt(_dot(a, a))


def _across(vertex: Indices, following: Indices) -> tuple[Indices, Indices, NDArray[np.bool_]]:
    """Pairs of corners at which two polygons begin one edge in opposite directions, and whether more than two meet there."""
    start, end = vertex, vertex[following]
    edges = np.flatnonzero(start != end)
    low, high = np.minimum(start, end)[edges], np.maximum(start, end)[edges]
    key = low * (int(vertex.max()) + 1) + high
    order = np.argsort(key)
    key, edges = key[order], edges[order]
    new = np.append(True, key[1:] != key[:-1])[: len(key)]
    size = np.diff(np.append(np.flatnonzero(new), len(key)))[np.cumsum(new) - 1]
    firsts, seconds = [], []
    for step in range(1, MOST_AROUND):
        pairs = np.flatnonzero((key[step:] == key[:-step]) & (size[step:] <= MOST_AROUND))
        if len(pairs) == 0:
            break
        first, second = edges[pairs], edges[pairs + step]
        opposite = start[first] == end[second]
        firsts.append(first[opposite])
        seconds.append(second[opposite])
    first, second = (np.concatenate([np.zeros(0, dtype=np.int64), *each]) for each in (firsts, seconds))
    many = np.zeros(len(vertex), dtype=bool)
    many[edges[size > 2]] = True
    return first, second, many[first]
