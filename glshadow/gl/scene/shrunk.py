"""Images scaled down to what a driver's textures hold: halved by a box filter in linear light, as often as needed."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshadow.core.srgb import linear_from_srgb, srgb_from_linear

_AT_ONCE = 1 << 20  # pixels that are filtered at a time


def shrunk(pixels: NDArray[np.uint8], limit: int, srgb: bool = True) -> NDArray[np.uint8]:
    """Pixels (H, W, 4) with no side above `limit`: a side that is too long is halved, rounded down, until it is not.

    Parameters
    ----------
    srgb : bool
        Whether colours are sRGB; alpha is linear.
    """
    if pixels.shape[1] > limit:
        pixels = _narrowed(pixels, limit, srgb)
    if pixels.shape[0] > limit:
        pixels = _narrowed(pixels.swapaxes(0, 1), limit, srgb).swapaxes(0, 1)
    return pixels


def _narrowed(pixels: NDArray[np.uint8], limit: int, srgb: bool) -> NDArray[np.uint8]:
    levels = np.arange(256) / 255.0
    color = (linear_from_srgb(levels) if srgb else levels).astype(np.float32)
    rows = max(1, _AT_ONCE // pixels.shape[1])
    done = []
    for start in range(0, len(pixels), rows):
        block = pixels[start : start + rows]
        linear = np.concatenate([color[block[..., :3]], levels.astype(np.float32)[block[..., 3:]]], axis=-1)
        while linear.shape[1] > limit:
            linear = halved(linear)
        if srgb:
            linear[..., :3] = srgb_from_linear(linear[..., :3])
        done.append(np.rint(255.0 * linear).astype(np.uint8))
    return np.concatenate(done)


def halved(values: NDArray[Any]) -> NDArray[Any]:
    """Half as many columns of (H, W, ...), each the mean of two; of an odd W, of W / (W // 2) of them, with parts of the outer."""
    width = values.shape[1]
    half = width // 2
    if width % 2 == 0:
        means: NDArray[Any] = 0.5 * (values[:, 0::2] + values[:, 1::2])
        return means
    left = ((half - np.arange(half)) / width).astype(values.dtype)
    right = ((1 + np.arange(half)) / width).astype(values.dtype)
    shape = (1, half) + (1,) * (values.ndim - 2)
    middle = values[:, 1::2] * values.dtype.type(half / width)
    total: NDArray[Any] = left.reshape(shape) * values[:, 0:-1:2] + middle + right.reshape(shape) * values[:, 2::2]
    return total
