"""Runs of triangles: how many triangles of a node one draw call covers, and which."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import moderngl
import numpy as np
from numpy.typing import NDArray

from glshadow.geometry.clusters import SIZE, Placed
from glshadow.gl.driver.context import GLContext

Stroke = Callable[[moderngl.VertexArray, int], None]
"""Draws a mesh, the program's input, for a node."""

AT_ONCE = 1 << 16
"""Triangles after which a CPU driver is flushed. It rasterises on all cores, but only after one core has binned all triangles that it was
given. A 2048 map of 608,752 triangles takes 74 ms in one go and 61 ms with flushes, the camera pass 44 and 36 (llvmpipe, Mesa 22.3,
two cores). Fewer than twice as many are drawn in one go: with the courtyard's 91,656 each flush costs 0.3 ms."""


class Whole:
    """Draws all triangles of a mesh.

    Parameters
    ----------
    total : int
        Triangles of the whole scene.
    """

    def __init__(self, context: GLContext, total: int) -> None:
        self._hurry = _Hurry(context, total)

    def __call__(self, array: moderngl.VertexArray, node: int) -> None:
        """Draw the mesh."""
        count = array.vertices // 3
        if count <= AT_ONCE or not self._hurry.helps:
            array.render()
            self._hurry.drawn(count)
            return
        for first in range(0, count, AT_ONCE):
            piece = min(AT_ONCE, count - first)
            array.render(vertices=3 * piece, first=3 * first)
            self._hurry.drawn(piece)

    def instances(self, array: moderngl.VertexArray, count: int, begin: Callable[[int], None]) -> None:
        """Draw this many triangles of the mesh in parts; `begin` is called with the first of each part."""
        triangles = array.vertices // 3
        step = max(1, AT_ONCE // triangles)
        for first in range(0, count, step):
            begin(first)
            array.render(instances=min(step, count - first))
            self._hurry.drawn(triangles * min(step, count - first))


class Generated:
    """Draws elements whose vertices a shader makes from their numbers.

    Parameters
    ----------
    total : int
        Elements of the whole scene.
    corners : int
        Vertices of each.
    """

    def __init__(self, context: GLContext, total: int, corners: int) -> None:
        self._hurry, self._corners = _Hurry(context, total), corners

    def __call__(self, array: moderngl.VertexArray, count: int, begin: Callable[[int], None]) -> None:
        """Draw this many elements in parts; `begin` is called with the first of each part."""
        for first in range(0, count, AT_ONCE):
            piece = min(AT_ONCE, count - first)
            begin(first)
            array.render(moderngl.TRIANGLES, vertices=self._corners * piece)
            self._hurry.drawn(piece)


class Runs:
    """Draws runs of consecutive clusters of nodes.

    Parameters
    ----------
    placed : Placed
    drawn : (C,) bool
        Which clusters.
    triangles : (N,) int64
        Triangles of each node.
    """

    def __init__(
        self, context: GLContext, placed: Placed, drawn: NDArray[np.bool_], triangles: NDArray[np.int64]
    ) -> None:
        self._gl = context.gl
        starts, ends = runs_of(drawn, placed.first)
        self._at = np.searchsorted(starts, placed.first)
        body = placed.body[starts]
        own = placed.first[body]
        # a mesh of one cluster may have any size
        last = ends == placed.first[body + 1]
        self._first = (starts - own) * SIZE
        self._count = np.where(last, triangles[body], (ends - own) * SIZE) - self._first
        self._hurry = _Hurry(context, self.triangles)

    @property
    def triangles(self) -> int:
        """Number of triangles drawn."""
        return int(self._count.sum())

    @property
    def nodes(self) -> NDArray[np.int64]:
        """Nodes of which anything is drawn."""
        return np.flatnonzero(np.diff(self._at))

    def __call__(self, array: moderngl.VertexArray, node: int) -> None:
        """Draw the node's runs."""
        mine = slice(self._at[node], self._at[node + 1])
        first, count = self._first[mine], self._count[mine]
        whole = np.cumsum(count)
        cuts = [0, *np.unique(np.searchsorted(whole, np.arange(AT_ONCE, whole[-1], AT_ONCE)) + 1), len(count)]
        for low, high in pairwise(cuts):
            if low < high:
                self._gl.multi_draw(array.program.glo, array.glo, first[low:high], count[low:high])
                self._hurry.drawn(int(count[low:high].sum()))


def runs_of(drawn: NDArray[np.bool_], first: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Starts and ends (R,) of runs of True; no run crosses a body's first cluster (N + 1,)."""
    border = np.zeros(len(drawn) + 1, dtype=bool)
    border[first] = True
    before, after = np.concatenate([[False], drawn]), np.concatenate([drawn, [False]])
    return np.flatnonzero(after & (~before | border)), np.flatnonzero(before & (~after | border))


class _Hurry:
    """Flushes a CPU driver."""

    def __init__(self, context: GLContext, total: int) -> None:
        self.helps = context.caps.software and total >= 2 * AT_ONCE
        self._gl, self._since = context.gl, 0

    def drawn(self, count: int) -> None:
        """Count this many more pending triangles; flush when there are enough."""
        self._since += count
        if self.helps and self._since >= AT_ONCE:
            self._gl.call("glFlush")
            self._since = 0
