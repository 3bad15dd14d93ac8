"""The draw loop: nodes sorted by mesh, with state changes only where the state differs."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from itertools import pairwise
from typing import Any, Protocol

import moderngl
import numpy as np
from numpy.typing import NDArray

from glshadow.gl.scene.runs import Stroke


class Drawn(Protocol):
    """The nodes' data that the loop reads."""

    @property
    def mesh_number(self) -> NDArray[np.int64]:
        """Number of each node's mesh; equal for instances of one mesh."""

    @property
    def mirrored(self) -> Sequence[bool]:
        """Whether a node's matrix flips the winding."""


Begin = Callable[[int], tuple[Callable[[int], Any], moderngl.VertexArray]]
"""Node -> (function that sets a node's uniforms, the mesh's vertex array); called where the mesh changes."""


Crowd = Callable[[NDArray[np.int64]], Any]
"""Draws several nodes that share a mesh, in order."""

_SIDES = (None, "back", "front")
_MANY = 8  # least instances drawn together: fetching matrices per vertex costs more than uniforms


def draw_nodes(
    ctx: moderngl.Context,
    scene: Drawn,
    nodes: NDArray[Any] | Iterable[int],
    hidden: Sequence[str | None],
    begin: Begin,
    stroke: Stroke | None = None,
    crowd: Crowd | None = None,
) -> int:
    """Draw nodes; returns the number of draws.

    Parameters
    ----------
    nodes : iterable of int
    hidden : sequence of {"back", "front", None}
        Per node of the scene the side that is culled.
    begin : Begin
    stroke : Stroke, optional
        Draws a mesh; None: all of it in one call.
    crowd : Crowd, optional
        Draws instances together; None: each by itself.
    """
    chosen = np.fromiter(nodes, dtype=np.int64)
    number = scene.mesh_number
    chosen = chosen[np.argsort(number[chosen], kind="stable")]
    side = np.array([_SIDES.index(hidden[i]) for i in chosen.tolist()], dtype=np.int64)
    turned = np.asarray(scene.mirrored)[chosen] & (side > 0)  # a mirrored node's matrix flips the winding
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
            previous = -1  # no mesh yet
            continue
        if meshes[start] != previous:  # instances in a run share one mesh
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
