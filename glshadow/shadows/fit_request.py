"""FitRequest: the inputs of a fit; Fitted: its views."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from glshadow.core.cameras import Camera
from glshadow.core.spaces import Array, ClipSpace

if TYPE_CHECKING:
    from glshadow.lights import Light
    from glshadow.shadows.view import ShadowView


@dataclass(frozen=True, eq=False)
class DepthTiles:
    """Depth range of what a camera sees, for each tile of pixels that shows a surface.

    Parameters
    ----------
    starts, rays : (B, 4, 3) float64
        World; through the corners of each tile, rays of unit view depth.
    nearest, farthest : (B,) float64
        View depths.
    """

    starts: Array
    rays: Array
    nearest: Array
    farthest: Array

    def between(self, near: float, far: float) -> Array:
        """World points (N, 3) around what the blocks contain between two depths."""
        low, high = np.maximum(self.nearest, near), np.minimum(self.farthest, far)
        some = low <= high
        depths = np.stack([low[some], high[some]], axis=1)[:, :, None, None]
        points = self.starts[some][:, None] + depths * self.rays[some][:, None]
        return np.asarray(points.reshape(-1, 3))


@dataclass(frozen=True, eq=False)
class FitRequest:
    """Inputs of a fit.

    Parameters
    ----------
    scene : (N, 8, 3) float64
        World corners of all bodies' boxes; `boxes`: the same as bounds and matrices.
    seen : list of N arrays (M, 3)
        World corners of the part of each body that the camera sees.
    casters : (K, 3) float64
        World corners of all casters.
    size : (2,) ints
        Of the image.
    near, far : float
        Depth range of the camera.
    guard : int
        Texels around the covered area that a filter may read.
    fine : bool
        Whether the map's depth rounds relative to 1 / depth, see `view.fine_depth`.
    depth_tiles : DepthTiles, optional
        Depth tiles of the camera, if they were measured.
    """

    light: Light
    scene: Array
    boxes: tuple[Array, Array]
    seen: list[Array]
    casters: Array
    camera: Camera
    size: tuple[int, int]
    near: float
    far: float
    clip: ClipSpace
    resolution: int
    guard: int
    fine: bool = False
    depth_tiles: DepthTiles | None = None


@dataclass(frozen=True, eq=False)
class Fitted:
    """Views of a light. `shaded`: world points around the receivers that the views are for, if these are not all visible ones."""

    views: tuple[ShadowView, ...]
    shaded: Array | None = field(default=None, repr=False)
