"""Samples of a pixel: how many there may be, and the grid in which they lie; an image shows their mean over the pixel."""

from __future__ import annotations

import math

import numpy as np

from glshadow.core.setting import Rule, one_of, refuse, whole
from glshadow.core.spaces import Array

SAMPLES = (1, 4, 8, 16)
"""What an image may have."""

USUAL = 4
"""What it has where nothing is said: smooth edges at about twice the time of one sample."""

PICTURE: Rule = one_of(*SAMPLES)


def traced(name: str, value: object) -> int:
    """The rule of a truth's samples: those of a picture, and every square."""
    count: int = whole(1, 1 << 16)(name, value)
    if count not in SAMPLES and math.isqrt(count) ** 2 != count:
        raise refuse(name, f"an integer in [1, {1 << 16}], a square or 8", value)
    return count


def grid(samples: int) -> tuple[int, int]:
    """Columns and rows: 8 are 4 x 2, squares as many of both."""
    side = math.isqrt(samples)
    return (side, side) if side * side == samples else (4, samples // 4)


def offsets(samples: int) -> Array:
    """Of each sample (samples, 2) from the pixel's lower left corner, right and up, in pixels; row by row from below."""
    columns, rows = grid(samples)
    x, y = np.meshgrid((np.arange(columns) + 0.5) / columns, (np.arange(rows) + 0.5) / rows)
    return np.stack([x, y], axis=-1).reshape(-1, 2)
