"""A filter's float64 twin evaluated on an image of comparison results."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from glshadow.core.spaces import Array
from glshadow.shadows.filters import Filter


def seen(kind: Filter, lit: ArrayLike, positions: ArrayLike) -> Array:
    """Visibility (N,) at positions (N, 2) in texels; `lit` (H, W): the result at each texel, clamped to the edge outside."""
    image = np.asarray(lit, dtype=np.float64)

    def compare(texel: np.ndarray, place: np.ndarray) -> Array:
        x, y = (np.clip(texel[:, k], 0, image.shape[1 - k] - 1) for k in (0, 1))
        return image[y, x][None]

    return kind.visibility(np.asarray(positions, dtype=np.float64), compare)[0]


def vertical_edge(width: int = 40, edge: int = 20, height: int = 24) -> Array:
    """Lit from column `edge` on: the exact edge is at x = edge texels."""
    return np.broadcast_to((np.arange(width) >= edge).astype(np.float64), (height, width))


def along_x(x: Array, y: float = 12.0) -> Array:
    return np.stack([x, np.full_like(x, y)], axis=-1)
