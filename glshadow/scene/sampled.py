"""Sample points on a scene's surfaces, each for the same area: the same for the same scene."""

from __future__ import annotations

import weakref
from collections.abc import Sequence

import numpy as np

from glshadow.core.spaces import Array
from glshadow.scene.nodes import Node, Scene

SAMPLES = 1 << 14
MOST_TRIANGLES = 1 << 20  # whose areas are computed; of larger scenes every n-th of a node
_LEAST_OF_NODE = 64
_STEPS = (0.7548776662466927, 0.5698402909980532)  # the R2 sequence: 1 / g and 1 / g^2 of the root g of x^3 = x + 1

_kept: weakref.WeakKeyDictionary[Scene, tuple[Array, Array]] = weakref.WeakKeyDictionary()


def surface_samples(scene: Scene) -> tuple[Array, Array]:
    """World points (N, 3) and unit normals (N, 3) of front faces, each for the same area.

    A ground that was added, shadow catchers, and surfaces that blend or emit are left out if there are others. A scene without triangles
    gives the corners of its boxes, with normals away from their middle.
    """
    if scene not in _kept:
        _kept[scene] = _sampled(scene)
    return _kept[scene]


def _sampled(scene: Scene) -> tuple[Array, Array]:
    nodes = [node for node in (scene.nodes[i] for i in scene.drawn.tolist()) if len(node.mesh.triangles)]
    nodes = [node for node in nodes if not (node.ground or node.catches)] or nodes
    nodes = [node for node in nodes if not (node.blends or node.mesh.material.emits)] or nodes
    corners, areas = _triangles(nodes)
    total = np.cumsum(areas)
    if not len(total) or not total[-1] > 0.0:
        points = scene.corners.reshape(-1, 3)
        away = points - scene.extent.mean(axis=0)
        return points, away / np.maximum(np.linalg.norm(away, axis=1, keepdims=True), 1e-300)
    number = np.arange(SAMPLES)
    chosen = np.minimum(np.searchsorted(total, (number + 0.5) / SAMPLES * total[-1], side="right"), len(total) - 1)
    u, v = (np.modf(0.5 + number * step)[0] for step in _STEPS)
    u, v = np.where(u + v > 1.0, 1.0 - u, u), np.where(u + v > 1.0, 1.0 - v, v)
    a, b, c = (corners[chosen, k] for k in range(3))
    normals = np.cross(b - a, c - a)
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300)
    return a + u[:, None] * (b - a) + v[:, None] * (c - a), normals


def _triangles(nodes: Sequence[Node]) -> tuple[Array, Array]:
    """World corners (T, 3, 3) of triangles, and the areas (T,) that they stand for."""
    if not nodes:
        return np.zeros((0, 3, 3)), np.zeros(0)
    most = max(MOST_TRIANGLES // len(nodes), _LEAST_OF_NODE)
    corners: list[Array] = []
    areas: list[Array] = []
    for node in nodes:
        mesh = node.mesh
        step = -(-len(mesh.triangles) // most)
        placed = mesh.positions[mesh.triangles[step // 2 :: step]] @ node.world_from_mesh[:3, :3].T
        placed += node.world_from_mesh[:3, 3]
        a, b, c = (placed[:, k] for k in range(3))
        corners.append(placed)
        areas.append(0.5 * step * np.linalg.norm(np.cross(b - a, c - a), axis=1))
    return np.concatenate(corners), np.concatenate(areas)
