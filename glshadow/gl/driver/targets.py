"""Render targets: depth textures of any format, and the camera's buffers."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from copy import copy
from types import MappingProxyType
from typing import Any

import moderngl
import numpy as np

from glshadow.core.sampling import grid
from glshadow.core.spaces import Array
from glshadow.core.srgb import srgb_from_linear
from glshadow.gl.driver.context import GLContext
from glshadow.gl.driver.entry_points import DEPTH_COMPONENT16, DEPTH_COMPONENT24, DEPTH_COMPONENT32F
from glshadow.shadows.metric import Target

DEPTH_FORMATS = {
    Target.DEPTH16: DEPTH_COMPONENT16,
    Target.DEPTH24: DEPTH_COMPONENT24,
    Target.DEPTH32F: DEPTH_COMPONENT32F,
}


def depth_texture(context: GLContext, size: tuple[int, int], target: Target, what: str) -> moderngl.Texture:
    """A depth texture of any of the three formats.

    Raises
    ------
    ResourceError
        If there is not enough memory. A size above the driver's limit is a SettingsError.
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
    """Release the given objects if the block raises: moderngl deletes nothing by itself."""
    try:
        yield
    except BaseException:
        for thing in things:
            thing.release()
        raise


def release(*things: Any) -> None:
    """Release all that are not None."""
    for thing in things:
        if thing is not None:
            thing.release()


def succeed(framebuffer: moderngl.Framebuffer, *old: Any) -> None:
    """Bind the replacement of a framebuffer and its textures, then release these: else moderngl would bind the old one again."""
    framebuffer.use()
    release(*old)


def clear_outputs(context: GLContext, targets: CameraTargets, background: Array, transparent: bool) -> None:
    """Clear to the background colour (linear), and visibility to NaN where there is no surface; alpha is 0 for a transparent background."""
    color = (0.0,) * 4 if transparent else (*background, 0.0)
    for i in reversed(range(max(len(targets.visibility), 1))):  # the first light's last, since it is drawn to next
        targets.framebuffer(targets.image, i).use()
        if targets.visibility:
            context.gl.clear_floats(1, (np.nan,) * 4)
    context.gl.clear_floats(0, tuple(srgb_from_linear(color)))
    if targets.linear is not None:
        context.gl.clear_floats(2, color)


class SurfaceTargets:
    """The surface buffer: render target of the camera pass and the primary-visibility passes.

    Attributes
    ----------
    surface, depth : moderngl.Texture
    emission : moderngl.Texture, optional
        Emitted light, where `emits` requested it.
    framebuffer, depth_alone : moderngl.Framebuffer
        With all attachments; with depth alone, writable.
    """

    def __init__(
        self, context: GLContext, size: tuple[int, int], channels: int, what: str, emits: bool = False
    ) -> None:
        context.check_size(size, what)
        ctx = context.ctx
        self.depth = depth_texture(context, size, Target.DEPTH32F, what)
        made: list[Any] = [self.depth]
        with released_on_error(made):
            self.surface = ctx.texture(size, channels, dtype="u4")
            made.append(self.surface)
            self.surface.filter = (moderngl.NEAREST, moderngl.NEAREST)
            self.emission = ctx.texture(size, 1, dtype="u4") if emits else None
            if self.emission is not None:
                made.append(self.emission)
                self.emission.filter = (moderngl.NEAREST, moderngl.NEAREST)
            context.check_errors(f"allocating {what}, {size[0]} x {size[1]}")
            colors = [self.surface] if self.emission is None else [self.surface, self.emission]
            self.framebuffer = ctx.framebuffer(colors, self.depth)
            self.depth_alone = ctx.framebuffer(depth_attachment=self.depth)
        self._made = (self.framebuffer, self.depth_alone, *made)

    def release(self) -> None:
        """Free the GPU memory."""
        release(*self._made)


