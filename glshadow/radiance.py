"""Reads image files as linear radiance, some rows at a time."""

from __future__ import annotations

import os
from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshadow.core.srgb import linear_from_srgb
from glshadow.errors import SceneError
from glshadow.image import LARGEST_IMAGE, opened

WIDEST, HIGHEST = 32768, 16384
_MOST_TOGETHER = 1 << 26  # values of one row of tiles
_TOGETHER = 1 << 22  # values read at once


def rows_of_file(source: str | os.PathLike[str]) -> Iterator[NDArray[np.float32]]:
    """The rows of an image file as linear radiance, from the top.

    Parameters
    ----------
    source : path
        Any format of OpenImageIO. Floating-point files (.hdr, .exr) are linear; integers are read as sRGB. Alpha is not used.

    Yields
    ------
    (N, W, 3) float32

    Raises
    ------
    SceneError
        If it is not a readable image, or larger than 2^28 pixels, 32768 x 16384.
    SettingsError
        If it is not a path.
    """
    with opened(source) as (reader, name):
        spec = reader.spec()
        if spec.width > WIDEST or spec.height > HIGHEST or spec.width * spec.height > LARGEST_IMAGE or spec.depth > 1:
            raise SceneError(
                f"{name}: {spec.width} x {spec.height} x {spec.depth} pixels; at most {LARGEST_IMAGE}, {WIDEST} x {HIGHEST} x 1, are read"
            )
        encoded = str(spec.format) in ("uint8", "uint16")
        channels = 3 if spec.nchannels >= 3 else 1
        step = spec.tile_height or max(_TOGETHER // (spec.width * channels), 1)
        if step * spec.width * channels > _MOST_TOGETHER:
            raise SceneError(f"{name}: tiles of {spec.tile_width} x {spec.tile_height} pixels are too large")
        for first in range(spec.y, spec.y + spec.height, step):
            end = min(first + step, spec.y + spec.height)
            if spec.tile_height:
                part = reader.read_tiles(spec.x, spec.x + spec.width, first, end, 0, 1, 0, channels, "float")
            else:
                part = reader.read_scanlines(first, end, 0, 0, channels, "float")
            if part is None:
                raise SceneError(f"{name} cannot be read as an image: {reader.geterror().strip()}")
            pixels = np.asarray(part, dtype=np.float32).reshape(end - first, spec.width, channels)
            yield _linear(pixels, encoded)


def _linear(pixels: NDArray[Any], encoded: bool) -> NDArray[np.float32]:
    linear = linear_from_srgb(pixels).astype(np.float32) if encoded else pixels
    return np.broadcast_to(linear, (*linear.shape[:2], 3))
