"""Simple solids as (positions, triangles): box, cylinder, torus, icosphere, rectangle.

The tessellations equal trimesh's (`trimesh.creation`), so that scenes built with either have the same triangles. They are
implemented here because importing trimesh takes longer than rendering them.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from glshadow.core.spaces import Array

Solid = tuple[Array, NDArray[np.int32]]

# Corner 4 i + 2 j + k of the unit cube is (i, j, k); twelve triangles, outward.
_BOX = "130 410 032 240 173 514 571 372 642 276 654 756"
# Corners as in `icosphere`, in base 12.
_ICOSAHEDRON = "0b5 051 017 07a 0ab 159 5b4 ba2 a76 718 394 342 326 368 389 495 24b 62a 867 981"


def box(extents: ArrayLike, centre: ArrayLike = (0.0, 0.0, 0.0)) -> Solid:
    """Cuboid with edge lengths `extents` (3,): 8 vertices, 12 triangles."""
    corners = np.array([[i, j, k] for i in (0, 1) for j in (0, 1) for k in (0, 1)], dtype=np.float64)
    return (corners - 0.5) * np.asarray(extents) + np.asarray(centre), _triangles(_BOX).astype(np.int32)


def _triangles(text: str) -> NDArray[np.int64]:
    return np.array([[int(digit, 12) for digit in word] for word in text.split()], dtype=np.int64)


def rectangle(corner: ArrayLike, edge_u: ArrayLike, edge_v: ArrayLike) -> Solid:
    """Two triangles over corner + s edge_u + t edge_v, facing edge_u x edge_v."""
    corner, u, v = (np.asarray(value, dtype=np.float64) for value in (corner, edge_u, edge_v))
    return np.stack([corner, corner + u, corner + u + v, corner + v]), np.array([[0, 1, 2], [0, 2, 3]], dtype=np.int32)


def cylinder(radius: float, height: float, sections: int) -> Solid:
    """Closed cylinder about the z axis, centred on the origin: 4 * sections triangles."""
    angle = np.linspace(0.0, 2.0 * np.pi, sections + 1)[:-1]
    ring = radius * np.column_stack([np.cos(angle), np.sin(angle), np.zeros(sections)])
    half = np.array([0.0, 0.0, height / 2.0])
    positions = np.concatenate([ring - half, ring + half, [-half, half]])
    low = np.arange(sections)
    low_next = (low + 1) % sections
    high, high_next = low + sections, low_next + sections
    bottom, top = np.full_like(low, 2 * sections), np.full_like(low, 2 * sections + 1)
    faces = [(bottom, low_next, low), (low, low_next, high), (high, low_next, high_next), (high, high_next, top)]
    return positions, np.concatenate([np.column_stack(face) for face in faces]).astype(np.int32)


def torus(major_radius: float, minor_radius: float, major_sections: int, minor_sections: int) -> Solid:
    """Torus about the z axis: 2 * major_sections * minor_sections triangles."""
    theta = np.linspace(0.0, 2.0 * np.pi, major_sections + 1)[:-1, None]
    phi = np.linspace(0.0, 2.0 * np.pi, minor_sections + 1)[None, :-1]
    distance = major_radius + minor_radius * np.cos(phi)
    height = np.broadcast_to(minor_radius * np.sin(phi), (major_sections, minor_sections))
    positions = np.stack([distance * np.cos(theta), distance * np.sin(theta), height], axis=-1).reshape(-1, 3)
    i, j = np.meshgrid(np.arange(major_sections), np.arange(minor_sections), indexing="ij")
    i_next, j_next = (i + 1) % major_sections, (j + 1) % minor_sections
    a, b, c, d = (p * minor_sections + q for p, q in ((i, j), (i_next, j), (i, j_next), (i_next, j_next)))
    triangles = np.stack([np.stack([a, b, c], axis=-1), np.stack([c, b, d], axis=-1)], axis=2)
    return positions, triangles.reshape(-1, 3).astype(np.int32)


def icosphere(subdivisions: int, radius: float) -> Solid:
    """Icosahedron with each face cut in four `subdivisions` times and pushed out: 20 * 4**subdivisions triangles."""
    long = np.sqrt((1.0 + 1.0 / np.sqrt(5.0)) / 2.0)
    short = np.sqrt(1.0 - long * long)
    flat = np.array([[-short, long], [short, long], [-short, -long], [short, -long]])
    positions = np.zeros((12, 3))
    for block, axes in enumerate(([0, 1], [1, 2], [2, 0])):
        positions[4 * block : 4 * block + 4, axes] = flat
    triangles = _triangles(_ICOSAHEDRON)
    for _ in range(subdivisions):
        positions, triangles = _quartered(positions, triangles)
        positions = positions / np.linalg.norm(positions, axis=1, keepdims=True)
    return positions * radius, triangles.astype(np.int32)


def _quartered(positions: Array, triangles: NDArray[np.int64]) -> tuple[Array, NDArray[np.int64]]:
    start, end = triangles.ravel(), triangles[:, [1, 2, 0]].ravel()
    keys, middle = np.unique(np.minimum(start, end) * len(positions) + np.maximum(start, end), return_inverse=True)
    middles = 0.5 * (positions[keys // len(positions)] + positions[keys % len(positions)])
    (a, b, c), (ab, bc, ca) = triangles.T, middle.reshape(-1, 3).T + len(positions)
    corners = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
    quarters = np.stack([np.column_stack(corner) for corner in corners], axis=1)
    return np.concatenate([positions, middles]), quarters.reshape(-1, 3)


def joined(solids: Sequence[Solid]) -> Solid:
    """Several solids as one list of vertices and triangles."""
    starts = np.cumsum([0] + [len(positions) for positions, _ in solids[:-1]])
    triangles = np.concatenate([faces + start for (_, faces), start in zip(solids, starts, strict=True)])
    return np.concatenate([positions for positions, _ in solids]), triangles.astype(np.int32)


def vertex_normals(solid: Solid) -> NDArray[np.float32]:
    """Unit vertex normals (V, 3): face normals weighted by the face's angle at the vertex."""
    positions, triangles = solid
    corners = positions[triangles]
    face = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    face /= np.linalg.norm(face, axis=1, keepdims=True)
    normals = np.zeros_like(positions)
    for k in range(3):
        u, v = corners[:, (k + 1) % 3] - corners[:, k], corners[:, (k + 2) % 3] - corners[:, k]
        angle = np.arctan2(np.linalg.norm(np.cross(u, v), axis=1), (u * v).sum(axis=1))
        for axis in range(3):
            normals[:, axis] += np.bincount(triangles[:, k], face[:, axis] * angle, len(positions))
    return np.asarray(normals / np.linalg.norm(normals, axis=1, keepdims=True), dtype=np.float32)
