"""ShadowView, one view of a shadow map, and what the views of all lights have in common."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Literal

import numpy as np

from glshadow.core.cameras import Camera
from glshadow.core.spaces import Array, ClipSpace, bias_matrix, orthographic, perspective
from glshadow.shadows.metric import Target

if TYPE_CHECKING:  # lights have shadows
    from glshadow.lights import Light

Projection = Literal["orthographic", "perspective", "cube"]
"""Projection of a light's views. cube: perspective, up to six faces; the metric is the distance."""

# Rows x, y, z (backward) of the six faces of a point light: +x -x +y -y +z -z. Signed permutations, so that no face changes a
# coordinate's bits. GLSL twin: glsl/projection/cube.glsl
FACES = np.array(
    [
        rows
        for s in (1, -1)
        for rows in (
            [(0, 0, s), (0, 1, 0), (-s, 0, 0)],
            [(1, 0, 0), (0, 0, s), (0, -s, 0)],
            [(-s, 0, 0), (0, 1, 0), (0, 0, -s)],
        )
    ],
    dtype=np.float64,
)[[0, 3, 1, 4, 2, 5]]


def fine_depth(target: Target, clip: ClipSpace) -> bool:
    """Whether a map's depth rounds relative to 1 / depth."""
    return target is Target.DEPTH32F and clip.reversed and clip.zero_to_one


@dataclass(frozen=True, eq=False)
class Cascade:
    """Data that distinguishes one of several views of a light.

    Parameters
    ----------
    start, end : float
        Depths along the camera's view for which the view is used.
    blend : float
        Share of its half width, or of its slice, over which it fades into the next view.
    by_depth : bool
        Whether depth selects the view; otherwise the first view that covers the receiver is used.
    depth_of : (4,) float64
        Plane whose product with (world point, 1) is the depth.
    """

    start: float
    end: float
    blend: float
    by_depth: bool
    depth_of: Array


@dataclass(frozen=True, eq=False)
class ShadowView:
    """One rendered view from a light.

    Parameters
    ----------
    projection : {"orthographic", "perspective", "cube"}
        Projection and metric; cube: one of the faces around a point.
    face : int
        Face of a point light, otherwise 0.
    view_from_world : (4, 4) float64
        Rigid; the origin is the light's position, or for a directional light the middle of what it covers.
    window : (4,) floats
        Left, right, bottom, top of the tile, including the guard band: world units for a directional light, otherwise tangents.
    near, far : float
        Distances along the view; a directional light's near may be negative.
    clip : ClipSpace
    resolution : int
        Texels along each side of the tile.
    tile : (2,) ints
        Corner of the tile in its atlas, texels.
    inset : int
        Texels along the tile's border that filters read but that belong to no covered receiver; receivers outside are lit.
    gutter : int
        Empty texels around the tile, for a map too small to have a guard band inside.
    cascade : Cascade, optional
        For a directional light with several views.
    warp : (4, 4) float64, optional
        Applied in the view before the projection: perspective along the y axis of a directional light's map. Window, near and far then
        apply to the warped view.
    """

    projection: Projection
    face: int
    view_from_world: Array = field(repr=False)
    window: tuple[float, float, float, float]
    near: float
    far: float
    clip: ClipSpace
    resolution: int
    tile: tuple[int, int] = (0, 0)
    inset: int = 0
    gutter: int = 0
    cascade: Cascade | None = field(default=None, repr=False)
    warp: Array | None = field(default=None, repr=False)

    @cached_property
    def clip_from_view(self) -> Array:
        """(4, 4) projection."""
        matrix = (orthographic if self.projection == "orthographic" else perspective)(
            *self.window, self.near, self.far, self.clip
        )
        return matrix if self.warp is None else matrix @ self.warp

    @cached_property
    def clip_from_world(self) -> Array:
        """(4, 4) float64."""
        return self.clip_from_view @ self.view_from_world

    @cached_property
    def uvz_from_world(self) -> Array:
        """(4, 4) bias matrix times clip_from_world: (u, v, window depth) of the tile, before the division by w."""
        return bias_matrix(self.clip) @ self.clip_from_world

    @property
    def texel(self) -> tuple[float, float]:
        """Size of a texel: world units for a directional light, otherwise tangents (world units at distance 1)."""
        left, right, bottom, top = self.window
        return ((right - left) / self.resolution, (top - bottom) / self.resolution)

    def placed(self, tile: tuple[int, int]) -> ShadowView:
        """The same view at another position in the atlas."""
        return replace(self, tile=tile)


def camera_view(camera: Camera, size: tuple[int, int], near: float, far: float, clip: ClipSpace) -> ShadowView:
    """A camera as a view, so that functions for lights' views apply to it."""
    projection: Projection = "perspective" if camera.is_perspective else "orthographic"
    return ShadowView(projection, 0, camera.view_from_world, camera.window(size), near, far, clip, 1)


def shadow_views(
    light: Light,
    receivers: list[Array],
    casters: Array,
    clip: ClipSpace,
    resolution: int,
    guard: int,
    *,
    fine: bool = False,
    all_inside: bool = True,
) -> tuple[ShadowView, ...]:
    """The views that a light needs to shadow the given receivers.

    Parameters
    ----------
    receivers : list of (M, 3) float64
        Convex corner points in world space, one array per receiving body (see `geometry.fitting.visible_corners`); may be empty.
    casters : (K, 3) float64
        World corners of all casters.
    resolution, guard : int
        Texels along a side of a tile; texels around the fitted window that the filter may reach into.
    fine : bool
        Whether the map's depth rounds relative to 1 / depth, see `fine_depth`: a local light's near plane may then be close.
    all_inside : bool
        False: the map is also sampled for other receivers, which are lit.

    Returns
    -------
    tuple of ShadowView
        Empty if no receiver can be lit: nothing needs to be drawn.
    """
    bodies = [points for points in receivers if len(points)]
    if not bodies:
        return ()
    if (
        not all_inside and resolution > 4 * guard
    ):  # receivers may lie beyond the fitted window by the filter's reach, and are filtered beyond that
        found = light.views(bodies, casters, clip, resolution, 2 * guard, fine)
        return tuple(replace(view, inset=guard) for view in found)
    inside = min(guard, (resolution - 1) // 2)
    gutter = guard if inside < guard else 0
    found = light.views(bodies, casters, clip, resolution, inside, fine)
    return tuple(replace(view, gutter=gutter) for view in found) if gutter else found
