"""First hits of rays on triangles in Embree, and dot products of arrays."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from glshadow.core.spaces import Array
from glshadow.errors import ReferenceUnavailable

Ints = NDArray[np.int32]


class Embree:
    """Some of the triangles in Embree, scaled by a power of two to about 1.

    Parameters
    ----------
    corners : (T, 3, 3) float64
        Of all triangles; with `indices` vertices (V, 3).
    numbers : (N,) ints
        Indices of those in Embree.
    size : float
        Largest coordinate.
    indices : (N, 3) int32, optional
        Vertices of those in Embree.
    """

    def __init__(self, corners: Array, numbers: NDArray[np.integer], size: float, indices: Ints | None = None) -> None:
        try:
            from embreex.mesh_construction import TriangleMesh
            from embreex.rtcore_scene import EmbreeScene
        except ImportError as error:
            raise ReferenceUnavailable(
                f"ray tracing needs embreex ({error}); install it with: pip install 'glshadow[reference]'"
            ) from error
        self.numbers = numbers.astype(np.int32)
        self.scale = 2.0 ** -np.floor(np.log2(size))
        self.scene = EmbreeScene(robust=True)  # watertight: shared edges are decided consistently
        if len(numbers) and indices is None:
            TriangleMesh(self.scene, np.ascontiguousarray(corners[numbers] * self.scale, dtype=np.float32))
        elif len(numbers):
            TriangleMesh(self.scene, np.ascontiguousarray(corners * self.scale, dtype=np.float32), indices)

    def first(self, starts: Array, directions: Array, length: Array) -> Ints:
        """Index of the first triangle within `length` (N,) times the direction (N, 3) of each ray, or -1."""
        if len(starts) == 0 or len(self.numbers) == 0:
            return np.full(len(starts), -1, dtype=np.int32)
        norm = np.sqrt(dot(directions, directions))
        unit = directions / norm[:, None]
        reach = np.clip(length * norm * self.scale, 0.0, 1e30).astype(np.float32)
        hit = self.scene.run((starts * self.scale).astype(np.float32), unit.astype(np.float32), dists=reach)
        return np.where(hit >= 0, self.numbers[hit], np.int32(-1))


def dot(a: Array, b: Array) -> Array:
    """Dot products (N,) of vectors (N, 3)."""
    return np.asarray(np.einsum("ij,ij->i", a, b))
