"""Reads trimesh.Trimesh and trimesh.Scene as nodes."""

from __future__ import annotations

from typing import Any

import numpy as np

from glshadow.core.cameras import PerspectiveCamera
from glshadow.core.spaces import Array
from glshadow.errors import SceneError
from glshadow.io.builder import Builder
from glshadow.io.clouds import chained, lines_of, points_of
from glshadow.io.imported import Imported, srgb_colors
from glshadow.scene.capsules import Points
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
        mesh = _geometry(builder, source, "it")
        if mesh is None:
            raise SceneError(
                f"nothing to render: a trimesh.{type(source).__name__} has no triangles, points or lines in space"
            )
        found.nodes = [Node(mesh, np.eye(4), "points" if isinstance(mesh, Points) else "lines")]
    return found


def _geometry(builder: Builder, geometry: Any, name: str) -> Mesh | None:
    if not hasattr(geometry, "faces"):
        loose = _loose(builder, geometry, name)
        if loose is None:
            builder.notes.append(
                f"{name} is a {type(geometry).__name__}: left out, it has no triangles, points or lines in space"
            )
        return loose
    return builder.mesh(
        geometry.vertices, geometry.faces, name=name, normals=stored_normals(geometry), visual=geometry.visual
    )


def _loose(builder: Builder, geometry: Any, name: str) -> Mesh | None:
    """A PointCloud, or a Path3D with the colours of its entities."""
    places = np.asarray(getattr(geometry, "vertices", ()), dtype=np.float64)
    if places.ndim != 2 or places.shape[1:] != (3,) or len(places) == 0:
        return None
    if not hasattr(geometry, "entities"):
        stored = np.asarray(getattr(geometry, "colors", ()))
        colors = srgb_colors(stored, name, builder.notes) if stored.shape[:1] == (len(places),) else None
        return points_of(places, colors, name, builder.notes)
    curves = [np.asarray(entity.discrete(places), dtype=np.float64) for entity in geometry.entities]
    if not curves:
        return None
    counts = np.array([len(curve) for curve in curves])
    given = [getattr(entity, "color", None) for entity in geometry.entities]
    colors = None
    if any(each is not None for each in given):
        stored = np.array(
            [(255, 255, 255, 255) if each is None else (*each, 255)[:4] for each in given], dtype=np.uint8
        )
        colors = np.repeat(srgb_colors(stored, name, builder.notes), counts, axis=0)
    return lines_of(np.concatenate(curves), chained(counts), colors, name, builder.notes)
