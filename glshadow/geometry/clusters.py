"""Clusters: neighbouring triangles that are culled together, each with a box and a mean normal."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from glshadow.core.spaces import Array

SIZE = 64
"""Triangles per cluster. Of a folded surface (brain_cortex.ply, 608,752 triangles) a directional light sees 11 %. They are in 23 % of the
clusters of 32, and in 26 % of those of 64. Half the size costs twice the tests."""
LEAST = 2 * SIZE
"""A mesh with at most this many triangles is one cluster, without sorting."""
_BITS = 10  # bits per coordinate along the curve
_AT_ONCE = 1 << 12  # clusters per block
_ROUNDED = 1e-13  # share of a coordinate: more than float64 rounds on the way to the world


@dataclass(frozen=True, eq=False)
class Clusters:
    """The clusters of one mesh, in mesh units.

    Attributes
    ----------
    order : (T,) uint32
        Triangle indices, cluster by cluster, ascending in each; cluster k starts at SIZE * k.
    centre, half : (C, 3) float64
        Middle and half extents of its box.
    normal : (C, 3) float64
        Mean of its triangles' unit normals: short if they differ.
    """

    order: NDArray[np.uint32]
    centre: Array
    half: Array
    normal: Array

    @property
    def count(self) -> int:
        """C."""
        return len(self.centre)


def make_clusters(positions: NDArray[np.float32], triangles: NDArray[np.int32]) -> Clusters:
    """Group a mesh's triangles along a Morton curve through their middles.

    Parameters
    ----------
    positions : (V, 3) float32
        Vertices as drawn.
    triangles : (T, 3) int32
        T > 0; a mesh of at most LEAST is one cluster.

    References
    ----------
    Morton 1966, "A computer oriented geodetic data base and a new technique in file sequencing", IBM.
    """
    count = len(triangles)
    size = SIZE if count > LEAST else count
    order = _along_curve(positions, triangles) if count > LEAST else np.arange(count, dtype=np.uint32)
    full = count - count % size
    order[:full].reshape(-1, size).sort(axis=1)  # vertex sharing is best in the file's order
    order[full:].sort()
    # a short last cluster repeats its last triangle, which does not change its bounds
    padded = np.concatenate([order, np.repeat(order[-1:], -count % size)]).reshape(-1, size)
    parts = [_bounds(positions, triangles[padded[k : k + _AT_ONCE]]) for k in range(0, len(padded), _AT_ONCE)]
    return Clusters(order, *(np.concatenate(part) for part in zip(*parts, strict=True)))


def _along_curve(positions: NDArray[np.float32], triangles: NDArray[np.int32]) -> NDArray[np.uint32]:
    """Triangle indices (T,) in the order of their centres along the curve; in their original order within a cell."""
    low = positions.min(axis=0).astype(np.float64)
    extent = max(float((positions.max(axis=0) - low).max()), 1e-300)
    key = np.zeros(len(triangles), dtype=np.uint64)
    for axis in range(3):
        column = positions[:, axis].astype(np.float64)
        middle = (column[triangles[:, 0]] + column[triangles[:, 1]] + column[triangles[:, 2]]) / 3.0
        cell = np.clip((middle - low[axis]) / extent * (2**_BITS - 1), 0, 2**_BITS - 1).astype(np.uint64)
        for shift, mask in ((16, 0x30000FF), (8, 0x300F00F), (4, 0x30C30C3), (2, 0x9249249)):
            cell = (cell | cell << np.uint64(shift)) & np.uint64(mask)
        key |= cell << np.uint64(axis)
    # with the index appended, a key needs no stable sort
    key = key << np.uint64(32) | np.arange(len(triangles), dtype=np.uint64)
    key.sort()
    return (key & np.uint64(0xFFFFFFFF)).astype(np.uint32)


def _bounds(positions: NDArray[np.float32], corners: NDArray[np.int32]) -> tuple[Array, Array, Array]:
    """Centre, half extents and mean normal of clusters of vertex numbers (C, SIZE, 3)."""
    columns = [positions[:, axis][corners].astype(np.float64) for axis in range(3)]
    low = np.stack([column.min(axis=(1, 2)) for column in columns], axis=-1)
    high = np.stack([column.max(axis=(1, 2)) for column in columns], axis=-1)
    (ax, bx), (ay, by), (az, bz) = ((c[..., 1] - c[..., 0], c[..., 2] - c[..., 0]) for c in columns)
    normal = np.stack([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx])
    length = np.sqrt((normal**2).sum(axis=0))
    normal /= np.where(length > 0.0, length, 1.0)
    return 0.5 * (low + high), 0.5 * (high - low), normal.mean(axis=2).T


@dataclass(frozen=True, eq=False)
class Placed:
    """The clusters of all bodies of a scene in sequence, in world space relative to the scene's origin; a row per coordinate.

    Attributes
    ----------
    body : (C,) int64
        Body of each cluster.
    first : (N + 1,) int64
        First cluster of each body.
    centre, half : (3, C) float64
        Their boxes.
    normal : (3, C) float64
        Approximate mean normals, no longer than 1.
    size : (3, N) float64
        Largest coordinates of a body's vertices, in mesh units.
    """

    body: NDArray[np.int64]
    first: NDArray[np.int64]
    centre: Array
    half: Array
    normal: Array
    size: Array

    @property
    def count(self) -> int:
        """C."""
        return len(self.body)

    def middle(self, rows: Array) -> Array:
        """Affine rows (k, 4) applied to the centres: (k, C)."""
        return combined(rows[:, :3], self.centre) + rows[:, 3:]

    def reach(self, rows: Array) -> Array:
        """Half extents of the clusters after affine rows (k, 4): (k, C)."""
        return combined(np.abs(rows[:, :3]), self.half)


def combined(rows: Array, columns: Array) -> Array:
    """Rows (k, j) times columns (j, C), without BLAS, whose threads wait for the driver's (50 ms for 40,000 columns instead of 0.4)."""
    return np.asarray(np.einsum("kj,jc->kc", rows, columns))


