"""The curved surface that vertex normals describe over flat triangles, and the points on it where a smooth mesh receives light.

A flat triangle may face away from the light while the interpolated normal still faces it: the terminator then follows triangle edges.
Shadow rays of a smooth mesh therefore start on the rounded surface, after Hanika 2021, "Hacking the Shadow Terminator", Ray Tracing
Gems II, chapter 4: P' = P + sum b_i max(0, -n_i . (P - V_i)) n_i, with barycentric weights b, vertices V and their normals n. Over
convex parts P' is outside the facets, over concave ones it does not move. A facet well below all of the light needs no correction, and
where normals were averaged over large faces the offset would move its shadows: the offset fades to zero there, as in Cycles.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from glshadow.core.spaces import Array

LEAST_COSINE = 0.75
"""Cosine between a vertex normal and its triangle's. Below it (41 degrees), the normal was averaged across a hard edge, as of a box."""
FADE = 0.1
"""Cosine between a triangle's normal and the lowest point of the light. Above it, points on the triangle are not moved."""
_FLAT = 1e-3
"""Radians up to which vertex normals equal the triangle's: a jump of a quarter of a level of 255."""
_MOST_RISE = 0.5  # share of a triangle's least altitude
_STEPS = 32767  # per coordinate, to either side


def unit_vectors(vectors: Array) -> Array:
    """Vectors (..., 3) scaled to length 1; zero stays zero."""
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.asarray(vectors / np.where(length > 0.0, length, 1.0))


def sides(faces: Array, normals: Array) -> NDArray[np.int8]:
    """Which triangles are smooth: 1, or -1 if the vertex normals oppose the winding; 0: flat, or with normals that do not match.

    Parameters
    ----------
    faces : (T, 3) float
        Unit normals of the triangles.
    normals : (T, 3, 3) float
        Unit normals of their vertices.
    """
    a, b, c = (_dots(normals[:, k], faces) for k in range(3))
    side = np.sign(a)
    least = np.minimum(np.minimum(a * side, b * side), c * side)
    bent = 1.0 - least > 0.5 * _FLAT**2
    return np.where((least >= LEAST_COSINE) & bent, side, 0.0).astype(np.int8)


def _dots(a: Array, b: Array) -> Array:
    """Dot products (T,) of vectors (T, 3); several times as fast as einsum."""
    return np.asarray(a[:, 0] * b[:, 0] + a[:, 1] * b[:, 1] + a[:, 2] * b[:, 2])


def lift(weights: Array, points: Array, corners: Array, normals: Array, share: Array, cosine: Array) -> Array:
    """Offsets (N, 3) from points (N, 3) on triangles to where they receive light. Twin: glsl/lib/smooth_point.glsl

    Parameters
    ----------
    weights : (N, 3) float64
        Barycentric.
    corners, normals : (N, 3, 3) float64
        Vertices, and their unit normals on the visible side.
    share : (N,) float64
        See `heights`.
    cosine : (N,) float64
        Between the triangle's normal on that side and the lowest point of the light.
    """
    below = np.maximum(-np.einsum("nkj,nkj->nk", points[:, None] - corners, normals), 0.0)
    share = share * np.clip(1.0 - cosine / FADE, 0.0, 1.0)
    return np.asarray(np.einsum("nk,nkj->nj", weights * below, normals) * share[:, None])


def heights(corners: Array, normals: Array) -> tuple[Array, Array]:
    """Largest offsets of points of triangles (T, 3, 3), on either side (T,), and the share of the offset that is applied (T,).

    A vertex's part of the offset is at most b (1 - b) of the height that its normal gives another vertex. An arc of twice the largest angle
    rises by .37 of its chord. A rise of more than half a triangle's altitude is therefore no arc, but the end of a long bevel.
    """
    edges = [corners[:, (k + 1) % 3] - corners[:, k] for k in range(3)]
    ends = [np.abs(_dots(edges[k], normals[:, end])) for k in range(3) for end in (k, (k + 1) % 3)]
    most = 2.0 / 3.0 * np.maximum.reduce(ends)
    longest = np.sqrt(np.maximum.reduce([_dots(edge, edge) for edge in edges]))
    squares = _dots(edges[0], edges[0]) * _dots(edges[1], edges[1]) - _dots(edges[0], edges[1]) ** 2  # twice the area
    altitude = np.sqrt(np.maximum(squares, 0.0)) / np.where(longest > 0.0, longest, 1.0)
    share = np.minimum(1.0, _MOST_RISE * altitude / np.where(most > 0.0, most, 1.0))
    return most * share, share


def pack_octahedral(vectors: Array) -> NDArray[np.uint32]:
    """Unit vectors (..., 3) in 16 + 16 bits, within 6.5e-5 radians; axes are exact. Meyer et al. 2010, "On Floating-Point Normal Vectors".

    Twin: glsl/lib/octahedral.glsl, which unpacks them.
    """
    x, y, z = np.moveaxis(vectors / np.maximum(np.abs(vectors).sum(axis=-1, keepdims=True), 1e-30), -1, 0)
    folded = (1.0 - np.abs([y, x])) * np.where(np.stack([x, y]) < 0.0, -1.0, 1.0)
    u, v = np.rint(np.where(z < 0.0, folded, [x, y]) * _STEPS).astype(np.int64) + 32768
    return np.asarray(u | v << 16, dtype=np.uint32)
