"""The built-in scenes, public as `glshadow.scenes`: the courtyard, outdoor scenes, and simple scenes with exact shadows."""

from __future__ import annotations

import numpy as np

from glshadow.core.cameras import PerspectiveCamera
from glshadow.core.spaces import Array, transform, translation
from glshadow.scene.mesh import Mesh
from glshadow.scene.nodes import Node, Scene
from glshadow.scenes import shapes
from glshadow.scenes.analytic import AnalyticScene, ball, box, plane, plates, room, sphere, wall
from glshadow.scenes.landscapes import landscape, landscape_light
from glshadow.scenes.outdoors import outdoors
from glshadow.scenes.shapes import Solid
from glshadow.scenes.street import street

__all__ = [
    "AnalyticScene", "ball", "box", "courtyard", "landscape", "landscape_light", "outdoors", "plane", "plates", "room", "sphere", "street",
    "wall",
]  # fmt: skip


def courtyard() -> Scene:
    """A ground of 24 x 24 with 24 columns, a torus, a sphere, a fence and a ramp under one directional light: 91,656 triangles.

    The README's numbers are measured on this scene. One node per part; torus and sphere are smooth, the rest
    is flat; everything is white.
    """
    torus = _placed(shapes.torus(1.0, 0.3, 256, 128), translation((0.0, 1.6, 0.0)) @ _rotation(0.6, (0.2, 1.0, 0.1)))
    sphere_ = _placed(shapes.icosphere(5, 0.6), translation((1.5, 0.6, 3.0)))
    ramp = _placed(shapes.box((3.0, 0.05, 3.0)), translation((-2.2, 1.3, 1.5)) @ _rotation(0.9, (0.0, 0.0, 1.0)))
    parts = {
        "ground": shapes.box((24.0, 0.2, 24.0), (0.0, -0.1, 0.0)),
        "columns": _columns(),
        "torus": torus,
        "sphere": sphere_,
        "fence": _fence(),
        "ramp": ramp,
    }
    normals = {name: shapes.vertex_normals(parts[name]) for name in ("torus", "sphere")}
    nodes = tuple(Node(Mesh(*solid, normals=normals.get(name)), np.eye(4), name) for name, solid in parts.items())
    camera = PerspectiveCamera(position=(9.0, 6.0, 11.0), target=(0.0, 1.0, 0.0), fov_y=50.0)
    return Scene(nodes, camera, name="courtyard")


def _columns() -> Solid:
    upright = _rotation(-np.pi / 2, (1.0, 0.0, 0.0))
    column, capital = shapes.cylinder(0.25, 2.5, 48), shapes.box((0.8, 0.15, 0.8))
    places = [(x, z) for x in np.linspace(-6, 6, 5) for z in np.linspace(-6, 6, 5) if abs(x) >= 1 or abs(z) >= 1]
    solids = []
    for x, z in places:
        solids.append(_placed(column, translation((x, 1.25, z)) @ upright))
        solids.append(_placed(capital, translation((x, 2.575, z))))
    return shapes.joined(solids)


def _fence() -> Solid:
    slats = [shapes.box((0.03, 1.2, 0.03), (x, 0.6, 4.4)) for x in np.arange(-3.5, 3.5, 0.12)]
    return shapes.joined([*slats, shapes.box((7.0, 0.05, 0.05), (0.0, 1.15, 4.4))])


def _placed(solid: Solid, matrix: Array) -> Solid:
    return transform(matrix, solid[0]), solid[1]


def _rotation(angle_rad: float, axis: tuple[float, float, float]) -> Array:
    """(4, 4) rotation about an axis through the origin (Rodrigues)."""
    x, y, z = np.asarray(axis) / np.linalg.norm(axis)
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    matrix = np.eye(4)
    matrix[:3, :3] += np.sin(angle_rad) * cross + (1.0 - np.cos(angle_rad)) * cross @ cross
    return matrix
