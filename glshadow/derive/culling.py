"""View culling of bodies, and culling of triangle sides that are never visible."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from glshadow.core.spaces import Array, project
from glshadow.shadows.shadow import Faces
from glshadow.shadows.view import ShadowView


def seen_by(clip_from_world: Array, boxes: Array, view: ShadowView) -> NDArray[np.bool_]:
    """Which boxes (N, 8, 3) a view may see: not wholly beyond one of its sides or its far plane, nor behind a local light."""
    clip = project(clip_from_world, boxes)
    w = clip[..., 3]
    beyond = (np.abs(clip[..., 0]) > w) & (np.sign(clip[..., 0]) == np.sign(clip[:, :1, 0]))
    above = (np.abs(clip[..., 1]) > w) & (np.sign(clip[..., 1]) == np.sign(clip[:, :1, 1]))
    depth = -(boxes @ view.view_from_world[2, :3] + view.view_from_world[2, 3])
    far = (depth > view.far) & (view.warp is None)  # a warped view has other planes
    behind = w <= 0.0
    outside: NDArray[np.bool_] = beyond.all(1) | above.all(1) | far.all(1) | behind.all(1)
    return ~outside


def hidden_sides(faces: Faces | None, solid: NDArray[np.bool_]) -> list[str | None]:
    """Per body (N,) the side that is culled, "back", "front" or None; the back of a closed body, unless the settings request otherwise."""
    if faces is not None:
        return [{Faces.FRONT: "back", Faces.BACK: "front", Faces.BOTH: None}[faces]] * len(solid)
    return ["back" if flag else None for flag in solid.tolist()]
