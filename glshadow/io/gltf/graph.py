"""The node hierarchy of glTF: checked for cycles, walked without recursion, matrices composed in float64."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from glshadow.core.spaces import Array
from glshadow.errors import SceneError
from glshadow.io.gltf.accessor import read_floats
from glshadow.io.gltf.document import Document, as_object, extensions

STILL = {"translation": (0.0, 0.0, 0.0), "rotation": (0.0, 0.0, 0.0, 1.0), "scale": (1.0, 1.0, 1.0)}
"""The parts of a node's matrix that the file leaves out."""


class Graph:
    """Nodes of a document: parents, and the nodes that the default scene shows.

    Attributes
    ----------
    nodes : list of dict
        All nodes of the file.
    parents : dict
        Index of the parent of each node that has one; the scene's root nodes have none.
    placed : list of int
        Visible nodes of the default scene, parents before children.

    Raises
    ------
    SceneError
        For cycles, nodes with two parents, indices out of range, and more nodes than allowed.
    """

    def __init__(self, document: Document) -> None:
        self._matrices: dict[int, Array] = {}
        document.budget.limits.check("nodes", len(document.items("nodes")), "the file's hierarchy")
        self.nodes = [document.item("nodes", index, "the file") for index in range(len(document.items("nodes")))]
        self.parents = _parents(self.nodes, document)
        scenes = document.items("scenes")
        scene = document.item("scenes", document.json.get("scene", 0), "the default scene") if scenes else {}
        roots = _indices(scene, "nodes")
        self.placed = _visible(self.nodes, roots, document)
        for root in roots:
            self.parents.pop(root, None)

    def above(self, node: int) -> Iterator[int]:
        """The nodes above a node, the nearest first."""
        while node in self.parents:
            node = self.parents[node]
            yield node

    def matrices(self, nodes: Iterable[int]) -> list[Array]:
        """world_from_node (4, 4) of each node.

        Raises
        ------
        SceneError
            If a matrix is not affine or not finite, or their product overflows.
        """
        nodes = list(nodes)
        levels = self._levels(nodes)
        order = [node for level in levels for node in level]
        row = {node: k for k, node in enumerate(order)}
        world = local_matrices([self.nodes[node] for node in order], order)
        start = 0
        with np.errstate(all="ignore"):
            for level in levels:
                here = slice(start, start + len(level))
                if start:
                    world[here] = world[[row[self.parents[node]] for node in level]] @ world[here]
                else:  # below no node, or below one whose matrix is known
                    for k, node in enumerate(level):
                        if node in self.parents:
                            world[k] = self._matrices[self.parents[node]] @ world[k]
                start += len(level)
        check_finite(world, [f"nodes[{node}]" for node in order])
        self._matrices.update(zip(order, world, strict=True))
        return [self._matrices[node] for node in nodes]

    def _levels(self, nodes: list[int]) -> list[list[int]]:
        """Nodes whose matrix is unknown, with their unknown ancestors, by depth below known ones."""
        depth: dict[int, int] = {}
        for node in nodes:
            path = []
            while node not in depth and node not in self._matrices:
                path.append(node)
                if node not in self.parents:
                    break
                node = self.parents[node]
            above = depth.get(node, -1)
            for each in reversed(path):
                above = depth[each] = above + 1
        levels: list[list[int]] = [[] for _ in range(max(depth.values(), default=-1) + 1)]
        for node, level in depth.items():
            levels[level].append(node)
        return levels


def _visible(nodes: list[dict[str, Any]], roots: list[Any], document: Document) -> list[int]:
    placed = []
    seen: set[int] = set()
    stack = list(reversed(roots))
    for root in roots:
        document.item("nodes", root, "the scene")
    while stack:
        index = stack.pop()
        node = nodes[index]
        if index in seen:
            raise SceneError(f"nodes[{index}] appears twice in the scene: not a tree, export it again")
        seen.add(index)
        if "extensions" in node:
            switch = extensions(node).get("KHR_node_visibility", {})
            if as_object(switch, "KHR_node_visibility").get("visible", True) is False:
                continue
        placed.append(index)
        if "children" in node:
            stack += reversed(node["children"])
    return placed


def check_finite(matrices: Array, names: list[str]) -> None:
    """Refuse world matrices (N, 4, 4) that are not finite; the names are those of their nodes."""
    bad = np.flatnonzero(~np.isfinite(matrices).all(axis=(1, 2)))
    if len(bad):
        raise SceneError(f"{names[bad[0] % len(names)]}: the product of its matrix and those above it overflows")


def _indices(owner: dict[str, Any], key: str) -> list[Any]:
    value = owner.get(key, [])
    if not isinstance(value, list):
        raise SceneError(f"not valid glTF: {key!r} must be an array, got {value!r}")
    return value


