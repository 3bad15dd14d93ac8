"""The one loop that draws nodes: instances one after another, state changed only where it changes."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Any, Protocol

import moderngl
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


def draw_nodes(
    ctx: moderngl.Context,
    scene: Drawn,
    nodes: NDArray[Any] | Iterable[int],
    hidden: Sequence[str | None],
    begin: Begin,
    stroke: Stroke | None = None,
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
    """
    mirrored, number = scene.mirrored, scene.mesh_number
    culled: str | None = None
    previous = -1
    place: Callable[[int], Any] | None = None
    array: moderngl.VertexArray | None = None
    chosen = sorted(map(int, nodes), key=number.__getitem__)
    ctx.disable(moderngl.CULL_FACE)
    for i in chosen:
        if number[i] != previous:
            previous = number[i]
            place, array = begin(i)
        assert place is not None
        assert array is not None
        place(i)
        cull = hidden[i]
        if cull is not None and mirrored[i]:
            cull = "front" if cull == "back" else "back"
        if cull != culled:
            culled = cull
            ctx.enable(moderngl.CULL_FACE) if cull else ctx.disable(moderngl.CULL_FACE)
            ctx.cull_face = cull or "back"
        if stroke is None:
            array.render()
        else:
            stroke(array, i)
    ctx.cull_face = "back"
    return len(chosen)
