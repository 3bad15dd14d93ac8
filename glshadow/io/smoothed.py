"""Smooth normals for meshes that are in memory: vertices are split where edges are creases."""

from __future__ import annotations

from dataclasses import fields, replace
from typing import Any

import numpy as np

from glshadow.geometry.creases import smooth_normals
from glshadow.io.imported import Imported
from glshadow.scene.mesh import Mesh


def smoothed(found: Imported, crease_angle: float | None) -> Imported:
    """The same with smooth normals for meshes without normals; None: as they are."""
    if crease_angle is not None:
        meshes = {id(node.mesh): node.mesh for node in found.nodes}
        made = {key: _smoothed(mesh, float(np.radians(crease_angle))) for key, mesh in meshes.items()}
        found.nodes = [
            node if made[id(node.mesh)] is node.mesh else replace(node, mesh=made[id(node.mesh)])
            for node in found.nodes
        ]
    return found


def _smoothed(mesh: Mesh, crease_rad: float) -> Mesh:
    if mesh.normals is not None or len(mesh.triangles) == 0:
        return mesh
    corners = mesh.triangles.ravel().astype(np.int64)
    found = smooth_normals(mesh.positions, corners, np.full(len(mesh.triangles), 3), crease_rad)
    if found is None:
        return mesh
    normals, of = found
    _, first, number = np.unique(corners * len(normals) + of, return_index=True, return_inverse=True)
    vertex = corners[first]
    split: dict[str, Any] = {}
    for field in fields(mesh):
        value = getattr(mesh, field.name)
        if field.name != "triangles" and isinstance(value, np.ndarray):
            split[field.name] = value[vertex]
    split["normals"] = normals[of[first]]
    return replace(mesh, triangles=number.reshape(-1, 3), **split)