def _parents(nodes: list[dict[str, Any]], document: Document) -> dict[int, int]:
    parent: dict[int, int] = {}
    for index, node in enumerate(nodes):
        for child in _indices(node, "children") if "children" in node else ():
            document.item("nodes", child, f"nodes[{index}].children")
            if child in parent:
                raise SceneError(
                    f"nodes[{child}] has two parents, nodes[{parent[child]}] and nodes[{index}]: not a tree, export "
                    "it again"
                )
            parent[child] = index
    settled: set[int] = set()
    for start in parent:
        path, index = set(), start
        while index in parent and index not in settled:
            settled.add(index)
            path.add(index)
            index = parent[index]
        if index in path:
            raise SceneError(f"the nodes form a cycle: nodes[{index}] is below itself; export it again")
    return parent


def local_matrices(given: list[dict[str, Any]], numbers: list[int]) -> Array:
    """parent_from_node (N, 4, 4) of nodes' matrices, or of their translations, rotations and scales; the numbers are for messages."""
    result = np.tile(np.eye(4), (len(given), 1, 1))
    whole = [row for row, node in enumerate(given) if "matrix" in node]
    parts = [row for row, node in enumerate(given) if "matrix" not in node]
    if whole:
        names = [f"nodes[{numbers[row]}].matrix" for row in whole]
        matrices = _numbers([given[row]["matrix"] for row in whole], 16, names).reshape(-1, 4, 4).transpose(0, 2, 1)
        skewed = np.flatnonzero(np.abs(matrices[:, 3] - (0.0, 0.0, 0.0, 1.0)).max(axis=1) > 1e-6)
        if len(skewed):
            last = matrices[skewed[0], 3].tolist()
            raise SceneError(f"{names[skewed[0]]} is not affine: its last row is {last}, not [0, 0, 0, 1]")
        result[whole] = matrices
    if parts:
        translation, rotation, scale = (
            _numbers(
                [given[row].get(key, still) for row in parts],
                len(still),
                [f"nodes[{numbers[row]}].{key}" for row in parts],
            )
            for key, still in STILL.items()
        )
        result[parts] = compose(translation, rotation, scale, [f"nodes[{numbers[row]}]" for row in parts])
    return result


def _numbers(values: list[Any], size: int, names: list[str]) -> Array:
    """Rows (N, size) of finite numbers; `names` are their owners."""
    try:
        rows = np.asarray(values, dtype=np.float64)
        if rows.shape == (len(values), size) and np.isfinite(rows).all():
            return rows
    except (TypeError, ValueError, OverflowError):
        pass
    if len(values) == 1:
        raise SceneError(f"{names[0]} must be {size} finite numbers, got {str(values[0])[:80]}")
    for value, name in zip(values, names, strict=True):
        _numbers([value], size, [name])
    raise SceneError(f"{names[0]} and others must be {size} finite numbers each")


def compose(translation: ArrayLike, rotation: ArrayLike, scale: ArrayLike, names: list[str]) -> Array:
    """Matrices (N, 4, 4) of translations (N, 3), quaternions (N, 4) x, y, z, w of any length but zero, and scales (N, 3)."""
    given = np.asarray(rotation, dtype=np.float64)
    largest = np.abs(given).max(axis=1)
    bad = np.flatnonzero(~((largest > 0.0) & (largest < np.inf)))
    if len(bad):
        raise SceneError(f"{names[bad[0] % len(names)]}: its rotation {given[bad[0]].tolist()} is not a quaternion")
    quaternion = given / largest[:, None]  # first, so that no length overflows
    x, y, z, w = (quaternion / np.linalg.norm(quaternion, axis=1, keepdims=True)).T
    turn = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )
    matrices = np.tile(np.eye(4), (len(given), 1, 1))
    matrices[:, :3, :3] = turn.transpose(2, 0, 1) * np.asarray(scale, dtype=np.float64)[:, None]
    matrices[:, :3, 3] = translation
    return matrices


def instances(document: Document, node: dict[str, Any], index: int, world_from_node: Array) -> Array:
    """world_from_instance matrices (N, 4, 4) of EXT_mesh_gpu_instancing; the node's own matrix if it is absent.

    Raises
    ------
    SceneError
        If the counts of its attributes differ, or values are not finite.
    """
    extension = extensions(node).get("EXT_mesh_gpu_instancing")
    if extension is None:
        return world_from_node[None]
    where = f"nodes[{index}] instancing"
    attributes = as_object(as_object(extension, where).get("attributes", {}), where)
    given = {
        name: read_floats(document, attributes[name], (kind,), where)
        for name, kind in (("TRANSLATION", "VEC3"), ("ROTATION", "VEC4"), ("SCALE", "VEC3"))
        if name in attributes
    }
    for name, values in given.items():
        bad = int((~np.isfinite(values)).any(axis=1).sum())
        if bad:
            raise SceneError(f"{where}: {bad} of {len(values)} {name} values are not finite (NaN or infinite)")
    counts = {len(values) for values in given.values()}
    if len(counts) != 1:
        raise SceneError(f"{where}: its attributes must have one count, got {sorted(counts)}")
    number = counts.pop()
    document.budget.limits.check("nodes", number, where)
    translation, rotation, scale = (given.get(key.upper(), np.tile(still, (number, 1))) for key, still in STILL.items())
    with np.errstate(all="ignore"):
        matrices = np.asarray(world_from_node @ compose(translation, rotation, scale, [where]))
    check_finite(matrices, [where])
    return matrices
