"""Textures on the GPU: uploaded once for each way in which they are sampled, released with their last user."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import moderngl
import numpy as np
from numpy.typing import NDArray

from glshadow.errors import warn
from glshadow.gl.driver.context import GLContext
from glshadow.gl.driver.shared import Shared
from glshadow.gl.scene.extended import extended
from glshadow.gl.scene.shrunk import shrunk
from glshadow.lights.reflection import albedo_table
from glshadow.scene.texture import CLAMP, LINEAR, MINIFY, MIRROR, NEAREST, REPEAT, Sampler

_SRGB8_ALPHA8, _RGBA8 = 0x8C43, 0x8058
_WRAPS = {REPEAT: 0x2901, CLAMP: 0x812F, MIRROR: 0x8370}
_FILTERS = {
    MINIFY[0]: moderngl.LINEAR_MIPMAP_LINEAR,
    MINIFY[1]: moderngl.LINEAR_MIPMAP_NEAREST,
    MINIFY[2]: moderngl.NEAREST_MIPMAP_LINEAR,
    MINIFY[3]: moderngl.NEAREST_MIPMAP_NEAREST,
    LINEAR: moderngl.LINEAR,
    NEAREST: moderngl.NEAREST,
}


@dataclass(frozen=True)
class _Kind:
    """How pixels are stored and sampled; equal ones are the same object, see `_kind`."""

    filtering: tuple[str, str, str, str]
    srgb: bool
    cut: bool


@cache
def _kind(filtering: tuple[str, str, str, str], srgb: bool, cut: bool) -> _Kind:
    return _Kind(filtering, srgb, cut)


class Textures:
    """A context's textures of materials."""

    def __init__(self, context: GLContext) -> None:
        self._context = context
        self._shared: Shared[moderngl.Texture] = Shared()

    def take(
        self, pixels: NDArray[np.uint8], sampler: Sampler, srgb: bool, what: str, cut: bool = False
    ) -> moderngl.Texture:
        """The texture of these pixels, read as linear light if they are `srgb`; each `take` needs one `give_back`.

        `cut`: nothing is seen where alpha is 0, and the colours there are those of its surroundings.
        """
        kind = _kind(sampler.filtering, srgb, cut)
        return self._shared.take(lambda: self._made(pixels, kind, what), pixels, kind)

    def give_back(self, pixels: NDArray[np.uint8], sampler: Sampler, srgb: bool, cut: bool = False) -> None:
        """Drop one user."""
        self._shared.give_back(pixels, _kind(sampler.filtering, srgb, cut))

    def _made(self, pixels: NDArray[np.uint8], kind: _Kind, what: str) -> moderngl.Texture:
        texture = color_texture(self._context, extended(pixels) if kind.cut else pixels, what, kind.srgb)
        *wraps, magnify, minify = kind.filtering
        texture.filter = (_FILTERS[minify], _FILTERS[magnify])
        if kind.filtering[:2] != (REPEAT, REPEAT):
            self._context.gl.wrap(texture.glo, *(_WRAPS[each] for each in wraps))
        return texture


def color_texture(
    context: GLContext, pixels: NDArray[np.uint8], what: str = "a base colour texture", srgb: bool = True
) -> moderngl.Texture:
    """Pixels (H, W, 4) as a texture, scaled down, with a warning, if the driver holds no such size; sRGB ones are read as linear light."""
    height, width = pixels.shape[:2]
    if max(width, height) > context.largest_side:
        pixels = shrunk(pixels, context.largest_side, srgb)
        warn(
            f"{what} of {width} x {height} pixels is scaled down to {pixels.shape[1]} x {pixels.shape[0]}: this driver's textures are at "
            f"most {context.largest_side} wide and high"
        )
        height, width = pixels.shape[:2]
    # v points up: row 0 of the file is the top
    form = _SRGB8_ALPHA8 if srgb else _RGBA8
    texture = context.ctx.texture((width, height), 4, pixels[::-1].tobytes(), internal_format=form)
    texture.build_mipmaps()
    texture.filter = (moderngl.LINEAR_MIPMAP_LINEAR, moderngl.LINEAR)
    return texture


def albedo_texture(context: GLContext) -> moderngl.Texture:
    """`lights.reflection.albedo_table`: its columns, cosines to the eye, along u."""
    table = albedo_table().astype(np.float32)
    texture = context.ctx.texture(table.shape, 1, table.tobytes(), dtype="f4")
    texture.filter = (moderngl.LINEAR, moderngl.LINEAR)
    texture.repeat_x = texture.repeat_y = False
    return texture
