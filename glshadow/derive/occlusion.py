"""Hierarchical-depth occlusion culling: cluster boxes against the farthest depth of blocks of texels."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from glshadow.core.spaces import Array
from glshadow.geometry.frustum import Bools, Extents
from glshadow.shadows.view import ShadowView

BLOCK = 8  # texels along a side of the smallest block
_FINER = 2  # levels below the one at which 2 x 2 blocks cover a cluster
_DEEPER = 0.25
"""Relative margin by which a cluster must lie behind: a triangle seen edge-on may be drawn nearer than its corners, since its depth is
extrapolated to texel centres."""
_FLOAT = 2.0**-18  # relative; exceeds float32's rounding in the division and the interpolation


@dataclass(frozen=True, eq=False)
class Farthest:
    """Depth pyramid: the farthest depth of each block of texels, of 2 x 2 blocks, and so on up to the whole view.

    Attributes
    ----------
    values : (K,) float64
        Level after level; stored depth, negated for reversed depth.
    start, side : (L,) int64
        Start of each level, and its blocks along a side.
    """

    values: Array
    start: NDArray[np.int64]
    side: NDArray[np.int64]


def farthest(depth: NDArray[np.float32], reversed_depth: bool) -> Farthest:
    """The pyramid of a view's depth (R, R), row 0 at the bottom."""
    side = len(depth)
    blocks = np.arange(0, side, BLOCK)
    reduce = np.minimum.reduceat if reversed_depth else np.maximum.reduceat
    rows = _rows(depth, reversed_depth) if side % BLOCK == 0 else reduce(depth, blocks, axis=0)
    found = reduce(rows, blocks, axis=1).astype(np.float64)
    found = -found if reversed_depth else found
    padded = np.full((1 << (len(blocks) - 1).bit_length(),) * 2, -np.inf)
    padded[: len(blocks), : len(blocks)] = found
    levels = [padded]
    while len(levels[-1]) > 1:
        last = levels[-1]
        pairs = np.maximum(last[::2], last[1::2])
        levels.append(np.maximum(pairs[:, ::2], pairs[:, 1::2]))
    sides = np.array([len(level) for level in levels])
    return Farthest(
        np.concatenate([level.ravel() for level in levels]), np.concatenate([[0], np.cumsum(sides**2)[:-1]]), sides
    )


def _rows(depth: NDArray[np.float32], reversed_depth: bool) -> NDArray[np.float32]:
    """Reduce BLOCK rows at a time; numpy then works on whole rows."""
    grouped = depth.reshape(-1, BLOCK, depth.shape[1])
    return np.asarray(grouped.min(axis=1) if reversed_depth else grouped.max(axis=1))


def behind(view: ShadowView, bounds: Extents, deepest: Farthest, step: float) -> Bools:
    """Which clusters (C,) are wholly behind the drawn depth.

    Parameters
    ----------
    bounds : Extents
        In the view's clip coordinates.
    step : float
        Of the depth format.
    """
    side = view.resolution
    low, high = (bounds.middle + k * (bounds.reach + bounds.slack) for k in (-1.0, 1.0))
    near, far = low[3], high[3]
    nearest, ahead = _nearest(view, bounds, low, high)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        ends = []
        for axis in (0, 1):
            first = low[axis] / np.where(low[axis] > 0.0, far, near)
            last = high[axis] / np.where(high[axis] > 0.0, near, far)
            for end, pad in ((first, -1.0), (last, 1.0)):  # a texel of rounding
                texel = np.clip((0.5 * end + 0.5) * side + pad, 0.0, side - 1.0)
                ends.append((np.nan_to_num(texel) / BLOCK).astype(np.int64))
    x0, x1, y0, y1 = ends
    span = np.maximum(x1 - x0, y1 - y0)
    level = np.maximum(np.ceil(np.log2(np.maximum(span, 1))).astype(np.int64) - _FINER, 0)
    x0, x1, y0, y1 = x0 >> level, x1 >> level, y0 >> level, y1 >> level
    start, width = deepest.start[level], deepest.side[level]
    found = np.full(len(level), -np.inf)
    for j in range(2**_FINER + 1):
        row = start + np.minimum(y0 + j, y1) * width
        for i in range(2**_FINER + 1):
            np.maximum(found, deepest.values[row + np.minimum(x0 + i, x1)], out=found)
    hidden: Bools = ahead & (nearest - step > found)
    return hidden


def _nearest(view: ShadowView, bounds: Extents, low: Array, high: Array) -> tuple[Array, Bools]:
    """Least stored depth of a cluster (C,), negated for reversed depth, and whether the cluster is wholly in front of the eye."""
    clip, projection = view.clip, view.clip_from_view
    if view.projection == "orthographic":
        first, last = (low[2], high[2]) if not clip.reversed else (-high[2], -low[2])
        depth, ahead = first - _DEEPER * (last - first), np.ones(len(first), dtype=bool)
    else:
        w = low[3] - _DEEPER * (high[3] - low[3])
        ahead = w > 0.0
        w = np.where(ahead, w, 1.0)
        depth = clip.sign * (projection[2, 3] / w - projection[2, 2])
        depth -= (bounds.slack[2] + np.abs(depth) * bounds.slack[3]) / w
    if not clip.zero_to_one:
        depth = 0.5 * depth + clip.sign * 0.5
    # casters nearer than the near plane are clamped to it
    depth = np.clip(depth, *((-1.0, 0.0) if clip.reversed else (0.0, 1.0)))
    return depth - _FLOAT * np.abs(depth), ahead
