"""Reads trimesh.Trimesh and trimesh.Scene as nodes."""

from __future__ import annotations

from typing import Any

import numpy as np

from glshadow.core.cameras import PerspectiveCamera
from glshadow.core.spaces import Array
from glshadow.errors import SceneError
from glshadow.io.builder import Builder
from glshadow.io.imported import Imported
from glshadow.scene.mesh import Mesh
from glshadow.scene.nodes import Node


def stored_normals(mesh: Any) -> Array | None:
    """Vertex normals from the file or the user; None if trimesh computed them (or would)."""
    cache = getattr(mesh, "_cache", None)
    if cache is None or "vertex_normals" not in cache:
        return None
    import trimesh

    given = np.asarray(mesh.vertex_normals, dtype=np.float64)
    computed = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False).vertex_normals
    # equal: they were computed when mesh.vertex_normals was read
    return None if np.array_equal(given, computed) else given


def read_trimesh(source: Any) -> Imported:
    """Read a trimesh.Trimesh or a trimesh.Scene. Lights and cameras that trimesh made up are left out."""
    builder = Builder()
    found = Imported(notes=builder.notes)
    if hasattr(source, "faces"):
        mesh = _geometry(builder, source, "the mesh")
        found.nodes = [] if mesh is None else [Node(mesh, np.eye(4), "mesh")]
    elif hasattr(source, "graph"):
        meshes = {name: _geometry(builder, geometry, repr(name)) for name, geometry in source.geometry.items()}
        for name in source.graph.nodes_geometry:
            matrix, geometry = source.graph[name]
            mesh = meshes[geometry]
            if mesh is not None:
                found.nodes.append(Node(mesh, matrix, str(name)))
        if getattr(source, "has_camera", False):
            found.camera = PerspectiveCamera.from_pose(source.camera_transform, float(source.camera.fov[1]))
    else:
        raise SceneError(f"nothing to render: a trimesh.{type(source).__name__} has no triangles")
    return found


def _geometry(builder: Builder, geometry: Any, name: str) -> Mesh | None:
    if not hasattr(geometry, "faces"):
        builder.notes.append(f"{name} is a {type(geometry).__name__}: left out, only triangles are drawn")
        return None
    return builder.mesh(
        geometry.vertices, geometry.faces, name=name, normals=stored_normals(geometry), visual=geometry.visual
    )
