"""Where passes draw to: the shadow atlas of one format, and the camera's buffers. Made once, kept while the sizes hold."""

from __future__ import annotations

import math
from collections.abc import Hashable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import moderngl
import numpy as np

from glshadow.core.metric import Target
from glshadow.core.spaces import Array
from glshadow.core.view import ShadowView
from glshadow.errors import SettingsError
from glshadow.gl.context import GLContext
from glshadow.gl.entry_points import DEPTH_COMPONENT16, DEPTH_COMPONENT24, DEPTH_COMPONENT32F

DEPTH_FORMATS = {
    Target.DEPTH16: DEPTH_COMPONENT16,
    Target.DEPTH24: DEPTH_COMPONENT24,
    Target.DEPTH32F: DEPTH_COMPONENT32F,
}
_COLOR_FORMATS = {Target.R32F: (1, "f4"), Target.R16F: (1, "f2"), Target.R8: (1, "f1"), Target.RGBA8: (4, "f1")}


def depth_texture(context: GLContext, size: tuple[int, int], target: Target, what: str) -> moderngl.Texture:
    """A depth texture of any of the three formats.

    Raises
    ------
    ResourceError
        If its memory is not to be had. One that is larger than the driver allows is a SettingsError.
    """
    context.check_size(size, what)
    texture = context.ctx.depth_texture(size)
    with released_on_error([texture]):
        if target is not Target.DEPTH24:
            context.gl.specify_depth(texture.glo, size, DEPTH_FORMATS[target])
        context.check_errors(f"allocating {what}, {size[0]} x {size[1]} {target.value}")
    return texture


@contextmanager
def released_on_error(things: Sequence[Any]) -> Iterator[None]:
    """Free what was made so far where making the rest fails: moderngl deletes nothing by itself."""
    try:
        yield
    except BaseException:
        for thing in things:
            thing.release()
        raise


class Atlas:
    """One 2-D texture for all views of a format: square tiles, largest first, on shelves.

    Attributes
    ----------
    texture : moderngl.Texture
        What receivers read: the depth texture, or the colour target of the metric.
    framebuffer : moderngl.Framebuffer
    tiles : tuple
        How its tiles lie; where that changes, nothing drawn before counts.
    drawn : dict
        What each light's tiles were last drawn from.
    """

    def __init__(self, context: GLContext, target: Target, size: tuple[int, int]) -> None:
        self.target, self.size = target, size
        self.tiles: tuple[Hashable, ...] = ()
        self.drawn: dict[Hashable, Hashable] = {}
        what = "the shadow map atlas"
        depth = depth_texture(context, size, target if target.is_depth else Target.DEPTH32F, what)
        self._owned: list[moderngl.Texture] = [depth]
        with released_on_error(self._owned):
            self.texture = depth
            if not target.is_depth:
                components, dtype = _COLOR_FORMATS[target]
                self.texture = context.ctx.texture(size, components, dtype=dtype)
                self._owned.append(self.texture)
                self.texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
                self.texture.repeat_x = self.texture.repeat_y = False
            context.check_errors(f"allocating {what}, {size[0]} x {size[1]} {target.value}")
            colors = () if target.is_depth else (self.texture,)
            self.framebuffer = context.ctx.framebuffer(colors, depth)

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


def clear_outputs(context: GLContext, targets: CameraTargets, background: Array) -> None:
    """Background colour (sRGB) everywhere, and NaN where no light can be asked."""
    for i in reversed(range(max(len(targets.visibility), 1))):  # the first light's last: it is drawn to next
        targets.framebuffer(targets.image, i).use()
        if targets.visibility:
            context.gl.clear_floats(1, (np.nan,) * 4)
    context.gl.clear_floats(0, (*background, 1.0))
    if targets.linear is not None:
        linear = np.where(background <= 0.04045, background / 12.92, ((background + 0.055) / 1.055) ** 2.4)
        context.gl.clear_floats(2, (*linear, 1.0))


class CameraTargets:
    """What the camera pass and the resolve passes draw to, for one image size."""

    def __init__(
        self, context: GLContext, size: tuple[int, int], channels: int, lights: int, visibility: bool, linear: bool
    ) -> None:
        self.key = (size, channels, lights, visibility, linear)
        ctx = context.ctx
        what = "the image"
        context.check_size(size, what)
        self.depth = depth_texture(context, size, Target.DEPTH32F, what)
        made = [self.depth]

        def texture(components: int, dtype: str) -> moderngl.Texture:
            made.append(ctx.texture(size, components, dtype=dtype))
            context.check_errors(f"allocating {what}, {size[0]} x {size[1]}")
            return made[-1]

        with released_on_error(made):
            self.surface = texture(channels, "u4")
            self.surface.filter = (moderngl.NEAREST, moderngl.NEAREST)
            self.image = texture(4, "f1")
            self.sums = [texture(4, "f4") for _ in range(min(lights - 1, 2))]  # read one, write the other
            self.visibility = [texture(1, "f4") for _ in range(lights if visibility else 0)]
            self.linear = texture(4, "f4") if linear else None
            self.spare = texture(1, "f1") if linear and not self.visibility else None
            self.surface_framebuffer = ctx.framebuffer([self.surface], self.depth)
        self._framebuffers: dict[tuple[int, int], moderngl.Framebuffer] = {}
        self._context = context

    def framebuffer(self, color: moderngl.Texture, light: int) -> moderngl.Framebuffer:
        """Framebuffer of a colour texture, the visibility of one light and the linear sum, where they are wanted, and the camera's
        depth, which is not written. Their places are fixed: colour 0, visibility 1, linear 2."""
        key = (color.glo, light)
        if key not in self._framebuffers:
            textures = [color]
            if light < len(self.visibility):
                textures.append(self.visibility[light])
            if self.linear is not None and color is self.image:
                if self.spare is not None:
                    textures.append(self.spare)  # keeps place 1
                textures.append(self.linear)
            framebuffer = self._context.ctx.framebuffer(textures, self.depth)
            framebuffer.depth_mask = False
            self._framebuffers[key] = framebuffer
        return self._framebuffers[key]

    def release(self) -> None:
        """Free the GPU memory."""
        for framebuffer in (self.surface_framebuffer, *self._framebuffers.values()):
            framebuffer.release()
        for texture in (self.depth, self.surface, self.image, *self.sums, *self.visibility, self.linear, self.spare):
            if texture is not None:
                texture.release()
