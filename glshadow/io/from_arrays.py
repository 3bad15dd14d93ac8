"""Reads a pair (vertices, faces) of arrays as a node."""

from __future__ import annotations

from typing import Any

import numpy as np

from glshadow.core.setting import Numbers, numbers_in
from glshadow.errors import SceneError
from glshadow.io.imported import Imported, fans
from glshadow.scene.mesh import Mesh
from glshadow.scene.nodes import Node


def array_pair(source: Any) -> tuple[Numbers, Numbers] | None:
    """The arrays of a pair (vertices, faces); None for everything else."""
    if not isinstance(source, list | tuple) or len(source) != 2:
        return None
    vertices, faces = (numbers_in(each) for each in source)
    if vertices is None or faces is None or vertices.ndim != 2 or faces.ndim != 2:
        return None
    return vertices, faces


def read_arrays(vertices: Numbers, faces: Numbers) -> Imported:
    """Read vertices (V, 3) and faces (T, K): triangles, or convex polygons of K corners.

    Raises
    ------
    SceneError
        As for `Mesh`; also for faces of fewer than three corners.
    """
    if faces.shape[1] < 3:
        raise SceneError(f"faces need at least 3 corners, got shape {faces.shape}")
    if faces.shape[1] > 3:
        if faces.dtype.kind == "f" and not (faces == np.floor(faces)).all():
            raise SceneError("faces must be integers: indices of vertices")
        faces = fans(faces)
    return Imported([Node(Mesh(vertices, faces), np.eye(4), "mesh")])
