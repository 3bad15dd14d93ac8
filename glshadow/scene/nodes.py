"""Placed meshes: Node and Scene, frozen, with the ground that a model may stand on."""

from __future__ import annotations

from collections.abc import Mapping
from copy import copy
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshadow.core.cameras import Camera
from glshadow.core.setting import Settings, as_floats, flag, instance, optional, refuse, setting, several, shown, text
from glshadow.core.spaces import Array
from glshadow.errors import SceneError, SettingsError
from glshadow.lights import Light, as_lights
from glshadow.scene import summary
from glshadow.scene.box import box_corners, check_place, default_camera, default_sun
from glshadow.scene.mesh import Material, Mesh


def _affine(name: str, value: Any) -> Array:
    matrix = as_floats(value, (4, 4))
    if matrix is None or not np.isfinite(matrix).all():
        raise refuse(name, "a finite matrix (4, 4)", value)
    if np.abs(matrix[3] - (0.0, 0.0, 0.0, 1.0)).max() > 1e-6:
        raise SettingsError(f"{name} must be affine: its last row is {matrix[3].tolist()}, not [0, 0, 0, 1]")
    return matrix


@dataclass(frozen=True, eq=False, repr=False)
class Node(Settings):
    """One placement of a mesh: instances share the Mesh object.

    Parameters
    ----------
    mesh : Mesh
    world_from_mesh : (4, 4) float64
    name : str
        A scene numbers nodes of the same name, so that each has its own.
    casts, receives : bool
        Whether it darkens what lies behind it, and whether others darken it.
    catches : bool
        It shows nothing but the shadow that falls on it: black, its alpha 1 - (light with shadow) / (light without), of luminances.
    ground : bool
        It is no part of the model but a ground under it, which `Scene.bounds` leaves out.
    """

    refusal = SceneError

    mesh: Mesh = setting(instance(Mesh), help="what is placed; nodes may share it")
    world_from_mesh: Array = setting(_affine, factory=lambda: np.eye(4), help="(4, 4) placement")
    name: str = setting(text(), "node", help="made unique within a scene")
    casts: bool = setting(flag(), True, help="it darkens what lies behind it")
    receives: bool = setting(flag(), True, help="others darken it")
    catches: bool = setting(flag(), False, help="it shows nothing but the shadow that falls on it")
    ground: bool = setting(flag(), False, help="a ground under the model, no part of it")

    __repr__ = summary.node_line

    @property
    def label(self) -> str:
        """What messages call it."""
        return f"Node {shown(self.name)}" if isinstance(self.name, str) else "Node"


def _nodes(name: str, value: Any) -> tuple[Node, ...]:
    """The rule of a scene's nodes: meshes stand where they are, and each name is there once."""
    several_nodes = several(instance(Node), "Node or Mesh", 10**8)
    if isinstance(value, tuple | list):
        value = tuple(Node(each) if isinstance(each, Mesh) else each for each in value)
    nodes: tuple[Node, ...] = several_nodes(name, value)
    return nodes if len({node.name for node in nodes}) == len(nodes) else _numbered(nodes)


def _numbered(nodes: tuple[Node, ...]) -> tuple[Node, ...]:
    """Copies of the nodes that repeat a name, with a number behind it that makes it one of a kind."""
    taken = {node.name for node in nodes}
    seen: set[str] = set()
    last: dict[str, int] = {}
    result = []
    for node in nodes:
        if node.name in seen:
            number = last.get(node.name, 1) + 1
            while f"{node.name} {number}" in taken:
                number += 1
            last[node.name] = number
            named = copy(node)  # checked already
            object.__setattr__(named, "name", f"{node.name} {number}")
            taken.add(named.name)
            node = named
        seen.add(node.name)
        result.append(node)
    return tuple(result)


