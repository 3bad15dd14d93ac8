"""Why a framed model is a speck: vertices far from all others, or a shape too thin; and a camera that shows what there is."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from glshadow.core.cameras import PerspectiveCamera
from glshadow.core.spaces import Array
from glshadow.scene.framing import outline

if TYPE_CHECKING:
    from glshadow.scene.nodes import Scene

APART = 4.0
"""Vertices are far from the others if there is none between a distance from the middle and this many times as much."""
THIN = 300.0
"""A needle's length over its thickness, at least: less than two pixels of an image of 640."""
_SHOWN = 20.0  # thicknesses of a needle that its camera shows


class Cause(NamedTuple):
    """Why a model is a speck: a sentence, and a camera that shows the rest of it, or a part."""

    what: str
    camera: PerspectiveCamera


def speck_cause(scene: Scene) -> Cause | None:
    """Why a model that its default camera frames fills almost nothing of the image; None: not for what is looked for here.

    Far vertices are looked for by their distance from the median of all vertices, and, of whole nodes, along the longest axis of their
    bounds: beyond the widest gap, relative to what is before it, are at most half.
    """
    drawn = [(scene.nodes[i], corners[None]) for i, corners in zip(scene.drawn.tolist(), scene.corners, strict=True)]
    drawn = [each for each in drawn if not each[0].ground] or drawn
    model, parts = [node for node, _ in drawn], [outline([node], corners) for node, corners in drawn]
    points = np.concatenate(parts)
    owner = np.repeat(np.arange(len(parts)), [len(part) for part in parts])
    from_median = np.linalg.norm(points - np.median(points, axis=0), axis=1)
    along = points[:, np.argmax(np.ptp(points, axis=0))]
    order = np.argsort(along, kind="stable")
    largest = int(np.argmax(np.diff(along[order]))) + 1 if len(points) > 1 else 0
    from_end = along - along.min() if 2 * largest >= len(points) else along.max() - along
    for distances in (from_median, from_end):
        near = _before_gap(distances)
        size = float(np.linalg.norm(np.ptp(points[near], axis=0)))
        if near.all() or size == 0.0 or (distances is from_end and np.isin(owner[near], owner[~near]).any()):
            continue
        farthest = int(np.argmax(distances))
        name = model[owner[farthest]].name
        count, away = int((~near).sum()), float(np.linalg.norm(points[farthest] - points[near].mean(axis=0)))
        what = (
            f"{count} of its {len(points)} vertices {'is' if count == 1 else 'are'} far from the others: node {name!r} "
            f"reaches {_point(points[farthest])}, {away:.3g} from the middle of the rest, which is {size:.3g} across"
        )
        return Cause(what, scene.defaults.camera(points[near]))
    centred = points - points.mean(axis=0)
    axes = np.linalg.svd(centred.T @ centred)[0]
    length, thickness, _ = np.ptp(centred @ axes, axis=0)
    if length < THIN * thickness or thickness == 0.0:
        return None
    half = 0.5 * _SHOWN * thickness
    place = points[np.argmin(np.abs(centred @ axes[:, 0]))]
    part = place + half * np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) / np.sqrt(3.0)
    return Cause(f"it is {length / thickness:.3g} times as long as it is thick", scene.defaults.camera(part))


def _before_gap(distances: Array) -> NDArray[np.bool_]:
    """Which points, at least half of them, are before the widest gap between distances, if that is wide."""
    order = np.argsort(distances, kind="stable")
    ordered = distances[order]
    first = (len(ordered) - 1) // 2
    near, far = np.maximum(ordered[first:-1], 1e-9 * ordered[-1]), ordered[first + 1 :]
    kept = np.ones(len(ordered), dtype=bool)
    if len(far) and (far / near).max() >= APART:
        kept[order[first + 1 + int(np.argmax(far / near)) :]] = False
    return kept


def _point(point: Array) -> str:
    return "(" + ", ".join(f"{x:.6g}" for x in point) + ")"
