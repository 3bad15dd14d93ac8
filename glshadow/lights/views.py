"""The views that a light's shadow map needs, with room for what its filter reads."""

from __future__ import annotations

from dataclasses import replace

from glshadow.core.spaces import Array, ClipSpace
from glshadow.core.view import ShadowView
from glshadow.lights.light import Light


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
        Convex corner points in world space, one array per receiving body (see `fit.visible_corners`); may be empty.
    casters : (K, 3) float64
        World corners of everything that casts.
    resolution, guard : int
        Texels along a side of a tile; texels around the fitted window that the filter may reach into.
    fine : bool
        Whether the map's depth rounds relative to 1 / depth, see `fine_depth`: a lamp's near plane may then come close.
    all_inside : bool
        False: the map will be asked for other receivers too, which are lit.

    Returns
    -------
    tuple of ShadowView
        Empty where no receiver can be lit: then nothing needs to be drawn.
    """
    bodies = [points for points in receivers if len(points)]
    if not bodies:
        return ()
    if (
        not all_inside and resolution > 4 * guard
    ):  # a filter's reach is answered for beyond what was fitted, and read beyond that
        found = light.views(bodies, casters, clip, resolution, 2 * guard, fine)
        return tuple(replace(view, inset=guard) for view in found)
    inside = min(guard, (resolution - 1) // 2)
    gutter = guard if inside < guard else 0
    found = light.views(bodies, casters, clip, resolution, inside, fine)
    return tuple(replace(view, gutter=gutter) for view in found) if gutter else found
