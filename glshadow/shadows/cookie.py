"""Cookie: an image that a light projects, like a slide projector."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshadow.core.setting import Settings, flag, number, numbers_in, refuse, setting
from glshadow.core.spaces import FARTHEST, NEAREST

_ALLOWED = "an image (height, width, 3 or 4) of uint8, sRGB"


def _image(name: str, value: Any) -> NDArray[np.uint8]:
    array = numbers_in(value)
    if array is None or array.dtype != np.uint8 or array.ndim != 3 or array.shape[2] not in (3, 4) or not array.size:
        raise refuse(name, _ALLOWED, value)
    opaque = np.full((*array.shape[:2], 4), 255, dtype=np.uint8)
    opaque[..., :3] = array[..., :3]
    opaque.flags.writeable = False
    return opaque


@dataclass(frozen=True, eq=False)
class Cookie(Settings):
    """An image that colours a light. A spot light's fills the square around the cone; a directional light's is projected along it.

    Parameters
    ----------
    image : (H, W, 3 or 4) uint8
        sRGB, row 0 at the top; the share of each channel that it transmits, in linear light. Alpha is not used.
    repeat : bool
        Repeat the image beyond its borders; otherwise the border colour continues.
    size : float
        For a directional light: width of the image, world units; the centre of the first is on the light's line through the world origin.
    """

    image: NDArray[np.uint8] = setting(_image, help=_ALLOWED)
    repeat: bool = setting(flag(), False, help="repeat the image beyond its borders")
    size: float = setting(
        number(NEAREST, FARTHEST), 1.0, help="for a directional light: width of the image, world units"
    )

    def __repr__(self) -> str:
        height, width = self.image.shape[:2]
        return f"Cookie({width} x {height}, repeat={self.repeat}, size={self.size:g})"
