"""A background with a sky: its colour by the height of each pixel's ray, and images over it."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshadow.core.camera import Camera
from glshadow.core.spaces import Array
from glshadow.core.srgb import linear_from_srgb, srgb_from_linear

Sky = tuple[tuple[float, float, float], tuple[float, float, float]]
"""sRGB at the horizon and below, and at the zenith."""
PALE = 0.2
"""Sine of the elevation by which 63 % of the way from the horizon's colour to the zenith's is done, as in hazy air."""


def backdrop(sky: Sky, camera: Camera, size: tuple[int, int]) -> Array:
    """Linear colours (H, W, 3) of the sky behind each pixel's centre."""
    directions = camera.rays(size)[1]
    height = directions[..., 1] / np.linalg.norm(directions, axis=-1)
    share = 1.0 - np.exp(-np.maximum(height, 0.0) / PALE)
    low, high = (linear_from_srgb(color) for color in sky)
    return np.asarray(low + share[..., None] * (high - low))


def over(image: NDArray[np.uint8], behind: Array) -> NDArray[np.uint8]:
    """An image (H, W, 4) with straight alpha over linear colours (H, W, 3), as (H, W, 3); opaque pixels keep their values."""
    result = image[..., :3].copy()
    open_ = image[..., 3] < 255
    alpha = image[open_, 3:] / 255.0
    mixed = alpha * _LINEAR[image[open_, :3]] + (1.0 - alpha) * behind[open_]
    result[open_] = np.rint(255.0 * srgb_from_linear(np.clip(mixed, 0.0, 1.0)))
    return result


_LINEAR = linear_from_srgb(np.arange(256) / 255.0)


def place_before(sky: Sky, camera: Camera, outputs: dict[str, Any]) -> None:
    """Put the outputs `image` and `linear` of a transparent background, if they are there, over a sky."""
    present = [name for name in ("image", "linear") if name in outputs]
    if not present:
        return
    height, width = outputs[present[0]].shape[:2]
    behind = backdrop(sky, camera, (width, height))
    if "image" in outputs:
        outputs["image"] = over(outputs["image"], behind)
    if "linear" in outputs:
        light = outputs["linear"]
        outputs["linear"] = (light[..., :3] + (1.0 - light[..., 3:]) * behind).astype(np.float32)
