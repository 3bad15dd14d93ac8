"""Casters of an outline: the distinct vertices and the triangles of nodes, and clipping of triangles by half-spaces."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from glshadow.core.spaces import Array, world_positions
from glshadow.errors import SceneError, warn
from glshadow.geometry.welding import welded
from glshadow.scene.capsules import Capsules
from glshadow.scene.mesh import AlphaMode
from glshadow.scene.nodes import Node, Scene

Indices = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Caster:
    """Triangles that block light.

    Attributes
    ----------
    points : (V, 3) float64
        Distinct positions, relative to an origin.
    triangles : (T, 3) int64
        Indices of three different points.
    name : str
        The node's.
    """

    points: Array
    triangles: Indices
    name: str


def casters_of(scene: Scene, chosen: list[int], origin: Array) -> list[Caster]:
    """The chosen nodes that cast, relative to an origin (3,); what blends casts nothing, as in `Frame.visibility`.

    Raises
    ------
    SceneError
        For points and lines.
    """
    found = []
    cut = []
    for number in chosen:
        node = scene.nodes[number]
        if not (node.drawn and node.casts) or node.blends:
            continue
        if node.mesh.material.alpha_mode is AlphaMode.MASK:
            cut.append(node.name)
        found.append(caster_of(node, origin))
    if cut:
        names = ", ".join(map(repr, cut[:3])) + ", ..." * (len(cut) > 3)
        warn(f"cut-out materials (MASK) count with their whole triangles in an outline: {names}", stacklevel=4)
    return found


def caster_of(node: Node, origin: Array, every: bool = False) -> Caster:
    """A node's triangles, relative to an origin (3,); `every`: also those with two equal corners."""
    if isinstance(node.mesh, Capsules):
        raise SceneError(
            f"{node.label} has points or lines, and outlines are those of triangles: leave it out with of="
        )
    points = world_positions(node.mesh.positions, node.world_from_mesh, origin)
    number = welded(points)
    distinct = np.zeros((int(number.max(initial=-1)) + 1, 3))
    distinct[number] = points
    triangles = number[node.mesh.triangles]
    a, b, c = triangles.T
    return Caster(distinct, triangles if every else triangles[(a != b) & (b != c) & (c != a)], node.name)


def clip(rows: Array, triangles: Indices, values: Array) -> tuple[Array, Indices]:
    """The part of triangles (T, 3) where a function that is linear over them is not negative.

    A vertex is any row of numbers that are linear over a triangle. Both triangles at an edge get the same new vertex on it.

    Parameters
    ----------
    rows : (V, C) float64
        Vertices.
    triangles : (T, 3) int64
    values : (V,) float64
        Of the function at the vertices.

    Returns
    -------
    (V + N, C) float64, (K, 3) int64
        Vertices, the given ones first; triangles.
    """
    inside = values >= 0.0
    count = inside[triangles].sum(axis=1)
    whole, one, two = (triangles[count == k] for k in (3, 1, 2))
    if not len(one) and not len(two):
        return rows, whole
    # begin with the corner that is alone on its side
    one = _begun(one, inside[one])
    two = _begun(two, ~inside[two])
    pairs = np.concatenate([one[:, [0, 1]], one[:, [0, 2]], two[:, [0, 1]], two[:, [0, 2]]])
    edges, where = np.unique(np.sort(pairs, axis=1), axis=0, return_inverse=True)
    low, high = values[edges[:, 0]], values[edges[:, 1]]
    share = (low / (low - high))[:, None]
    made = rows[edges[:, 0]] * (1.0 - share) + rows[edges[:, 1]] * share
    at = (len(rows) + where.ravel()).astype(np.int64)
    n, m = len(one), len(two)
    first, second, third, fourth = at[:n], at[n : 2 * n], at[2 * n : 2 * n + m], at[2 * n + m :]
    kept = [
        whole,
        np.stack([one[:, 0], first, second], axis=1),
        np.stack([third, two[:, 1], two[:, 2]], axis=1),
        np.stack([third, two[:, 2], fourth], axis=1),
    ]
    return np.concatenate([rows, made]), np.concatenate(kept)


def _begun(triangles: Indices, alone: NDArray[np.bool_]) -> Indices:
    """Triangles rotated to begin with the one corner that is marked."""
    start = alone.argmax(axis=1)
    return np.stack([triangles[np.arange(len(triangles)), (start + k) % 3] for k in range(3)], axis=1)
