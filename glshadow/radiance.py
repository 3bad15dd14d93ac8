"""Reads images as linear radiance, float32; a large one is reduced while it is read."""

from __future__ import annotations

import os
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshadow.core.equirectangular import fewer_columns
from glshadow.core.spaces import Array
from glshadow.core.srgb import linear_from_srgb
from glshadow.errors import SceneError
from glshadow.image import opened
from glshadow.lights.environment_map import MOST_COLUMNS

WIDEST, HIGHEST = 32768, 16384
_TOGETHER = 1 << 22  # values read at once


def read_radiance(source: str | os.PathLike[str]) -> NDArray[np.float32]:
    """An image file as linear radiance.

    Parameters
    ----------
    source : path
        Any format of OpenImageIO. Floating-point files (.hdr, .exr) are linear; integers are read as sRGB. Alpha is not used.

    Returns
    -------
    (H, W, 3) float32
        Row 0 at the top; at most 1024 columns, by means.

    Raises
    ------
    SceneError
        If it is not a readable image, or larger than 32768 x 16384.
    SettingsError
        If it is not a path.
    """
    with opened(source) as (reader, name):
        spec = reader.spec()
        if spec.width > WIDEST or spec.height > HIGHEST or spec.depth > 1:
            raise SceneError(
                f"{name}: {spec.width} x {spec.height} x {spec.depth} pixels; at most {WIDEST} x {HIGHEST} x 1 are read"
            )
        encoded = str(spec.format) in ("uint8", "uint16")
        rows = [_fewer(_linear(part, encoded)) for part in _parts(reader, spec, name)]
    return np.concatenate(rows)


def _parts(reader: Any, spec: Any, name: str) -> Any:
    """The file's rows from the top, some at a time: (N, W, channels) float32."""
    channels = min(spec.nchannels, 3)
    step = spec.tile_height or max(_TOGETHER // (spec.width * channels), 1)
    for first in range(spec.y, spec.y + spec.height, step):
        end = min(first + step, spec.y + spec.height)
        if spec.tile_height:
            right = spec.x + spec.width
            part = reader.read_tiles(spec.x, right, first, end, 0, 1, 0, channels, "float")
        else:
            part = reader.read_scanlines(first, end, 0, 0, channels, "float")
        if part is None:
            raise SceneError(f"{name} cannot be read as an image: {reader.geterror().strip()}")
        yield np.asarray(part, dtype=np.float32).reshape(end - first, spec.width, channels)


def _linear(pixels: NDArray[np.float32], encoded: bool) -> Array:
    wide = linear_from_srgb(pixels) if encoded else pixels.astype(np.float64)
    return np.repeat(wide[..., :1], 3, axis=2) if wide.shape[2] < 3 else wide


def _fewer(rows: Array) -> NDArray[np.float32]:
    with np.errstate(all="ignore"):  # infinite and NaN texels are refused by the map
        reduced = fewer_columns(rows, MOST_COLUMNS)
        return (
            np.where(np.isfinite(rows).all(), reduced, np.nan).astype(np.float32)
            if reduced is not rows
            else rows.astype(np.float32)
        )
