"""Meshes of outlines' tests."""

from __future__ import annotations

import numpy as np

import glshadow as gs
from glshadow.core.spaces import Array

_FACES = np.array(
    [
        [0, 2, 3], [0, 3, 1], [4, 5, 7], [4, 7, 6], [0, 1, 5], [0, 5, 4],
        [2, 6, 7], [2, 7, 3], [0, 4, 6], [0, 6, 2], [1, 3, 7], [1, 7, 5],
    ]
)  # fmt: skip


def box(low: tuple[float, float, float], high: tuple[float, float, float]) -> gs.Mesh:
    """A closed box."""
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], dtype=float)
    return gs.Mesh(np.array(low) + corners * (np.array(high) - low), _FACES)


def disc(count: int, height: float, radius: float = 1.0) -> gs.Mesh:
    """A horizontal fan of `count` triangles."""
    turn = 2.0 * np.pi * np.arange(count) / count
    rim = np.stack([radius * np.cos(turn), np.full(count, height), radius * np.sin(turn)], axis=1)
    k = np.arange(count)
    return gs.Mesh(np.vstack([rim, [[0, height, 0]]]), np.stack([k, np.roll(k, -1), np.full(count, count)], axis=1))


def sheet(corners: list[tuple[float, float, float]]) -> gs.Mesh:
    """A quadrilateral."""
    return gs.Mesh(np.array(corners, dtype=float), np.array([[0, 1, 2], [0, 2, 3]]))


def torus(major: float, minor: float, height: float, rings: int = 24, sides: int = 12) -> gs.Mesh:
    """A closed ring that lies flat."""
    a, b = np.meshgrid(2 * np.pi * np.arange(rings) / rings, 2 * np.pi * np.arange(sides) / sides, indexing="ij")
    across = major + minor * np.cos(b)
    points = np.stack([across * np.cos(a), height + minor * np.sin(b), across * np.sin(a)], axis=-1).reshape(-1, 3)
    i, j = np.meshgrid(np.arange(rings), np.arange(sides), indexing="ij")
    at = lambda p, q: (p % rings) * sides + q % sides  # noqa: E731
    quads = np.stack([at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j)], axis=-1).reshape(-1, 4)
    return gs.Mesh(points, np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]]))


def moved(scene: gs.Scene, scale: float, shift: Array) -> gs.Scene:
    """A scene whose nodes are scaled and moved."""
    matrix = np.diag([scale, scale, scale, 1.0])
    matrix[:3, 3] = shift
    nodes = [
        gs.Node(each.mesh, matrix @ each.world_from_mesh, each.name, each.casts, ground=each.ground)
        for each in scene.nodes
    ]
    return gs.Scene(nodes)
