"""Colours of texels of alpha 0, which filters and mip levels blend into visible edges: those of the texels around them."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray


def extended(pixels: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Pixels (H, W, 4) in which texels of alpha 0 have the mean colour of near ones of a higher alpha; the same array if none are so.

    The means are those of blocks of 2, 4, 8, ... texels (push and pull): the smallest that holds such a texel.
    """
    seen = pixels[..., 3] > 0
    if seen.all() or not seen.any():
        return pixels
    result = pixels.copy()
    counts, sums = (
        _halved(seen.astype(np.float32)),
        _halved(np.where(seen[..., None], pixels[..., :3], np.float32(0.0))),
    )
    result[~seen, :3] = np.rint(_doubled(_filled(sums, counts), seen.shape)[~seen])
    return result


def _filled(sums: NDArray[Any], counts: NDArray[Any]) -> NDArray[Any]:
    """Mean colours (H, W, 3) of blocks with sums (H, W, 3) over counts (H, W); empty ones from the blocks that contain them."""
    empty = counts == 0.0
    means: NDArray[Any] = sums / np.maximum(counts, 1.0)[..., None]
    if empty.any():
        means[empty] = _doubled(_filled(_halved(sums), _halved(counts)), counts.shape)[empty]
    return means


def _halved(values: NDArray[Any]) -> NDArray[Any]:
    """Sums of blocks of 2 x 2; beyond the border there is nothing."""
    odd = [(0, side % 2) for side in values.shape[:2]] + [(0, 0)] * (values.ndim - 2)
    values = np.pad(values, odd)
    total: NDArray[Any] = values[0::2, 0::2] + values[0::2, 1::2] + values[1::2, 0::2] + values[1::2, 1::2]
    return total


def _doubled(values: NDArray[Any], shape: tuple[int, ...]) -> NDArray[Any]:
    return values.repeat(2, axis=0).repeat(2, axis=1)[: shape[0], : shape[1]]
