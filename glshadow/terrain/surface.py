"""Two triangles for each cell of an elevation model."""

from __future__ import annotations

import numpy as np

from glshadow.errors import SceneError
from glshadow.scene.mesh import Mesh
from glshadow.terrain.dem import Dem


def triangle_count(dem: Dem) -> int:
    """Number of triangles, holes included."""
    rows, columns = dem.heights.shape
    return 2 * (int(rows) - 1) * (int(columns) - 1)


def dem_mesh(dem: Dem) -> Mesh:
    """The triangulated surface, relative to `dem.place`: x map x, y up, z against map y.

    Each four cells share the diagonal from the first to the last. Triangles at cells without a height are left out.

    Raises
    ------
    SceneError
        If none is left.
    """
    rows, columns = dem.heights.shape
    number = np.arange(rows * columns, dtype=np.int32).reshape(rows, columns)
    a, b, c, d = number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]
    if np.linalg.det(dem.cell) > 0.0:  # rows run north: the other way round is seen from above
        b, d = d, b
    triangles = np.stack([np.stack([a, b, c], axis=-1), np.stack([a, c, d], axis=-1)], axis=2).reshape(-1, 3)
    known = np.isfinite(dem.heights).ravel()
    if not known.all():
        triangles = triangles[known[triangles].all(axis=1)]
        if len(triangles) == 0:
            raise SceneError("the elevation model has no three neighbouring cells with heights")
    return Mesh(dem.positions(), triangles)
