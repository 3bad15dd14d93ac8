"""The one loop that draws nodes: instances one after another, state changed only where it changes."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from itertools import groupby
from typing import Any, Protocol

import moderngl
import numpy as np
from numpy.typing import NDArray

from glshadow.gl.runs import Stroke


class Drawn(Protocol):
    """What is drawn, per node."""

    @property
    def mesh_number(self) -> Sequence[int]:
        """Equal for instances of one mesh."""

    @property
    def mirrored(self) -> Sequence[bool]:
        """Whether a node's matrix turns the winding over."""


Begin = Callable[[int], tuple[Callable[[int], Any], moderngl.VertexArray]]
"""Node -> (what sets a node's own uniforms, its mesh as the program's input); called where the mesh changes."""


Crowd = Callable[[NDArray[np.int64]], Any]
"""Draws many nodes that share a mesh, in their order."""

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
    mirrored, number = scene.mirrored, scene.mesh_number
    culled: str | None = None
    previous = -1
    place: Callable[[int], Any] | None = None
    array: moderngl.VertexArray | None = None
    chosen = sorted(map(int, nodes), key=number.__getitem__)
    ctx.disable(moderngl.CULL_FACE)
    for (mesh, cull), run in groupby(chosen, lambda i: (number[i], _turned(hidden[i], mirrored[i]))):
        if cull != culled:
            culled = cull
            ctx.enable(moderngl.CULL_FACE) if cull else ctx.disable(moderngl.CULL_FACE)
            ctx.cull_face = cull or "back"
        together = list(run)
        if crowd is not None and len(together) >= _MANY:
            crowd(np.array(together))
            previous = -1  # another program
            continue
        for i in together:
            if mesh != previous:
                previous = mesh
                place, array = begin(i)
            assert place is not None
            assert array is not None
            place(i)
            if stroke is None:
                array.render()
            else:
                stroke(array, i)
    ctx.cull_face = "back"
    return len(chosen)


def _turned(cull: str | None, mirrored: bool) -> str | None:
    """The side that is left out of a node whose matrix may turn the winding over."""
    if cull is None or not mirrored:
        return cull
    return "front" if cull == "back" else "back"
