"""Samples of a pixel: allowed counts and the grid of their positions. An image shows their mean."""

from __future__ import annotations

import math

import numpy as np

from glshadow.core.setting import Rule, one_of, refuse, whole
from glshadow.core.spaces import Array

SAMPLES = (1, 4, 8, 16)
"""Allowed sample counts of an image."""

DEFAULT_SAMPLES = 4
"""Default sample count: smooth edges at about twice the time of one sample."""

IMAGE_SAMPLES: Rule = one_of(*SAMPLES)


def traced(name: str, value: object) -> int:
    """Check the sample count of a traced reference: the counts of an image, and every square number."""
    count: int = whole(1, 1 << 16)(name, value)
    if count not in SAMPLES and math.isqrt(count) ** 2 != count:
        raise refuse(name, f"an integer in [1, {1 << 16}], a square or 8", value)
    return count


def grid(samples: int) -> tuple[int, int]:
    """Columns and rows of the grid: 4 x 2 for 8 samples, otherwise square."""
    side = math.isqrt(samples)
    return (side, side) if side * side == samples else (4, samples // 4)


def offsets(samples: int) -> Array:
    """Positions (samples, 2) from the pixel's lower left corner, right and up, in pixels; row by row from below."""
    columns, rows = grid(samples)
    x, y = np.meshgrid((np.arange(columns) + 0.5) / columns, (np.arange(rows) + 0.5) / rows)
    return np.stack([x, y], axis=-1).reshape(-1, 2)
