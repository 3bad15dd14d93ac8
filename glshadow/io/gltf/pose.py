"""What the animations of a glTF file move, kept after the file is read, and its pose at a time."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from glshadow.core.cameras import Camera
from glshadow.core.spaces import Array
from glshadow.errors import SceneError
from glshadow.io.gltf.animation import Animation
from glshadow.io.gltf.graph import STILL, Graph, check_finite, compose, local_matrices
from glshadow.io.gltf.morph import Weights, moved
from glshadow.io.gltf.skin import Bound, posed
from glshadow.io.imported import usable_normals
from glshadow.lights import Light
from glshadow.scene.mesh import Mesh
from glshadow.scene.motion import Pose

T = TypeVar("T", Camera, Light)


@dataclass(eq=False)
class Deformer:
    """A mesh that a skin or morph targets deform.

    Parameters
    ----------
    rest : Mesh
        As the file's nodes and weights pose it; what no animation moves is this object.
    resting : tuple
        Weights and joint matrices of that pose.
    positions, normals : (V, 3) float64
        Before morph targets and skin.
    targets : tuple of pairs
        The changes of positions and normals; None: no change.
    influences : pair of arrays, optional
        Joints (V, K) and their weights (V, K).
    """

    rest: Mesh
    resting: tuple[Weights, Array | None]
    positions: Array
    normals: Array | None
    targets: tuple[tuple[Array | None, Array | None], ...] = ()
    influences: tuple[NDArray[np.int64], Array] | None = None
    _last: tuple[tuple[Weights, bytes], Mesh] | None = None

    def mesh(self, weights: Weights, joints: Array | None) -> Mesh:
        """The mesh with these weights of its targets and world_from_bind matrices of its joints; the same object for the same pose.

        Raises
        ------
        SceneError
            If vertices overflow.
        """
        weights = weights if self.targets else ()
        joints = None if self.influences is None else joints
        key = _key(weights, joints)
        if key == _key(*self.resting):
            return self.rest
        last = self._last
        if last is None or last[0] != key:
            last = self._last = (key, self._made(weights, joints))
        return last[1]

    def _made(self, weights: Weights, joints: Array | None) -> Mesh:
        positions, normals = self.positions, self.normals
        for weight, (shift, turn) in zip(weights, self.targets, strict=False):
            if weight and shift is not None:
                positions = moved(positions, weight, shift)
            if weight and turn is not None and normals is not None:
                normals = moved(normals, weight, turn)
        if joints is not None and self.influences is not None:
            positions, normals = posed(positions, normals, *self.influences, joints)
        usable = usable_normals(positions, self.rest.triangles.astype(np.int64), normals)
        # tangents are those of the pose at rest: others are derived
        return replace(self.rest, positions=positions, normals=usable, tangents=None)

    def __getstate__(self) -> dict[str, Any]:
        return {**self.__dict__, "_last": None}


def _key(weights: Weights, joints: Array | None) -> tuple[Weights, bytes]:
    return (weights if any(weights) else ()), b"" if joints is None else joints.tobytes()


@dataclass(frozen=True, eq=False)
class Part:
    """A node of the scene that moves, or whose mesh is deformed.

    Parameters
    ----------
    node : int
        Of the file.
    mesh : Mesh or Deformer
    matrix : (4, 4) float64
        world_from_mesh at rest.
    local : (4, 4) float64, optional
        node_from_mesh; None: the node does not move it, only its shape changes.
    skin : int, optional
        Index of the skin in the file, if its mesh follows it.
    """

    node: int
    mesh: Mesh | Deformer
    matrix: Array
    local: Array | None = None
    skin: int | None = None


@dataclass(frozen=True, eq=False)
class Hierarchy:
    """The nodes that any animation moves, with those below them.

    Parameters
    ----------
    rows : dict
        Node of the file -> its row; parents come before their children.
    levels : tuple of slices
        Rows of equal depth.
    parents : (N,) int
        Row of the node above; -1: it does not move.
    above : (N, 4, 4) float64
        World matrices of nodes above that do not move.
    local : (N, 4, 4) float64
        parent_from_node at rest.
    parts : dict
        Translations (N, 3), rotations (N, 4) and scales (N, 3) at rest.
    composed : (N,) bool
        Nodes that consist of these parts.
    """

    rows: Mapping[int, int]
    levels: tuple[slice, ...]
    parents: NDArray[np.int64]
    above: Array
    local: Array
    parts: Mapping[str, Array]
    composed: NDArray[np.bool_]

    def world(self, values: Mapping[tuple[int, str], Array]) -> Array:
        """World matrices (N, 4, 4) with some parts replaced, by row and name.

        Raises
        ------
        SceneError
            If a matrix is not finite.
        """
        parts = {name: rest.copy() for name, rest in self.parts.items()}
        changed = np.zeros(len(self.parents), dtype=bool)
        for (row, path), value in values.items():
            parts[path][row] = value
            changed[row] = True
        names = [f"nodes[{node}]" for node in self.rows]
        local = self.local.copy()
        rows = np.flatnonzero(changed & self.composed)
        if len(rows):
            translation, rotation, scale = (parts[name][rows] for name in STILL)
            local[rows] = compose(translation, rotation, scale, [names[row] for row in rows])
        world = local
        with np.errstate(all="ignore"):
            for level in self.levels:
                above = np.where(
                    (self.parents[level] < 0)[:, None, None], self.above[level], world[self.parents[level]]
                )
                world[level] = above @ local[level]
        check_finite(world, names)
        return world


def hierarchy(graph: Graph, animated: set[int]) -> Hierarchy:
    """The nodes that animations move, those below them included."""
    children: dict[int, list[int]] = {}
    for child, parent in graph.parents.items():
        children.setdefault(parent, []).append(child)
    depth: dict[int, int] = {}
    for root in sorted(animated):
        if any(above in animated for above in graph.above(root)):
            continue
        stack = [(root, 0)]
        while stack:
            node, level = stack.pop()
            depth[node] = level
            stack += [(child, level + 1) for child in children.get(node, ())]
    order = sorted(depth, key=lambda node: (depth[node], node))
    rows = {node: row for row, node in enumerate(order)}
    sizes = np.cumsum([0, *np.bincount([depth[node] for node in order])]) if order else np.zeros(1, dtype=int)
    given = [graph.nodes[node] for node in order]
    over = [graph.parents.get(node) for node in order]
    still = [node for node in over if node is not None and node not in rows]
    world = dict(zip(still, graph.matrices(still), strict=True))
    return Hierarchy(
        rows,
        tuple(slice(int(a), int(b)) for a, b in pairwise(sizes)),
        np.array([-1 if node is None else rows.get(node, -1) for node in over], dtype=np.int64),
        np.array([world[node] if node in world else np.eye(4) for node in over]).reshape(-1, 4, 4),
        local_matrices(given, order) if order else np.zeros((0, 4, 4)),
        {
            name: np.array([node.get(name, rest) for node in given], dtype=np.float64).reshape(-1, len(rest))
            for name, rest in STILL.items()
        },
        np.array(["matrix" not in node for node in given], dtype=bool),
    )


@dataclass(eq=False)
class Moving:
    """Everything of a file that its animations move: what `Scene.at` needs after the file is closed.

    Parameters
    ----------
    animations : dict
        By name, in the file's order.
    hierarchy : Hierarchy
    weights : dict
        Weights at rest of the morph targets of nodes.
    parts : dict
        Number of a node of the scene, in the reader's order -> what moves it.
    skins : dict
        Index of a skin -> its joints, the matrices of those that do not move, and the rows of those that do (-1: it does not).
    cameras, lights : optional
        The node, what the file's camera or light is at rest, and a function that places it by a node's matrix; cameras by name.
    """

    animations: dict[str, Animation]
    hierarchy: Hierarchy
    weights: dict[int, Weights]
    parts: dict[int, Part] = field(default_factory=dict)
    skins: dict[int, tuple[Bound, Array, NDArray[np.int64]]] = field(default_factory=dict)
    cameras: Mapping[str, tuple[int, Camera, Callable[[Array], Camera]]] = field(default_factory=dict)
    lights: Sequence[tuple[int, Light, Callable[[Array], Light]]] = ()

    @property
    def durations(self) -> Mapping[str, float]:
        """Name of each animation -> its length in seconds."""
        return {name: each.duration for name, each in self.animations.items()}

    def pose(self, animation: str, seconds: float) -> Pose:
        """Everything that any animation moves, at a time of one of them.

        Raises
        ------
        SceneError
            If matrices or vertices overflow.
        """
        rows, weights = self.hierarchy.rows, dict(self.weights)
        values: dict[tuple[int, str], Array] = {}
        for track in self.animations[animation].tracks:
            if track.path == "weights":
                weights[track.node] = tuple(track.at(seconds).tolist())
            elif track.node in rows:
                values[rows[track.node], track.path] = track.at(seconds)
        world = self.hierarchy.world(values)
        joints = {
            index: skin.matrices(np.where((row < 0)[:, None, None], still, world[row]) if len(world) else still)
            for index, (skin, still, row) in self.skins.items()
        }
        nodes = {}
        for number, part in self.parts.items():
            mesh, matrix = part.mesh, part.matrix
            if isinstance(mesh, Deformer):
                try:
                    mesh = mesh.mesh(weights.get(part.node, ()), None if part.skin is None else joints[part.skin])
                except SceneError as error:
                    raise SceneError(f"at {seconds:g} s of animation {animation!r}: {error}") from None
            if part.local is not None:
                matrix = world[rows[part.node]] @ part.local
            nodes[number] = (mesh, matrix)

        def place(at: tuple[int, T, Callable[[Array], T]]) -> T:
            node, rest, make = at
            return make(world[rows[node]]) if node in rows else rest

        cameras = {name: place(each) for name, each in self.cameras.items()}
        return Pose(nodes, cameras, tuple(map(place, self.lights)))