class CameraTargets:
    """Render targets of the camera pass and the resolve passes for one image size; `identity` is unique for each instance.

    Attributes
    ----------
    size : (2,) ints
        Of the image.
    samples : int
        Per pixel.
    block : (2,) ints
        Their columns and rows.
    surface, depth : moderngl.Texture
        The surface of each pixel.
    emission : moderngl.Texture, optional
        The light that it emits.
    fine : SurfaceTargets
        The surface of each sample; with one sample per pixel, `surface` and `depth` are its textures.
    mixed : moderngl.Texture, optional
        1 where a pixel's samples see several surfaces.
    points, given : int, mapping
        GLS_POINTS of lib/given_point.glsl and its textures by name, of targets of points (`passes.points`); 0, empty: of an image.
    """

    points: int = 0
    given: Mapping[str, moderngl.Texture] = MappingProxyType({})
    _count = itertools.count()

    def __init__(
        self,
        context: GLContext,
        size: tuple[int, int],
        samples: int,
        channels: int,
        lights: int,
        visibility: bool,
        linear: bool,
        emits: bool = False,
    ) -> None:
        self.identity = next(self._count)
        self.size, self.samples, self.block = size, samples, grid(samples)
        ctx = context.ctx
        what = "the image" if samples == 1 else f"{samples} samples of the image's pixels"
        self.fine = SurfaceTargets(context, (size[0] * self.block[0], size[1] * self.block[1]), channels, what, emits)
        made: list[Any] = [self.fine]

        def texture(components: int, dtype: str) -> moderngl.Texture:
            made.append(ctx.texture(size, components, dtype=dtype))
            context.check_errors(f"allocating {what}, {size[0]} x {size[1]}")
            kept: moderngl.Texture = made[-1]
            return kept

        with released_on_error(made):
            self.surface, self.depth, self.emission = self.fine.surface, self.fine.depth, self.fine.emission
            if samples > 1:
                self.depth = depth_texture(context, size, Target.DEPTH32F, what)
                made.append(self.depth)
                self.surface = texture(channels, "u4")
                self.surface.filter = (moderngl.NEAREST, moderngl.NEAREST)
                if emits:
                    self.emission = texture(1, "u4")
                    self.emission.filter = (moderngl.NEAREST, moderngl.NEAREST)
            self.mixed = texture(1, "u1") if samples > 1 else None
            if self.mixed is not None:
                self.mixed.filter = (moderngl.NEAREST, moderngl.NEAREST)
            self.image = texture(4, "f1")
            self.sums = [texture(4, "f4") for _ in range(min(lights - 1, 2))]  # read one, write the other
            self.visibility = [texture(1, "f4") for _ in range(lights if visibility else 0)]
            for each in self.visibility:  # clamp to the edge of the image
                each.repeat_x = each.repeat_y = False
            self.linear = texture(4, "f4") if linear else None
            self.spare = texture(1, "f1") if linear and not self.visibility else None
            self.depth_framebuffer = ctx.framebuffer(depth_attachment=self.depth)
            self.depth_framebuffer.depth_mask = False
        self._made = made
        self._framebuffers: dict[tuple[int, int], moderngl.Framebuffer] = {}
        self._context = context

    @property
    def aside(self) -> tuple[float, float]:
        """Offset, right and up of the pixel's centre, of the sample whose surface the pixel shows; pixels."""
        columns, rows = self.block
        return (0.0, 0.0) if self.samples == 1 else (0.5 / columns, 0.5 / rows)

    @property
    def sampled(self) -> tuple[float, float, float, float]:
        """Half the extent of a pixel's samples, right and up, and `aside`; pixels."""
        columns, rows = self.block
        return (0.5 - 0.5 / columns, 0.5 - 0.5 / rows, *self.aside)

    def framebuffer(self, color: moderngl.Texture, light: int) -> moderngl.Framebuffer:
        """Framebuffer with a colour texture, and the visibility of one light and the linear sum where they are requested, and the camera's
        depth, read-only. Attachment points are fixed: colour 0, visibility 1, linear 2."""
        key = (color.glo, light)
        if key not in self._framebuffers:
            textures = [color]
            if light < len(self.visibility):
                textures.append(self.visibility[light])
            if self.linear is not None and color is self.image:
                if self.spare is not None:
                    textures.append(self.spare)  # keeps attachment point 1
                textures.append(self.linear)
            framebuffer = self._context.ctx.framebuffer(textures, self.depth)
            framebuffer.depth_mask = False
            self._framebuffers[key] = framebuffer
        return self._framebuffers[key]

    def showing(self, fine: SurfaceTargets) -> CameraTargets:
        """The same targets, for one sample per pixel, with another surface buffer; release both."""
        other = copy(self)
        other.fine, other.surface, other.depth, other.emission = fine, fine.surface, fine.depth, fine.emission
        other.depth_framebuffer = self._context.ctx.framebuffer(depth_attachment=fine.depth)
        other.depth_framebuffer.depth_mask = False
        other._made, other._framebuffers = [fine], {}
        other.renew()
        return other

    def renew(self) -> None:
        """Change the identity: the surface buffer has another content, and what was derived from it is invalid."""
        self.identity = next(self._count)

    def release(self) -> None:
        """Free the GPU memory."""
        for thing in (self.depth_framebuffer, *self._framebuffers.values(), *self._made):
            thing.release()
