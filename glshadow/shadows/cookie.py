"""Cookie: an image that a light projects, as a slide does."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from glshadow.core.setting import Settings, flag, number, numbers_in, refuse, setting
from glshadow.core.spaces import FARTHEST, NEAREST, Array, view_axes

if TYPE_CHECKING:  # lights have cookies
    from glshadow.core.lights import DirectionalLight, SpotLight

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
    """An image that colours a light: of a spot it fills the square around the cone, of a sun it lies across the light.

    Parameters
    ----------
    image : (H, W, 3 or 4) uint8
        sRGB, row 0 at the top; what it lets through of each channel, in linear light. Alpha is not used.
    repeat : bool
        Beyond its borders the image again; else the colour of the border goes on.
    size : float
        Of a sun: width of the image, world units; the middle of the first lies on the line of light through the world's origin.
    """

    image: NDArray[np.uint8] = setting(_image, help=_ALLOWED)
    repeat: bool = setting(flag(), False, help="beyond its borders the image again")
    size: float = setting(number(NEAREST, FARTHEST), 1.0, help="of a sun: width of the image, world units")

    def __repr__(self) -> str:
        height, width = self.image.shape[:2]
        return f"Cookie({width} x {height}, repeat={self.repeat}, size={self.size:g})"


def cookie_from_world(light: DirectionalLight | SpotLight) -> Array:
    """(4, 4) float64: (u, v, -, w) of world points, v up; u / w, v / w from 0 to 1 on the image, w > 0 before the light."""
    assert light.cookie is not None
    axes = view_axes(np.asarray(light.direction))
    height, width = light.cookie.image.shape[:2]
    matrix = np.eye(4)
    matrix[:3, :3] = axes
    position = getattr(light, "position", None)
    if position is None:
        across = 1.0 / light.cookie.size
        image = np.array([[across, 0, 0, 0.5], [0, across * width / height, 0, 0.5], [0, 0, 1, 0], [0, 0, 0, 1.0]])
        return np.asarray(image @ matrix)
    matrix[:3, 3] = -axes @ np.asarray(position)
    scale = 0.5 / np.tan(np.radians(light.outer_angle))  # type: ignore[union-attr]
    image = np.array([[scale, 0, -0.5, 0], [0, scale, -0.5, 0], [0, 0, 1, 0], [0, 0, -1.0, 0]])
    return np.asarray(image @ matrix)
