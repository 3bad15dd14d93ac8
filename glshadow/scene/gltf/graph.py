"""The node hierarchy of glTF: checked for cycles, walked without recursion, matrices composed in float64."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from glshadow.core.spaces import Array
from glshadow.errors import SceneError
from glshadow.scene.gltf.accessor import read_floats
from glshadow.scene.gltf.document import Document, as_object, extensions


def placed_nodes(document: Document) -> list[tuple[int, dict[str, Any], Array]]:
    """(index, node, world_from_node) of every visible node of the default scene, parents before their children.

    Raises
    ------
    SceneError
        For cycles, nodes with two parents, indices that lead nowhere and matrices that are not finite.
    """
    _check_tree(document)
    scenes = document.items("scenes")
    if not scenes:
        return []
    scene = document.item("scenes", document.json.get("scene", 0), "the default scene")
    placed = []
    seen: set[int] = set()
    stack = [(index, np.eye(4)) for index in reversed(_indices(scene, "nodes"))]
    while stack:
        index, above = stack.pop()
        node = document.item("nodes", index, "the scene")
        if index in seen:
            raise SceneError(f"nodes[{index}] has two places in the scene: not a tree, export it again")
        seen.add(index)
        if (
            as_object(extensions(node).get("KHR_node_visibility", {}), "KHR_node_visibility").get("visible", True)
            is False
        ):
            continue
        matrix = _product(above, local_matrix(node, index), f"nodes[{index}]")
        placed.append((index, node, matrix))
        stack += [(child, matrix) for child in reversed(_indices(node, "children"))]
    return placed


def _product(above: Array, local: Array, where: str) -> Array:
    with np.errstate(all="ignore"):
        matrix = above @ local
    if not np.isfinite(matrix).all():
        raise SceneError(f"{where}: the product of its matrix and those above it overflows")
    return matrix


def _indices(owner: dict[str, Any], key: str) -> list[Any]:
    value = owner.get(key, [])
    if not isinstance(value, list):
        raise SceneError(f"not valid glTF: {key!r} must be an array, got {value!r}")
    return value


def _check_tree(document: Document) -> None:
    nodes = document.items("nodes")
    parent: dict[int, int] = {}
    for index in range(len(nodes)):
        for child in _indices(document.item("nodes", index, "the file"), "children"):
            document.item("nodes", child, f"nodes[{index}].children")
            if child in parent:
                raise SceneError(
                    f"nodes[{child}] has two parents, nodes[{parent[child]}] and nodes[{index}]: not a tree, export "
                    "it again"
                )
            parent[child] = index
    settled: set[int] = set()
    for start in range(len(nodes)):
        path, index = set(), start
        while index in parent and index not in settled:
            settled.add(index)
            path.add(index)
            index = parent[index]
        if index in path:
            raise SceneError(f"the nodes form a cycle: nodes[{index}] is below itself; export it again")


def local_matrix(node: dict[str, Any], index: int) -> Array:
    """parent_from_node (4, 4) of a node's matrix, or of its translation, rotation and scale."""
    where = f"nodes[{index}]"
    if "matrix" in node:
        matrix = _numbers(node["matrix"], 16, f"{where}.matrix").reshape(4, 4).T
        if max(abs(matrix[3, 0]), abs(matrix[3, 1]), abs(matrix[3, 2]), abs(matrix[3, 3] - 1.0)) > 1e-6:
            raise SceneError(f"{where}.matrix is not affine: its last row is {matrix[3].tolist()}, not [0, 0, 0, 1]")
        return matrix
    return compose(
        _numbers(node.get("translation", (0.0, 0.0, 0.0)), 3, f"{where}.translation"),
        _numbers(node.get("rotation", (0.0, 0.0, 0.0, 1.0)), 4, f"{where}.rotation"),
        _numbers(node.get("scale", (1.0, 1.0, 1.0)), 3, f"{where}.scale"),
        where,
    )


def _numbers(value: Any, size: int, name: str) -> Array:
    try:
        vector = np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        vector = np.zeros(0)
    if vector.shape != (size,) or not np.isfinite(vector).all():
        raise SceneError(f"{name} must be {size} finite numbers, got {str(value)[:80]}")
    return vector


def compose(translation: ArrayLike, rotation: ArrayLike, scale: ArrayLike, where: str) -> Array:
    """Matrix (4, 4) of a translation (3,), a quaternion (x, y, z, w) of any length but zero, and a scale (3,)."""
    given = np.asarray(rotation, dtype=np.float64)
    largest = float(np.abs(given).max())
    if not 0.0 < largest < np.inf:
        raise SceneError(f"{where}: its rotation {given.tolist()} is no quaternion")
    quaternion = given / largest  # first, so that no length overflows
    x, y, z, w = quaternion / np.linalg.norm(quaternion)
    turn = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )
    matrix = np.eye(4)
    matrix[:3, :3] = turn * np.asarray(scale, dtype=np.float64)
    matrix[:3, 3] = translation
    return matrix


def instances(document: Document, node: dict[str, Any], index: int, world_from_node: Array) -> list[Array]:
    """world_from_instance matrices of EXT_mesh_gpu_instancing; that of the node alone where it is absent.

    Raises
    ------
    SceneError
        If its attributes differ in number, or hold what is not finite.
    """
    extension = extensions(node).get("EXT_mesh_gpu_instancing")
    if extension is None:
        return [world_from_node]
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
    translation = given.get("TRANSLATION", np.zeros((number, 3)))
    rotation = given.get("ROTATION", np.tile((0.0, 0.0, 0.0, 1.0), (number, 1)))
    scale = given.get("SCALE", np.ones((number, 3)))
    parts = zip(translation, rotation, scale, strict=True)
    return [_product(world_from_node, compose(*part, where), where) for part in parts]