def place(meshes: list[Clusters], number: list[int], world_from_mesh: Array, normal_from_mesh: Array) -> Placed:
    """Transform clusters to their bodies' positions.

    Parameters
    ----------
    number : list of int
        Index of the mesh of each body (N,).
    world_from_mesh : (N, 4, 4) float64
        Relative to the scene's origin, for vertices as drawn.
    normal_from_mesh : (N, 3, 3) float64
        Matrices for normals, of any scale.
    """
    mesh = np.asarray(number)
    counts = np.array([each.count for each in meshes])
    first = np.concatenate([[0], np.cumsum(counts[mesh])])
    body = np.repeat(np.arange(len(mesh)), counts[mesh])
    rows = np.arange(first[-1]) - first[body] + (np.cumsum(counts) - counts)[mesh][body]
    local, half, normal = (
        np.concatenate([getattr(m, name) for m in meshes])[rows] for name in ("centre", "half", "normal")
    )
    linear = world_from_mesh[:, :3, :3]
    centre = np.einsum("cij,cj->ic", linear[body], local) + world_from_mesh[body, :3, 3].T
    half = np.einsum("cij,cj->ic", np.abs(linear)[body], half)
    short = np.linalg.norm(normal, axis=1)
    normal = np.einsum("cij,cj->ic", normal_from_mesh[body], normal)
    normal *= short / np.maximum(np.linalg.norm(normal, axis=0), 1e-300)
    sizes = np.stack([(np.abs(each.centre) + each.half).max(axis=0) for each in meshes], axis=1)
    return Placed(body, first, centre, half + _ROUNDED * (np.abs(centre) + half).sum(axis=0), normal, sizes[:, mesh])