@dataclass(frozen=True, eq=False, repr=False)
class Scene(Settings):
    """Placed meshes with a camera and lights.

    Parameters
    ----------
    nodes : sequence of Node or Mesh
        At least one, and at least one triangle. A mesh is placed as it is. Nodes of the same name are numbered: "wheel", "wheel 2".
    camera, lights : optional
        What the file brought. `camera` and `lights` given as None are replaced by defaults that frame the scene:
        see `default_camera` and `default_sun`.

    Raises
    ------
    SceneError
        If there is nothing to render, or its places overflow.
    """

    refusal = SceneError

    nodes: tuple[Node, ...] = setting(_nodes, help="what is drawn")
    camera: Camera = setting(optional(instance(Camera), "frames the scene"), None, help="the eye")
    lights: tuple[Light, ...] = setting(optional(as_lights, "one sun"), None, help="what lights it")
    name: str = setting(text(), "scene", help="what messages and files call it")

    __repr__ = summary.scene_line
    _repr_html_ = summary.scene_html

    def __post_init__(self) -> None:
        super().__post_init__()
        if not any(len(node.mesh.triangles) for node in self.nodes):
            raise SceneError(f"{self.name}: nothing to render, it has no triangles")
        check_place(self.corners, f"{self.name}: ")
        low, high = self.extent
        if (low == high).all():
            raise SceneError(f"{self.name}: nothing to render, its size is zero at {low.tolist()}")
        if self.camera is None:
            object.__setattr__(self, "camera", default_camera(self.bounds))
        if self.lights is None:
            object.__setattr__(self, "lights", (default_sun(),))

    @cached_property
    def drawn(self) -> NDArray[np.int64]:
        """(N,) which nodes have triangles."""
        counts = np.fromiter((len(node.mesh.triangles) for node in self.nodes), dtype=np.int64, count=len(self.nodes))
        return np.flatnonzero(counts)

    @cached_property
    def boxes(self) -> tuple[Array, Array]:
        """Mesh bounds (N, 2, 3) and world_from_mesh (N, 4, 4) of all nodes that have triangles."""
        nodes = [self.nodes[i] for i in self.drawn.tolist()]
        bounds = np.concatenate([node.mesh.bounds for node in nodes]).reshape(-1, 2, 3)
        return bounds, np.concatenate([node.world_from_mesh for node in nodes]).reshape(-1, 4, 4)

    @cached_property
    def bounds(self) -> Array:
        """(2, 3) least and greatest world corner of the model: of all nodes' boxes but a ground's, unless there is nothing else."""
        model = [not self.nodes[i].ground for i in self.drawn.tolist()]
        return self.extent if all(model) or not any(model) else _around(self.corners[model])

    @cached_property
    def extent(self) -> Array:
        """(2, 3) least and greatest world corner of everything, a ground too."""
        return _around(self.corners)

    @cached_property
    def corners(self) -> Array:
        """World corners (N, 8, 3) of the boxes."""
        return box_corners(*self.boxes)

    def moved(self, matrices: Mapping[str, Any]) -> Scene:
        """The same scene with some nodes placed anew; meshes, and what the GPU holds of them, are shared.

        Parameters
        ----------
        matrices : mapping from node name to (4, 4) world_from_mesh

        Raises
        ------
        SceneError
                If no node has that name, or a matrix is none.
        """
        if not isinstance(matrices, Mapping):
            raise SceneError(f"moved needs a mapping from node names to matrices, got {shown(matrices)}")
        names = {node.name for node in self.nodes}
        if unknown := set(matrices) - names:
            known = ", ".join(sorted(names)[:8])
            raise SceneError(f"no node is named {', '.join(sorted(map(shown, unknown)))}; the scene has: {known}")
        nodes = tuple(
            replace(node, world_from_mesh=matrices[node.name]) if node.name in matrices else node for node in self.nodes
        )
        return replace(self, nodes=nodes)

    def with_ground(self, catches: bool = False) -> Scene:
        """The scene on a level square plane that touches its lowest point, three times as wide as the scene is large.

        Parameters
        ----------
        catches : bool
            It shows nothing but the shadow, see `Node`.
        """
        low, high = self.bounds.copy()
        low[1] = min(_lowest(node) for node in self.nodes if len(node.mesh.triangles))
        size = float(np.linalg.norm(high - low))
        half = 1.5 * size
        x, y, z = 0.5 * (low[0] + high[0]), low[1], 0.5 * (low[2] + high[2])
        corners = np.array([[-half, 0, half], [half, 0, half], [half, 0, -half], [-half, 0, -half]])
        ground = Mesh(
            corners, np.array([[0, 1, 2], [0, 2, 3]], dtype=np.int32), material=Material(color=(0.7, 0.7, 0.7, 1.0))
        )
        matrix = np.eye(4)
        matrix[:3, 3] = (x, y, z)
        return replace(self, nodes=(*self.nodes, Node(ground, matrix, "ground", catches=catches, ground=True)))


def _around(corners: Array) -> Array:
    columns = [corners[..., axis] for axis in range(3)]  # numpy reduces columns much faster than rows of three
    return np.array([[c.min() for c in columns], [c.max() for c in columns]])


def _lowest(node: Node) -> float:
    """Least world y of a node's triangles: of its vertices, where its box would be too large because it is turned."""
    row = node.world_from_mesh[1]
    used = node.mesh.positions[np.unique(node.mesh.triangles)]
    return float((used @ row[:3]).min() + row[3])
