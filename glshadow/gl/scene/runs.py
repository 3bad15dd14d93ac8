"""How much of each node's triangles is drawn at a time, and which of them."""

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
"""Triangles after which a driver on the CPU is told to begin: it rasterises on all cores, but only after it has sorted all that it was
given into tiles, on one. Of 608,752 triangles a 2048 map takes 74 ms at once and 61 so, the camera's pass 44 and 36 (llvmpipe, Mesa 22.3,
two cores). What is less than twice as much is drawn at once: on the courtyard's 91,656 each beginning costs 0.3 ms."""


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
        """The mesh."""
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
        """So many of the mesh, some at a time; `begin` is told which is the first."""
        triangles = array.vertices // 3
        step = max(1, AT_ONCE // triangles)
        for first in range(0, count, step):
            begin(first)
            array.render(instances=min(step, count - first))
            self._hurry.drawn(triangles * min(step, count - first))


class Runs:
    """Draws consecutive clusters of nodes.

    Parameters
    ----------
    placed : Placed
    drawn : (C,) bool
        Which of its clusters.
    triangles : (N,) int64
        How many each node has.
    """

    def __init__(
        self, context: GLContext, placed: Placed, drawn: NDArray[np.bool_], triangles: NDArray[np.int64]
    ) -> None:
        self._gl = context.gl
        starts, ends = runs_of(drawn, placed.first)
        self._at = np.searchsorted(starts, placed.first)
        body = placed.body[starts]
        own = placed.first[body]
        # a cluster that is its mesh has any size
        last = ends == placed.first[body + 1]
        self._first = (starts - own) * SIZE
        self._count = np.where(last, triangles[body], (ends - own) * SIZE) - self._first
        self._hurry = _Hurry(context, self.triangles)

    @property
    def triangles(self) -> int:
        """How many are drawn."""
        return int(self._count.sum())

    @property
    def nodes(self) -> NDArray[np.int64]:
        """Those of which anything is drawn."""
        return np.flatnonzero(np.diff(self._at))

    def __call__(self, array: moderngl.VertexArray, node: int) -> None:
        """The node's runs."""
        mine = slice(self._at[node], self._at[node + 1])
        first, count = self._first[mine], self._count[mine]
        whole = np.cumsum(count)
        cuts = [0, *np.unique(np.searchsorted(whole, np.arange(AT_ONCE, whole[-1], AT_ONCE)) + 1), len(count)]
        for low, high in pairwise(cuts):
            if low < high:
                self._gl.multi_draw(array.program.glo, array.glo, first[low:high], count[low:high])
                self._hurry.drawn(int(count[low:high].sum()))


def runs_of(drawn: NDArray[np.bool_], first: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Where runs of True begin and end (R,), none of them across a body's first cluster (N + 1,)."""
    border = np.zeros(len(drawn) + 1, dtype=bool)
    border[first] = True
    before, after = np.concatenate([[False], drawn]), np.concatenate([drawn, [False]])
    return np.flatnonzero(after & (~before | border)), np.flatnonzero(before & (~after | border))


class _Hurry:
    """Tells a driver on the CPU to begin."""

    def __init__(self, context: GLContext, total: int) -> None:
        self.helps = context.caps.software and total >= 2 * AT_ONCE
        self._gl, self._since = context.gl, 0

    def drawn(self, count: int) -> None:
        """So many triangles more are waiting."""
        self._since += count
        if self.helps and self._since >= AT_ONCE:
            self._gl.call("glFlush")
            self._since = 0
