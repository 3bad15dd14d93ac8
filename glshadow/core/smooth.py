"""The surface that vertex normals describe over flat triangles, and the point on it from which a smooth mesh sees a light.

A flat triangle turns away from the light where the interpolated normal still faces it: the terminator follows the triangles' edges.
Shadow rays of a smooth mesh therefore start on the rounded surface, after Hanika 2021, "Hacking the Shadow Terminator", Ray Tracing
Gems II, chapter 4: P' = P + sum b_i max(0, -n_i . (P - V_i)) n_i, with barycentric weights b, vertices V and their normals n. Over
convex parts P' lies outside the facets, as continuous as the normals are; over concave ones it stays where it is.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from glshadow.core.spaces import Array

LEAST_COSINE = 0.75
"""Of a vertex normal and its triangle's: below it (41 degrees), the normal was averaged across a hard edge, a right angle for one."""
_FLAT = 1e-3
"""Radians up to which vertex normals are the triangle's own: a jump of a quarter of a level of 255."""
_STEPS = 32767  # of a coordinate, to either side


def unit_vectors(vectors: Array) -> Array:
    """Vectors (..., 3) scaled to length 1; zero stays zero."""
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.asarray(vectors / np.where(length > 0.0, length, 1.0))


def sides(faces: Array, normals: Array) -> NDArray[np.int8]:
    """Which triangles are round: 1, or -1 where the vertex normals look against the winding; 0: flat, or their normals do not fit.

    Parameters
    ----------
    faces : (T, 3) float
        Unit normals of the triangles.
    normals : (T, 3, 3) float
        Unit normals of their vertices.
    """
    cosine = np.einsum("tkj,tj->tk", normals, faces)
    side = np.sign(cosine[:, 0])
    fits = (cosine * side[:, None]).min(axis=1) >= LEAST_COSINE
    apart = normals - (side[:, None] * faces)[:, None]
    bent = np.einsum("tkj,tkj->tk", apart, apart).max(axis=1) > _FLAT**2
    return np.where(fits & bent, side, 0.0).astype(np.int8)


def lift(weights: Array, points: Array, corners: Array, normals: Array) -> Array:
    """Offsets (N, 3) from points (N, 3) on triangles to the rounded surface.

    Parameters
    ----------
    weights : (N, 3) float64
        Barycentric.
    corners, normals : (N, 3, 3) float64
        Vertices, and their unit normals on the side that is seen.
    """
    below = np.maximum(-np.einsum("nkj,nkj->nk", points[:, None] - corners, normals), 0.0)
    return np.asarray(np.einsum("nk,nkj->nj", weights * below, normals))


def most_lift(corners: Array, normals: Array) -> float:
    """No point of triangles (T, 3, 3) is moved farther: a vertex's share of the offset is at most b (1 - b) of its largest height."""
    edges = corners[:, None] - corners[:, :, None]  # [t, i, j]: from vertex i to vertex j
    heights = -np.einsum("tijk,tik->tij", edges, normals)
    return 2.0 / 3.0 * float(max(heights.max(initial=0.0), 0.0))


def pack_octahedral(vectors: Array) -> NDArray[np.uint32]:
    """Unit vectors (..., 3) in 16 + 16 bits, within 5e-5 radians; axes are exact. Meyer et al. 2010, "On Floating-Point Normal Vectors".

    Twin: glsl/lib/octahedral.glsl, which unpacks them.
    """
    x, y, z = np.moveaxis(vectors / np.maximum(np.abs(vectors).sum(axis=-1, keepdims=True), 1e-30), -1, 0)
    folded = (1.0 - np.abs([y, x])) * np.where(np.stack([x, y]) < 0.0, -1.0, 1.0)
    u, v = np.rint(np.where(z < 0.0, folded, [x, y]) * _STEPS).astype(np.int64) + 32768
    return np.asarray(u | v << 16, dtype=np.uint32)
