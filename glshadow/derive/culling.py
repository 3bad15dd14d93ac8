"""What need not be drawn: bodies out of a view's sight, and sides of triangles that nobody sees."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from glshadow.core.spaces import Array, project
from glshadow.shadows.shadow import Faces
from glshadow.shadows.view import ShadowView


def seen_by(clip_from_world: Array, boxes: Array, view: ShadowView) -> NDArray[np.bool_]:
    """Which boxes (N, 8, 3) may be seen by a view: not wholly beyond one of its sides or its far plane, nor behind a lamp."""
    clip = project(clip_from_world, boxes)
    w = clip[..., 3]
    beyond = (np.abs(clip[..., 0]) > w) & (np.sign(clip[..., 0]) == np.sign(clip[:, :1, 0]))
    above = (np.abs(clip[..., 1]) > w) & (np.sign(clip[..., 1]) == np.sign(clip[:, :1, 1]))
    depth = -(boxes @ view.view_from_world[2, :3] + view.view_from_world[2, 3])
    far = (depth > view.far) & (view.warp is None)  # else its planes lie elsewhere
    behind = w <= 0.0
    outside: NDArray[np.bool_] = beyond.all(1) | above.all(1) | far.all(1) | behind.all(1)
    return ~outside


def hidden_sides(faces: Faces | None, solid: NDArray[np.bool_]) -> list[str | None]:
    """Per body (N,) the side that is left out, "back", "front" or None; of a closed one the back, if nothing else was asked for."""
    if faces is not None:
        return [{Faces.FRONT: "back", Faces.BACK: "front", Faces.BOTH: None}[faces]] * len(solid)
    return ["back" if flag else None for flag in solid.tolist()]
