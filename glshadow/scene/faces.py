"""Faces of a scene: their corners in the world by scene-wide number, and stratified sample points on them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from glshadow.core.setting import refuse, whole
from glshadow.core.spaces import Array, world_positions
from glshadow.scene.nodes import Scene

_PER_FACE = whole(1, 1 << 16)
_SEED = whole(0, (1 << 63) - 1)
# A triangle's four parts, the middle one first: barycentric coordinates b of a part are offset + scale * b of the whole.
_OFFSETS = 0.5 * np.array([[1.0, 1.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
_SCALES = np.array([-0.5, 0.5, 0.5, 0.5])


class FaceSamples(NamedTuple):
    """Points on faces, those of one face after another.

    Attributes
    ----------
    points : (N, 3) float64
        World positions.
    triangles : (N,) int64
        Scene-wide number of each point's triangle, as in `Frame.triangle`.
    areas : (N,) float64
        Area that each point stands for: that of its triangle, divided by the number of points on it; square world units.
    """

    points: Array
    triangles: NDArray[np.int64]
    areas: Array


def face_starts(scene: Scene) -> NDArray[np.int64]:
    """(nodes + 1,) scene-wide number of each node's first element (triangle, point or line), and their count at the end."""
    return np.cumsum([0, *(node.mesh.count for node in scene.nodes)])


def faces_of(scene: Scene) -> NDArray[np.int64]:
    """(F,) scene-wide numbers of the triangles that are drawn; points and lines have no faces."""
    starts = face_starts(scene)
    drawn = [i for i in scene.drawn.tolist() if len(scene.nodes[i].mesh.triangles)]
    return np.concatenate([np.zeros(0, dtype=np.int64), *(np.arange(starts[i], starts[i + 1]) for i in drawn)])


def face_corners(scene: Scene, triangles: NDArray[np.integer]) -> Array:
    """World corners (N, 3, 3), float64, of triangles (N,) by scene-wide number; NaN for a point or a line."""
    starts = face_starts(scene)
    owners = np.searchsorted(starts, triangles, side="right") - 1
    corners = np.full((len(triangles), 3, 3), np.nan)
    order = np.argsort(owners, kind="stable")
    borders = np.searchsorted(owners[order], np.arange(len(scene.nodes) + 1))
    for number in np.unique(owners).tolist():
        node, rows = scene.nodes[number], order[borders[number] : borders[number + 1]]
        if len(node.mesh.triangles) == 0:
            continue
        vertices, where = np.unique(node.mesh.triangles[triangles[rows] - starts[number]], return_inverse=True)
        placed = world_positions(node.mesh.positions[vertices], node.world_from_mesh, np.zeros(3))
        corners[rows] = placed[where.reshape(-1, 3)]
    return corners


def fronts(scene: Scene, triangles: NDArray[np.integer]) -> Array:
    """Unit world normals (N, 3) of the front of triangles (N,) by scene-wide number: counter-clockwise, in a mirrored node clockwise; zero
    for a triangle without area, NaN for a point or a line."""
    corners = face_corners(scene, triangles)
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    mirrored = np.array([np.linalg.det(node.world_from_mesh[:3, :3]) < 0.0 for node in scene.nodes])
    owners = np.searchsorted(face_starts(scene), triangles, side="right") - 1
    normals *= np.where(mirrored[owners], -1.0, 1.0)[:, None]
    size = np.abs(normals).max(axis=1, keepdims=True)  # squares of tiny ones would be zero
    normals /= np.where(size > 0.0, size, 1.0)
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    return np.asarray(normals / np.where(length > 0.0, length, 1.0))


