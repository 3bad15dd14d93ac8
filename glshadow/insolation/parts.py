"""Divides triangles until no edge is longer than a given length; sample points on the parts."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from glshadow.core.spaces import Array
from glshadow.errors import SettingsError

MOST_PARTS = 5_000_000


def divided(corners: Array, longest: float) -> tuple[Array, NDArray[np.int64]]:
    """Parts of triangles whose edges are at most `longest`.

    An edge is halved if it is longer, whatever its triangle: neighbours are divided alike, and parts meet along whole edges.

    Parameters
    ----------
    corners : (F, 3, 3) float64
    longest : float

    Returns
    -------
    (N, 3, 3) float64, (N,) int64
        Corners of the parts, and the triangles that they are of, ascending.

    Raises
    ------
    SettingsError
        If there would be more than five million parts.
    """
    own = np.arange(len(corners))
    areas = 0.5 * np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    if float(areas.sum()) / longest**2 > MOST_PARTS:
        raise SettingsError(
            f"cell {longest:g} would divide {float(areas.sum()):.4g} square units into more than {MOST_PARTS:,} parts: take a larger cell"
        )
    done: list[tuple[Array, NDArray[np.int64]]] = []
    while len(corners):
        long = np.linalg.norm(corners[:, [1, 2, 0]] - corners, axis=2) > longest
        count = long.sum(axis=1)
        done.append((corners[count == 0], own[count == 0]))
        if sum(len(each) for _, each in done) + len(corners) > MOST_PARTS:
            raise SettingsError(f"cell {longest:g} makes more than {MOST_PARTS:,} parts: take a larger cell")
        corners, own = _halved(corners, own, long, count)
    order = np.argsort(np.concatenate([each for _, each in done]), kind="stable")
    return np.concatenate([each for each, _ in done])[order], np.concatenate([each for _, each in done])[order]


def _halved(
    corners: Array, own: NDArray[np.int64], long: NDArray[np.bool_], count: NDArray[np.int64]
) -> tuple[Array, NDArray[np.int64]]:
    """Triangles with one, two or three long edges, divided at the middles of these."""
    parts, owners = [], []
    for edges in (1, 2, 3):
        rows = np.flatnonzero(count == edges)
        if len(rows) == 0:
            continue
        # turned so that the long edges come first: ab; ab and bc; all
        first = long[rows].argmax(axis=1) if edges == 1 else (np.argmin(long[rows], axis=1) + 1) % 3
        turn = (np.zeros(len(rows), dtype=np.int64) if edges == 3 else first)[:, None] + np.arange(3)
        a, b, c = np.take_along_axis(corners[rows], (turn % 3)[..., None], axis=1).transpose(1, 0, 2)
        p, q, r = 0.5 * (a + b), 0.5 * (b + c), 0.5 * (c + a)
        made = {
            1: ((a, p, c), (p, b, c)),
            2: ((p, b, q), (a, p, q), (a, q, c)),
            3: ((a, p, r), (p, b, q), (r, q, c), (p, q, r)),
        }[edges]
        parts += [np.stack(each, axis=1) for each in made]
        owners += [own[rows]] * len(made)
    if not parts:
        return corners[:0], own[:0]
    return np.concatenate(parts), np.concatenate(owners)


def spread(corners: Array, count: int, seed: int) -> Array:
    """Sample points (N count, 3) on triangles (N, 3, 3), those of one after another: the R2 sequence, shifted for each triangle.

    References
    ----------
    Roberts 2018, "The unreasonable effectiveness of quasirandom sequences".
    """
    shift = np.random.default_rng(seed).random((len(corners), 1, 2))
    steps = np.array([0.7548776662466927, 0.5698402909980532])  # 1 / g and 1 / g^2 of the root g of x^3 = x + 1
    at = (shift + np.arange(count)[:, None] * steps) % 1.0
    at = np.where(at.sum(axis=-1, keepdims=True) > 1.0, 1.0 - at, at)
    a, b, c = (corners[:, None, k] for k in range(3))
    return np.asarray(a + at[..., :1] * (b - a) + at[..., 1:] * (c - a)).reshape(-1, 3)
