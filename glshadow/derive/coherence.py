"""An order of points in which neighbours in space follow each other, for passes that walk lists for several points at once."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from glshadow.core.spaces import Array

_CELLS = 32  # along a side: with three axes, keys of 15 bits, which numpy sorts in linear time
_TESTED, _NEAR = 512, 4.0  # pairs, and how many cells apart they may be
_FEW = 1 << 12  # points: not worth the sorting

_SPREAD = np.array([sum(((i >> bit) & 1) << 3 * bit for bit in range(5)) for i in range(_CELLS)], dtype=np.uint16)
"""Bits of a cell's number, three places apart."""


def coherent_order(points: Array) -> NDArray[np.int64] | None:
    """Indices (N,) that sort points (N, 3) along a Morton curve; None if they are few, or most neighbours are close to each other already.

    References
    ----------
    Morton 1966, "A Computer Oriented Geodetic Data Base", IBM.
    """
    if len(points) < _FEW:
        return None
    low, high = points.min(axis=0), points.max(axis=0)
    side = float((high - low).max()) / _CELLS
    if not side > 0.0:
        return None
    first = np.linspace(0, len(points) - 2, _TESTED).astype(np.int64)
    apart = np.abs(points[first + 1] - points[first]).max(axis=1)
    if (apart > _NEAR * side).mean() < 0.25:
        return None
    key = np.zeros(len(points), dtype=np.uint16)
    for axis in range(3):
        cell = ((points[:, axis] - low[axis]) * (1.0 / side)).astype(np.uint8)
        key |= _SPREAD[np.minimum(cell, _CELLS - 1)] << np.uint16(axis)
    return np.argsort(key, kind="stable")
