"""The one loop that draws nodes: instances one after another, state changed only where it changes."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from itertools import pairwise
from typing import Any, Protocol

import moderngl
import numpy as np
from numpy.typing import NDArray

from glshadow.gl.scene.runs import Stroke


class Drawn(Protocol):
    """What is drawn, per node."""

    @property
    def mesh_number(self) -> NDArray[np.int64]:
        """Equal for instances of one mesh."""

    @property
    def mirrored(self) -> Sequence[bool]:
        """Whether a node's matrix turns the winding over."""


Begin = Callable[[int], tuple[Callable[[int], Any], moderngl.VertexArray]]
"""Node -> (what sets a node's own uniforms, its mesh as the program's input); called where the mesh changes."""


Crowd = Callable[[NDArray[np.int64]], Any]
"""Draws many nodes that share a mesh, in their order."""

_SIDES = (None, "back", "front")
_MANY = 8  # nodes that are a crowd: reading their matrices costs every vertex more than uniforms do


def draw_nodes(
    ctx: moderngl.Context,
    scene: Drawn,
    nodes: NDArray[Any] | Iterable[int],
    hidden: Sequence[str | None],
    begin: Begin,
    stroke: Stroke | None = None,
    crowd: Crowd | None = None,
) -> int:
    """Draw nodes; returns how many.

    Parameters
    ----------
    nodes : iterable of int
    hidden : sequence of {"back", "front", None}
        Per node of the scene the side that is left out.
    begin : Begin
    stroke : Stroke, optional
        Draws a mesh; else all of it is drawn at once.
    crowd : Crowd, optional
        Draws instances together; else each is drawn by itself.
    """
    chosen = np.fromiter(nodes, dtype=np.int64)
    number = scene.mesh_number
    chosen = chosen[np.argsort(number[chosen], kind="stable")]
    side = np.array([_SIDES.index(hidden[i]) for i in chosen.tolist()], dtype=np.int64)
    turned = np.asarray(scene.mirrored)[chosen] & (side > 0)  # a mirrored node's winding is turned over by its matrix
    side[turned] = 3 - side[turned]
    borders = np.flatnonzero((np.diff(number[chosen]) != 0) | (np.diff(side) != 0)) + 1
    ends = [0, *borders.tolist(), len(chosen)] if len(chosen) else []
    order, meshes, sides = chosen.tolist(), number[chosen].tolist(), side.tolist()
    culled: str | None = None
    previous = -1
    place: Callable[[int], Any] | None = None
    array: moderngl.VertexArray | None = None
    ctx.disable(moderngl.CULL_FACE)
    for start, end in pairwise(ends):
        cull = _SIDES[sides[start]]
        if cull != culled:
            culled = cull
            ctx.enable(moderngl.CULL_FACE) if cull else ctx.disable(moderngl.CULL_FACE)
            ctx.cull_face = cull or "back"
        if crowd is not None and end - start >= _MANY:
            crowd(chosen[start:end])
            previous = -1  # another program
            continue
        if meshes[start] != previous:  # a run is of one mesh
            previous = meshes[start]
            place, array = begin(order[start])
        assert place is not None
        assert array is not None
        for i in order[start:end]:
            place(i)
            if stroke is None:
                array.render()
            else:
                stroke(array, i)
    ctx.cull_face = "back"
    return len(chosen)
