"""Points and lines of files and of other libraries' objects, as nodes' meshes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from glshadow.core.spaces import Array
from glshadow.errors import SceneError
from glshadow.io.imported import WHITE, tinted
from glshadow.scene.capsules import Lines, Points
from glshadow.scene.mesh import Material


def points_of(
    positions: ArrayLike,
    colors: Array | None,
    name: str,
    notes: list[str],
    material: Material = WHITE,
    radius: float | None = None,
) -> Points | None:
    """Points at these positions with linear colours (V, 4); None if there are none. Left out with a note: those that are not finite, and
    all if they coincide and have no radius."""
    places = np.asarray(positions, dtype=np.float64).reshape(-1, 3)
    finite = _finite(places)
    if not finite.all():
        notes.append(
            f"{name}: {int((~finite).sum())} of {len(finite)} points are not finite (NaN or infinite): left out"
        )
        places, colors = places[finite], None if colors is None else colors[finite]
    if len(places) == 0:
        return None
    material, tints = tinted(opaque(material), colors)
    try:
        return Points(places, radius, tints, material)
    except SceneError as error:
        notes.append(f"{name}: left out: {error}")
        return None


def lines_of(
    positions: ArrayLike,
    segments: ArrayLike,
    colors: Array | None,
    name: str,
    notes: list[str],
    material: Material = WHITE,
    radius: float | None = None,
) -> Lines | None:
    """Line segments (S, 2) with linear colours (V, 4) of their vertices; None if there are none. Left out with a note: those
    whose ends are not there or not finite, and all if they coincide and have no radius."""
    places = np.asarray(positions, dtype=np.float64).reshape(-1, 3)
    pairs = existing(np.asarray(segments, dtype=np.int64).reshape(-1, 2), len(places), f"{name}: ", "lines", notes)
    if len(pairs) == 0:
        return None
    used, inverse = np.unique(pairs, return_inverse=True)
    places, pairs = places[used], inverse.reshape(-1, 2)
    colors = None if colors is None else colors[used]
    finite = _finite(places)
    if not finite.all():
        kept = finite[pairs[:, 0]] & finite[pairs[:, 1]]
        notes.append(f"{name}: {int((~kept).sum())} of {len(kept)} lines have ends that are not finite: left out")
        return lines_of(places, pairs[kept], colors, name, notes, material, radius)
    material, tints = tinted(opaque(material), colors)
    try:
        return Lines(places, pairs, radius, tints, material)
    except SceneError as error:
        notes.append(f"{name}: left out: {error}")
        return None


def existing(indices: NDArray[np.int64], count: int, where: str, what: str, notes: list[str]) -> NDArray[np.int64]:
    """The rows (N, K) whose indices are those of `count` vertices; a note, which begins with `where`, says how many others there are."""
    if indices.size == 0:
        return indices
    low, high = int(indices.min()), int(indices.max())
    if low >= 0 and high < count:
        return indices
    kept = np.asarray(((indices >= 0) & (indices < count)).all(axis=1))
    notes.append(
        f"{where}{int((~kept).sum())} of {len(kept)} {what} left out: one refers to vertex {high if high >= count else low}, "
        f"but there are {count}, counted from 0"
    )
    return indices[kept]


def _finite(places: Array) -> NDArray[np.bool_]:
    return np.isfinite(places[:, 0]) & np.isfinite(places[:, 1]) & np.isfinite(places[:, 2])


def opaque(material: Material) -> Material:
    """Its colour alone: points and lines have no texture and are not transparent."""
    return Material(color=(*material.color[:3], 1.0))


def chained(counts: NDArray[np.int64]) -> NDArray[np.int64]:
    """Segments (S, 2) of polylines that follow each other, given the number of vertices of each."""
    number = np.arange(int(counts.sum()))
    last = np.zeros(len(number), dtype=bool)
    last[np.cumsum(counts)[counts > 0] - 1] = True
    start = number[~last]
    return np.stack([start, start + 1], axis=1)


def linked(indices: NDArray[np.int64], mode: int) -> NDArray[np.int64]:
    """Segments (S, 2) of indices as OpenGL and glTF link them: 1 pairs, 2 a closed line, 3 a line."""
    if mode == 1:
        return indices[: len(indices) // 2 * 2].reshape(-1, 2)
    following = np.roll(indices, -1)
    segments = np.stack([indices, following], axis=1)
    return segments if mode == 2 and len(indices) > 2 else segments[:-1]


@dataclass
class Loose:
    """Vertices of a file that it draws as points or lines, with one material.

    Parameters
    ----------
    points : (P,) ints
    segments : (S, 2) ints
    """

    points: Sequence[int] | NDArray[np.int64] = ()
    segments: Sequence[tuple[int, int]] | NDArray[np.int64] = ()
    material: Material = WHITE
