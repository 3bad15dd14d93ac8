"""Shadow atlases: one 2-D texture per format, with the tiles of all lights of that format."""

from __future__ import annotations

import math
from collections.abc import Callable, Hashable, Sequence
from typing import Any

import moderngl
import numpy as np
from numpy.typing import NDArray

from glshadow.errors import SettingsError
from glshadow.gl.driver.context import GLContext
from glshadow.gl.driver.targets import depth_texture, released_on_error
from glshadow.shadows.channel import CHANNELS, Channel
from glshadow.shadows.metric import Target
from glshadow.shadows.view import ShadowView

_COLOR_FORMATS = {Target.R32F: (1, "f4"), Target.R16F: (1, "f2"), Target.R8: (1, "f1"), Target.RGBA8: (4, "f1")}


class Atlas:
    """One 2-D texture for all views of a format: square tiles, largest first, packed on shelves.

    Attributes
    ----------
    texture : moderngl.Texture
        What receivers sample: the depth texture, or the colour target of the metric.
    framebuffer : moderngl.Framebuffer
    tiles : tuple
        Layout of the tiles; if it changes, the content is invalid.
    drawn : dict
        Per light the cache key of the content of its tiles.
    unused_depth : float
        If several lights share the atlas: depths up to this are still clear.
    shown : dict
        Per tile the clusters that `gl.scene.occlusion` found visible: a guess for the next map, never more.
    """

    def __init__(self, context: GLContext, target: Target, size: tuple[int, int], shared: bool = False) -> None:
        self.unused_depth = 0.0
        self.target, self.size = target, size
        self.tiles: tuple[Hashable, ...] = ()
        self.drawn: dict[Hashable, tuple[Hashable, ...]] = {}
        self.shown: dict[Hashable, Any] = {}
        self._staging: NDArray[np.float32] | None = None
        what = "the shadow map atlas"
        depth = depth_texture(context, size, target if target.is_depth else Target.DEPTH32F, what)
        self._owned: list[moderngl.Texture] = [depth]
        with released_on_error(self._owned):
            self.texture = depth
            if not target.is_depth:
                components, dtype = _COLOR_FORMATS[target]
                components = CHANNELS if shared else components
                self.texture = context.ctx.texture(size, components, dtype=dtype)
                self._owned.append(self.texture)
                self.texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
                self.texture.repeat_x = self.texture.repeat_y = False
            context.check_errors(f"allocating {what}, {size[0]} x {size[1]} {target.value}")
            colors = () if target.is_depth else (self.texture,)
            self.framebuffer = context.ctx.framebuffer(colors, depth)

    def staging(self, side: int) -> NDArray[np.float32]:
        """Memory (side, side) for reading depth back; kept, since fresh pages cost as much as the read."""
        if self._staging is None or len(self._staging) != side:
            self._staging = np.zeros((side, side), dtype=np.float32)
        return self._staging

    def release(self) -> None:
        """Free the GPU memory."""
        self.framebuffer.release()
        for texture in self._owned:
            texture.release()


def layout(views: Sequence[ShadowView], limit: int) -> tuple[tuple[ShadowView, ...], tuple[int, int]]:
    """Place the tiles of all views in one atlas.

    Parameters
    ----------
    limit : int
        Largest side that the driver allows, texels.

    Returns
    -------
    tuple of ShadowView, (width, height)
        The views in their given order, placed; the size of the atlas.

    Raises
    ------
    SettingsError
        If they do not fit.
    """
    if not views:
        return (), (0, 0)
    sides = [view.resolution + 2 * view.gutter for view in views]
    area, widest = sum(side**2 for side in sides), max(sides)
    width = min(max(widest, widest * math.ceil(math.sqrt(area) / widest)), limit)
    x = y = shelf = 0
    places: dict[int, tuple[int, int]] = {}
    for i in sorted(range(len(views)), key=lambda i: -sides[i]):
        side = sides[i]
        if x + side > width:
            x, y, shelf = 0, y + shelf, 0
        places[i] = (x + views[i].gutter, y + views[i].gutter)
        x, shelf = x + side, max(shelf, side)
    height = y + shelf
    if widest > limit or height > limit:
        raise SettingsError(
            f"{len(views)} shadow map views of up to {widest} texels need an atlas of {width} x {height}, the driver's limit is "
            f"{limit}: lower Shadow.resolution or let fewer lights cast shadows"
        )
    return tuple(view.placed(places[i]) for i, view in enumerate(views)), (width, height)


_Key = tuple[Target, int | None]
"""Format, and the pack of lights that share it, if any."""

Place = Callable[[], tuple[tuple[ShadowView, ...], Atlas]]
"""Returns the placed views and the atlas that holds them."""


class Atlases:
    """The atlases of a context, kept while their sizes do not change. A frame allocates all tiles before it uses the first."""

    def __init__(self, context: GLContext) -> None:
        self._context = context
        self._atlases: dict[_Key, Atlas] = {}
        self._allocations: dict[_Key, list[tuple[ShadowView, ...]]] = {}
        self._placed: dict[_Key, list[tuple[ShadowView, ...]]] = {}

    def begin(self) -> None:
        """Start a frame: no tile is allocated."""
        self._allocations.clear()
        self._placed.clear()
        for atlas in self._atlases.values():
            atlas.unused_depth = 0.0

    def allocate(self, target: Target, views: tuple[ShadowView, ...], channel: Channel | None = None) -> Place:
        """Allocate tiles; returns a function that gives their place. Lights of a pack share one tile, a channel each."""
        key = (target, channel.pack if channel else None)
        allocations = self._allocations.setdefault(key, [])
        number = len(allocations)
        allocations.append(views)

        def place() -> tuple[tuple[ShadowView, ...], Atlas]:
            if key not in self._placed:
                self._placed[key] = self._lay_out(key, allocations)
            return self._placed[key][number], self._atlases[key]

        return place

    def _lay_out(self, key: _Key, allocations: Sequence[tuple[ShadowView, ...]]) -> list[tuple[ShadowView, ...]]:
        target, pack = key
        wanted = [view for views in allocations for view in views]
        if pack is not None:  # one tile, large enough for the widest gutter
            wanted = [max(wanted, key=lambda view: view.resolution + 2 * view.gutter)]
        views, size = layout(wanted, self._context.caps.max_texture_size)
        atlas = self._atlases.get(key)
        if atlas is None or atlas.size != size:
            if atlas is not None:
                del self._atlases[key]
                atlas.release()
            atlas = self._atlases[key] = Atlas(self._context, target, size, pack is not None)
        tiles = tuple((view.tile, view.resolution, view.gutter) for view in views)
        if atlas.tiles != tiles:
            atlas.tiles = tiles
            atlas.drawn.clear()
            atlas.shown.clear()
        if pack is not None:
            return [tuple(view.placed(views[0].tile) for view in each) for each in allocations]
        rest = iter(views)
        return [tuple(next(rest) for _ in each) for each in allocations]

    def release(self) -> None:
        """Free the GPU memory."""
        for atlas in self._atlases.values():
            atlas.release()
        self._atlases.clear()
