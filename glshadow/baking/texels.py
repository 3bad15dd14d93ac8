"""Texels of a set of texture coordinates: which triangle covers the centre of each, where on it, and values across seams."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from glshadow.core.spaces import Array

_TOGETHER = 1 << 22  # candidates: texels of the boxes around triangles
_INSIDE = 1e-9  # barycentric: nearer to an edge two triangles may share the texel


@dataclass(frozen=True, eq=False)
class Texels:
    """The covered texels of an image, row 0 at the top (v = 1).

    Attributes
    ----------
    places : (N,) int64
        Row * width + column.
    triangles : (N,) int64
        Index of the mesh's triangle; of several the first.
    weights : (N, 3) float64
        Barycentric coordinates of the texel's centre.
    shared : int
        Texels that lie inside several triangles.
    """

    places: NDArray[np.int64]
    triangles: NDArray[np.int64]
    weights: Array
    shared: int


def covered(uv: Array, triangles: NDArray[np.integer], size: tuple[int, int]) -> Texels:
    """The texels whose centres triangles cover.

    Parameters
    ----------
    uv : (V, 2) float64
        Texture coordinates, v up. Beyond 0 to 1 the image repeats.
    triangles : (T, 3) ints
    size : (2,) ints
        Width and height.
    """
    width, height = size
    corners = np.asarray(uv, dtype=np.float64)[triangles] * (width, -height) + (0.0, height)
    owner = np.full(width * height, -1, dtype=np.int64)
    weights, shared = np.zeros((width * height, 3)), np.zeros(width * height, dtype=bool)
    for number, column, row in _candidates(corners):
        a, b, c = corners[number].transpose(1, 0, 2)
        place = np.stack([column, row], axis=1).astype(np.float64) + 0.5
        area = _turn(a, b, c)
        solid = area != 0.0
        second, third = (turn / np.where(solid, area, 1.0) for turn in (_turn(a, place, c), _turn(a, b, place)))
        found = np.stack([1.0 - second - third, second, third], axis=1)
        least = found.min(axis=1)
        inside = solid & (least >= 0.0)
        texel = row % height * width + column % width
        taken, claimed = texel[inside & (least > _INSIDE)], number[inside & (least > _INSIDE)]
        shared[taken[(owner[taken] >= 0) & (owner[taken] != claimed)]] = True
        rows = np.flatnonzero(inside)
        texel, first = np.unique(texel[rows], return_index=True)
        rows, free = rows[first], owner[texel] < 0
        owner[texel[free]], weights[texel[free]] = number[rows[free]], found[rows[free]]
        also = owner[taken] != claimed  # within this batch
        shared[taken[also]] = True
    places = np.flatnonzero(owner >= 0)
    return Texels(places, owner[places], weights[places], int(shared.sum()))


def _turn(a: Array, b: Array, c: Array) -> Array:
    """Twice the signed areas (N,) of triangles."""
    p, q = b - a, c - a
    return np.asarray(p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0])


def _candidates(corners: Array) -> Iterator[tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]]:
    """Triangle, column and row of the texels in the boxes around triangles, batch after batch."""
    low = np.ceil(corners.min(axis=1) - 0.5).astype(np.int64)
    count = np.maximum(np.floor(corners.max(axis=1) - 0.5).astype(np.int64) - low + 1, 0)
    total = count.prod(axis=1)
    border = np.flatnonzero(np.diff(np.cumsum(total) // _TOGETHER)) + 1
    for batch in np.split(np.arange(len(corners)), border):
        number = np.repeat(batch, total[batch])
        within = np.arange(len(number)) - np.repeat(np.cumsum(total[batch]) - total[batch], total[batch])
        across = np.maximum(count[number, 0], 1)
        yield number, low[number, 0] + within % across, low[number, 1] + within // across


def padded(values: NDArray[np.float32], texels: int) -> NDArray[np.float32]:
    """Images (L, H, W) whose NaN texels take the mean of their neighbours, ring after ring, so that filtering finds no border."""
    values = values.copy()
    for _ in range(texels):
        known = np.isfinite(values)
        if known.all():
            break
        filled = np.where(known, values, np.float32(0.0))
        total, count = np.zeros_like(values), np.zeros(values.shape, dtype=np.float32)
        for down in (-1, 0, 1):
            for right in (-1, 0, 1):
                total += np.roll(filled, (down, right), axis=(1, 2))
                count += np.roll(known, (down, right), axis=(1, 2))
        fill = ~known & (count > 0.0)
        values[fill] = total[fill] / count[fill]
    return values
