"""GPU data that a scene takes over from the one drawn before it: that of nodes which have not moved."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from glshadow.core.spaces import Array
from glshadow.gl.driver.buffers import BufferTexture
from glshadow.gl.driver.targets import release
from glshadow.scene.capsules import Capsules
from glshadow.scene.nodes import Node

if TYPE_CHECKING:
    from glshadow.gl.scene.world import WorldTriangles


@dataclass(eq=False)
class Before:
    """What a GpuScene leaves behind; owns its buffers until they are taken.

    Parameters
    ----------
    nodes : tuple of Node
        Its drawn nodes.
    first : (N,) int
        Index of each node's first triangle.
    count : int
        Triangles of all nodes.
    matrices : (N, 4, 4) float64
    origin : (3,) float64
    lifts : (N,) float64
    bent : (N,) bool
        Nodes with triangles that are shaded as smooth.
    planes, rounded, owners : BufferTexture, optional
    world : WorldTriangles, optional
    """

    nodes: tuple[Node, ...]
    first: NDArray[np.int64]
    count: int
    matrices: Array
    origin: Array
    lifts: Array
    bent: NDArray[np.bool_]
    planes: BufferTexture | None
    rounded: BufferTexture | None
    owners: BufferTexture | None
    world: WorldTriangles | None

    def differing(
        self, nodes: tuple[Node, ...], first: NDArray[np.int64], count: int, matrices: Array
    ) -> NDArray[np.bool_] | None:
        """Nodes (N,) whose mesh or matrix differs from that of the node in its place; None if the scenes have different numbers of
        nodes, triangles or vertices, or points or lines."""
        if len(nodes) != len(self.nodes) or count != self.count or not np.array_equal(first, self.first):
            return None
        if any(isinstance(node.mesh, Capsules) for node in nodes):
            return None
        pairs = list(zip(nodes, self.nodes, strict=True))
        if any(a is not b and len(a.mesh.positions) != len(b.mesh.positions) for a, b in pairs):
            return None
        meshes = np.array([a.mesh is not b.mesh for a, b in pairs])
        differs = meshes | (matrices != self.matrices).any(axis=(1, 2))
        return None if differs.all() else differs

    def release(self) -> None:
        """Free what was not taken."""
        release(self.planes, self.rounded, self.owners, self.world)
        self.planes = self.rounded = self.owners = self.world = None


def write_rows(
    texture: BufferTexture, rows: NDArray[np.generic], first: NDArray[np.int64], nodes: NDArray[np.int64]
) -> None:
    """Write the rows of some nodes, given in ascending order, into a buffer; node k has the rows from first[k] to first[k + 1]."""
    if len(nodes) == 0:
        return
    size = rows[:1].nbytes
    breaks = np.flatnonzero(np.diff(nodes) > 1) + 1
    for run in np.split(nodes, breaks):
        start, end = int(first[run[0]]), int(first[run[-1] + 1])
        texture.buffer.write(np.ascontiguousarray(rows[start:end]).tobytes(), offset=start * size)
