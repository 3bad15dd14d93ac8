"""Sums over windows of an image: errors that do not cancel between neighbours."""

from __future__ import annotations

import numpy as np

from glshadow.core.spaces import Array

WINDOW = 8  # pixels along a side; part of the definition of error, not tunable


def window_sums(values: Array) -> Array:
    """Sums of values (H, W) over windows of 8 x 8 pixels, from the first row and column; the remainder at the borders is one."""
    rows, columns = (np.arange(0, size, WINDOW) for size in values.shape)
    return np.asarray(np.add.reduceat(np.add.reduceat(values, rows, axis=0), columns, axis=1))
