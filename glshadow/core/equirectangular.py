"""Equirectangular images: directions and solid angles of their texels, means, points distributed by weights.

Rows go from the zenith (+y) down to the nadir. The centre column is towards -z, the column to the right of it towards +x.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshadow.core.spaces import Array


def solid_angles(shape: tuple[int, ...]) -> Array:
    """Solid angle (H,) of a texel in each row of an image (H, W)."""
    return np.asarray(-np.diff(np.cos(np.pi * np.arange(shape[0] + 1) / shape[0])) * (2.0 * np.pi / shape[1]))


def moments(shape: tuple[int, ...]) -> tuple[Array, Array]:
    """The integral of the direction over a texel in each row: its part (H,) across the vertical, and along it."""
    down = np.pi * np.arange(shape[0] + 1) / shape[0]
    ring = np.diff(0.5 * (down - np.sin(down) * np.cos(down))) * (2.0 * np.sin(np.pi / shape[1]))
    return ring, np.diff(0.5 * np.sin(down) ** 2) * (2.0 * np.pi / shape[1])


def vectors(up: Any, across: Any, angle: Any) -> Array:
    """Vectors (..., 3) from their height, their distance from the vertical and their angle from -z towards +x."""
    return np.stack(np.broadcast_arrays(across * np.sin(angle), up, -across * np.cos(angle)), axis=-1)


def directions_within(row: Any, down: Any, column: Any, across: Any, height: int, width: int) -> Array:
    """Directions (N, 3) at places from 0 to 1 in texels of an image of this size, down by solid angle."""
    upper, lower = np.cos(np.pi * np.asarray(row) / height), np.cos(np.pi * (np.asarray(row) + 1.0) / height)
    cosine = upper + down * (lower - upper)
    angle = 2.0 * np.pi * (column + across) / width - np.pi
    return vectors(cosine, np.sqrt(np.maximum(1.0 - cosine * cosine, 0.0)), angle)


def reduced(image: Array, rows: int, columns: int) -> Array:
    """An image (H, W, 3) with at most so many rows and columns: each texel is the mean over its solid angle."""
    return fewer_rows(fewer_columns(image, columns), rows)


def fewer_columns(image: NDArray[Any], columns: int) -> Array:
    """An image (H, W, 3) with at most so many columns, by means."""
    width = image.shape[1]
    if width <= columns:
        return image
    edges = np.arange(columns + 1) * (width / columns)
    whole = np.minimum(edges.astype(int), width - 1)
    sums = np.zeros((len(image), width + 1, image.shape[2]))
    np.cumsum(image, axis=1, dtype=np.float64, out=sums[:, 1:])
    at = sums[:, whole] + image[:, whole] * (edges - whole)[:, None]
    return np.asarray(np.maximum(np.diff(at, axis=1), 0.0) * (columns / width))


def fewer_rows(image: Array, rows: int) -> Array:
    """An image (H, W, 3) with at most so many rows, by means over solid angle."""
    height = len(image)
    if height <= rows:
        return image
    cosine = np.cos(np.pi * np.arange(height + 1) / height)
    sums = np.zeros((height + 1, *image.shape[1:]))
    np.cumsum(image * -np.diff(cosine)[:, None, None], axis=0, out=sums[1:])
    edges = np.arange(rows + 1) * (height / rows)
    whole = np.minimum(edges.astype(int), height - 1)
    borders = np.cos(np.pi * edges / height)
    at = sums[whole] + image[whole] * (cosine[whole] - borders)[:, None, None]
    return np.asarray(np.maximum(np.diff(at, axis=0), 0.0) / -np.diff(borders)[:, None, None])


class Inversion:
    """Points of an image distributed by weights (R, C): rows by the sum of their weights, columns by the weights within the row."""

    def __init__(self, weights: Array) -> None:
        self._shape = weights.shape
        self._rows = np.concatenate([[0.0], np.cumsum(weights.sum(axis=1))])
        within = np.zeros((weights.shape[0], weights.shape[1] + 1))
        np.cumsum(weights, axis=1, out=within[:, 1:])
        self._columns = within / np.where(within[:, -1:] > 0.0, within[:, -1:], 1.0)
        # all rows in one ascending sequence, for one search
        self._flat = (self._columns[:, 1:] + np.arange(len(weights))[:, None]).ravel()

    def at(self, u: Array, v: Array) -> tuple[NDArray[np.int64], Array, NDArray[np.int64], Array]:
        """Row, place from 0 to 1 in it, column, place in it, of points (N,) of the unit square."""
        row, along = _found(self._rows, u * self._rows[-1])
        index = np.searchsorted(self._flat, row + v, side="right")
        column = np.clip(index - row * self._shape[1], 0, self._shape[1] - 1)
        low, high = self._columns[row, column], self._columns[row, column + 1]
        return row, along, column, np.clip((v - low) / np.where(high > low, high - low, 1.0), 0.0, 1.0)


def _found(sums: Array, target: Array) -> tuple[NDArray[np.int64], Array]:
    """Interval of ascending sums that holds each target, of positive length, and the place in it."""
    last = int(np.flatnonzero(np.diff(sums) > 0.0)[-1])
    index = np.minimum(np.searchsorted(sums, target, side="right") - 1, last)
    length = sums[index + 1] - sums[index]
    return index, np.clip((target - sums[index]) / np.where(length > 0.0, length, 1.0), 0.0, 1.0)
