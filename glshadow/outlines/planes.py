"""The plane on which an outline lies: its coordinates, and the planes of scenes and nodes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from glshadow.arguments import chosen_nodes
from glshadow.core.setting import refuse, shown
from glshadow.core.spaces import Array, finite_vector, unit, world_positions
from glshadow.errors import SettingsError
from glshadow.scene.capsules import Capsules
from glshadow.scene.nodes import Node, Scene

EPSILON = 2.0**-52
ROUNDED = 16.0 * EPSILON
"""Of the largest coordinate: points that are less than this off a plane are on it."""
FLAT = 1e-9
"""Of a node's size: by how much its vertices may leave its plane. Matrices of rotations by float32 stay below a millionth of that."""


@dataclass(frozen=True, eq=False)
class Plane:
    """A plane with right-handed coordinates (u, v) that are seen from the tip of its normal.

    Attributes
    ----------
    origin : (3,) float64
        World point with coordinates (0, 0).
    axes : (2, 3) float64
        Unit vectors of u and v.
    normal : (3,) float64
        Unit normal.
    """

    origin: Array
    axes: Array
    normal: Array

    def lifted(self, coordinates: Array) -> Array:
        """World points (..., 3) of coordinates (..., 2)."""
        return np.asarray(self.origin + coordinates[..., :1] * self.axes[0] + coordinates[..., 1:2] * self.axes[1])

    def coordinates(self, points: Array) -> Array:
        """Coordinates (..., 2) of world points (..., 3)."""
        offset = np.asarray(points, dtype=np.float64) - self.origin
        return np.stack([(offset * axis).sum(axis=-1) for axis in self.axes], axis=-1)

    def foot(self, point: Array) -> Array:
        """The point of the plane (3,) that is nearest to a point (3,)."""
        return np.asarray(point - self.normal * float(self.normal @ (point - self.origin)))


def plane_through(origin: Array, normal: Array) -> Plane:
    """The plane through a point (3,) with a normal (3,): u is the x axis seen along the normal; of a normal along x it is -z."""
    normal = unit("plane's normal", normal)
    along = np.array([0.0, 0.0, -1.0]) if abs(normal[0]) > 0.9 else np.array([1.0, 0.0, 0.0])
    u = along - normal * float(normal @ along)
    u = u / np.linalg.norm(u)
    return Plane(origin, np.stack([u, np.cross(normal, u)]), normal)


def plane_of(scene: Scene, plane: Any) -> Plane:
    """The plane that `plane` of `shadow_outline` stands for."""
    if plane is None:
        grounds = [node for node in scene.nodes if node.ground and node.drawn]
        if grounds:
            return _plane_of_node(grounds[0])
        return plane_through(np.array([0.0, scene.lowest(), 0.0]), np.array([0.0, 1.0, 0.0]))
    if isinstance(plane, list | tuple) or (isinstance(plane, np.ndarray) and plane.ndim > 0):
        if len(plane) != 2:
            raise refuse("plane", "a point and a normal, a node or None", plane)
        return plane_through(finite_vector("plane's point", plane[0]), finite_vector("plane's normal", plane[1]))
    nodes = chosen_nodes("plane", scene, plane)
    if len(nodes) != 1:
        raise refuse("plane", "a point and a normal, a node or None", plane)
    return _plane_of_node(scene.nodes[nodes[0]])


def _plane_of_node(node: Node) -> Plane:
    mesh = node.mesh
    if isinstance(mesh, Capsules) or not mesh.count:
        raise SettingsError(f"plane must be flat, and {node.label} has {shown(mesh)}")
    used = np.unique(mesh.triangles)
    points = world_positions(mesh.positions[used], node.world_from_mesh, np.zeros(3))
    middle = points.mean(axis=0)
    corners = world_positions(mesh.positions, node.world_from_mesh, middle)[mesh.triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    largest = normals[np.abs(normals).max(axis=1).argmax()]
    if not largest.any():
        raise SettingsError(f"plane must have an area, and all triangles of {node.label} have none")
    found = plane_through(middle, largest)
    offset = points - middle
    size = float(np.abs(offset).max())
    off = float(np.abs(offset @ found.normal).max())
    if off > FLAT * size + ROUNDED * float(np.abs(points).max()):
        raise SettingsError(
            f"plane must be flat, and {node.label} leaves its plane by {off:.3g} world units: give a point and a normal"
        )
    return plane_through(found.foot(np.zeros(3)), found.normal)