def sample_faces(scene: Scene, per_face: int, seed: int = 0, faces: ArrayLike | None = None) -> FaceSamples:
    """Stratified random points on a scene's faces, the same for the same arguments.

    Each triangle is divided into four by the middles of its edges, again and again, and the points are spread evenly over the parts:
    of `per_face` = 4^k points one is in each part of the k-th division, at a random place in it. The points of a face do not depend on
    which other faces are sampled. Of a mean over n = 4^k points of a quantity that is 0 on one side of a straight edge and 1 on the other,
    the standard deviation is at most 0.71 n^(-3/4), because the edge cuts at most 2 sqrt(n) parts: 0.09 for 16 points, 0.03 for 64. Without
    an edge it is exact.

    Parameters
    ----------
    scene : Scene
    per_face : int
        Number n of points on each face.
    seed : int
        Changes the points.
    faces : (F,) ints, optional
        Scene-wide numbers of the triangles to sample. None: all that are drawn, in order.

    Returns
    -------
    FaceSamples
        `per_face` points for each face, in the order of the faces. Triangles without area have points of area 0.

    Raises
    ------
    SettingsError
        If the number of points, the seed or a face is out of range, or a face is a point or a line.

    References
    ----------
    Basu, Owen 2015, "Low discrepancy constructions in the triangle", SIAM Journal on Numerical Analysis 53(2), section 3.
    """
    count = _PER_FACE("per_face", per_face)
    chosen = faces_of(scene) if faces is None else _checked(scene, faces)
    corners = face_corners(scene, chosen)
    weights = _barycentric(chosen, count, _SEED("seed", seed))
    a, b, c = (corners[:, None, k] for k in range(3))
    # from the first corner, so that rounding is that of the triangle's size and not of its place
    points = a + (weights[..., 1:2] * (b - a) + weights[..., 2:3] * (c - a))
    area = 0.5 * np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    return FaceSamples(points.reshape(-1, 3), np.repeat(chosen, count), np.repeat(area / count, count))


def _checked(scene: Scene, faces: ArrayLike) -> NDArray[np.int64]:
    chosen, starts = np.asarray(faces), face_starts(scene)
    if chosen.dtype.kind not in "iu" or chosen.ndim != 1:
        raise refuse("faces", "an array (F,) of integers, numbers of triangles", faces)
    if len(chosen) and not (chosen.min() >= 0 and chosen.max() < starts[-1]):
        raise refuse("faces", f"numbers of the scene's {starts[-1]} triangles, from 0", faces)
    flat = np.array([len(node.mesh.triangles) > 0 for node in scene.nodes])
    if not flat[np.searchsorted(starts, chosen, side="right") - 1].all():
        raise refuse("faces", "numbers of triangles, not of points or lines, which have no faces", faces)
    return chosen.astype(np.int64)


def _barycentric(triangles: NDArray[np.int64], count: int, seed: int) -> Array:
    """Barycentric coordinates (F, count, 3) of the points."""
    number = np.arange(count)
    keys = _mixed(triangles.astype(np.uint64) ^ _mixed(np.array([seed], dtype=np.uint64)))
    offset, scale = np.zeros((len(triangles), count, 3)), np.ones((len(triangles), count, 1))
    level = 0
    while 4**level < count:
        turn = (_mixed(keys + np.uint64(level + 1)) >> np.uint64(62)).astype(np.int64)
        digit = (number // 4**level % 4) ^ turn[:, None]
        offset += scale * _OFFSETS[digit]
        scale *= _SCALES[digit][..., None]
        level += 1
    draws = _mixed(_mixed(keys + np.uint64(1 << 32))[:, None] + np.arange(2 * count).astype(np.uint64))
    u, v = ((draws >> np.uint64(11)).astype(np.float64) * 2.0**-53).reshape(-1, count, 2).transpose(2, 0, 1)
    u, v = np.where(u + v > 1.0, 1.0 - u, u), np.where(u + v > 1.0, 1.0 - v, v)
    return np.asarray(offset + scale * np.stack([1.0 - u - v, u, v], axis=-1))


def _mixed(numbers: NDArray[np.uint64]) -> NDArray[np.uint64]:
    """Hashes of 64 bits: the finalizer of SplitMix64 (Steele, Lea, Flood 2014, "Fast splittable pseudorandom number generators")."""
    with np.errstate(over="ignore"):
        mixed = numbers + np.uint64(0x9E3779B97F4A7C15)
        mixed = (mixed ^ (mixed >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
        mixed = (mixed ^ (mixed >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
        return np.asarray(mixed ^ (mixed >> np.uint64(31)))
