"""Where sun is counted: on the faces of a scene, at its vertices, or at given points."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshadow.core.setting import as_floats, refuse
from glshadow.core.spaces import Array, world_positions
from glshadow.errors import SceneError, SettingsError
from glshadow.geometry.welding import welded
from glshadow.insolation.parts import divided, spread
from glshadow.scene.faces import face_corners, face_starts, faces_of, sample_faces
from glshadow.scene.nodes import Scene


@dataclass(frozen=True, eq=False)
class Target:
    """Places whose sun is counted, each with as many sample points.

    Attributes
    ----------
    kind : {"faces", "vertices", "points"}
    points : (P, 3) float64
        World sample points: `per_place` of each place after another.
    normals : (P, 3) float64 or None
        World normals of the sides that receive light; None: from all around.
    triangles : (P,) int64 or None
        Scene-wide numbers of the points' triangles.
    per_place : int
    places : (F, 3) float64
        Middles of the faces, or the given points.
    place_normals : (F, 3) float64 or None
    areas : (F,) float64
        Weights of the places in means: areas of faces, 1 for points.
    shapes : (F, 3, 3) float64 or None
        World corners of the faces or their parts.
    faces : (F,) int64 or None
        Scene-wide numbers of the faces.
    vertices : (V, 3) float64 or None
        World positions of the vertices, node after node, if results are wanted there.
    """

    kind: str
    points: Array
    normals: Array | None
    triangles: NDArray[np.int64] | None
    per_place: int
    places: Array
    place_normals: Array | None
    areas: Array
    shapes: Array | None = None
    faces: NDArray[np.int64] | None = None
    vertices: Array | None = None
    corners: NDArray[np.int64] | None = None  # (F, 3) groups of vertices at one position that each face has
    group: NDArray[np.int64] | None = None  # (V,) group of each vertex

    def vertex_areas(self) -> Array:
        """(V,) a third of the area of the faces around each vertex; vertices at one position share it."""
        assert self.corners is not None
        assert self.group is not None
        around = np.bincount(self.corners.ravel(), np.repeat(self.areas / 3.0, 3), int(self.group.max()) + 1)
        return np.asarray((around / np.bincount(self.group))[self.group])

    def at_vertices(self, values: Array) -> Array:
        """Values (..., F) of faces as means (..., V) over the faces around each vertex, weighted by area; NaN at unused vertices."""
        assert self.corners is not None
        assert self.group is not None
        size = int(self.group.max()) + 1
        weight = np.bincount(self.corners.ravel(), np.repeat(self.areas, 3), size)
        flat = values.reshape(-1, values.shape[-1])
        sums = [np.bincount(self.corners.ravel(), np.repeat(each * self.areas, 3), size) for each in flat]
        with np.errstate(invalid="ignore", divide="ignore"):
            means = np.array(sums) / weight
        return means[:, self.group].reshape(*values.shape[:-1], -1)


def target_of(scene: Scene, to: Any, per_face: int, seed: int, normals: Any, cell: float | None) -> Target:
    """The target that `to` names; faces are divided until no edge is longer than `cell`.

    Raises
    ------
    SettingsError
        If `to` is neither "faces", "vertices" nor points (N, 3), or normals do not belong to it.
    SceneError
        If the scene has no faces.
    """
    if isinstance(to, str):
        if to not in ("faces", "vertices"):
            raise refuse("to", '"faces", "vertices" or an array of world points (N, 3)', to)
        if normals is not None:
            raise SettingsError(f'normals belong to points; to="{to}" has those of the faces')
        if cell is not None and to == "vertices":
            raise SettingsError('cell divides faces: give to="faces", or no cell')
        return _on_faces(scene, to, per_face, seed, cell)
    if cell is not None:
        raise SettingsError('cell divides faces: give to="faces", or no cell')
    points = as_floats(to, (None, 3))
    if points is None or len(points) == 0 or not np.isfinite(points).all():
        raise refuse("to", '"faces", "vertices" or an array of world points (N, 3)', to)
    given = None if normals is None else as_floats(normals, (len(points), 3))
    if normals is not None and (given is None or not np.isfinite(given).all()):
        raise refuse("normals", f"finite, with shape ({len(points)}, 3), one for each point", normals)
    if given is not None:
        length = np.linalg.norm(given, axis=1, keepdims=True)
        if (length == 0.0).any():
            raise SettingsError(f"normals must not be zero, those of {int((length == 0.0).sum())} points are")
        given = given / length
    return Target("points", points, given, None, 1, points, given, np.ones(len(points)))


def _on_faces(scene: Scene, to: str, per_face: int, seed: int, cell: float | None) -> Target:
    faces = faces_of(scene)
    if len(faces) == 0:
        raise SceneError(f"{scene.name} has no faces, only points or lines: give points with to=array (N, 3)")
    samples = sample_faces(scene, per_face, seed, faces)
    points, corners = samples.points, face_corners(scene, faces)
    if cell is not None:
        corners, part_of = divided(corners, cell)
        faces, points = faces[part_of], spread(corners, per_face, seed)
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(normals, axis=1)
    solid = length > 0.0
    normals[solid] /= length[solid, None]
    normals[~solid] = scene.nodes[0].world_from_mesh[:3, 1]
    owner = np.searchsorted(face_starts(scene), faces, side="right") - 1
    mirrored = np.array([np.linalg.det(node.world_from_mesh[:3, :3]) < 0.0 for node in scene.nodes])
    normals[mirrored[owner]] *= -1.0
    middles, areas = corners.mean(axis=1), 0.5 * length
    found = Target(
        to, points, np.repeat(normals, per_face, axis=0), np.repeat(faces, per_face), per_face, middles, normals, areas, corners, faces
    )  # fmt: skip
    return found if to == "faces" else _with_vertices(found, scene, owner)


def _with_vertices(target: Target, scene: Scene, owner: NDArray[np.int64]) -> Target:
    nodes = [node for node in scene.nodes if len(node.mesh.triangles)]
    placed = np.concatenate([world_positions(n.mesh.positions, n.world_from_mesh, np.zeros(3)) for n in nodes])
    counts = [len(node.mesh.positions) if len(node.mesh.triangles) else 0 for node in scene.nodes]
    first = np.cumsum([0, *counts])[:-1]
    starts = face_starts(scene)
    assert target.faces is not None
    corners = np.zeros((len(target.faces), 3), dtype=np.int64)
    for number in np.unique(owner).tolist():
        rows = np.flatnonzero(owner == number)
        corners[rows] = first[number] + scene.nodes[number].mesh.triangles[target.faces[rows] - starts[number]]
    group = welded(placed)
    return Target(
        "vertices", target.points, target.normals, target.triangles, target.per_place, target.places, target.place_normals,
        target.areas, target.shapes, target.faces, placed, group[corners], group,
    )  # fmt: skip
