"""Checks the arguments of functions that compute what given points receive."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from glshadow.arguments import checked_scene
from glshadow.core.setting import as_floats, numbers_in, optional, refuse, whole
from glshadow.core.spaces import FARTHEST, Array
from glshadow.errors import SettingsError
from glshadow.lights import Light, Lights, as_lights
from glshadow.scene.faces import face_starts, fronts
from glshadow.scene.nodes import Scene
from glshadow.shadows.filters import Exact
from glshadow.shadows.shadow import Shadow

LIGHT_SAMPLES, LEAST_SAMPLES = 64, 16
"""Points of a light that has a size, unless its filter has a count, and the fewest of them."""

Progress = Callable[[int, int, str], object]
"""Called as (done, total, text)."""

_SAMPLES = optional(whole(LEAST_SAMPLES, 1024), "that of the light's filter, or 64")


@dataclass(frozen=True, eq=False)
class PointRequest:
    """The checked inputs.

    Parameters
    ----------
    points : (N, 3) float64
    lights : tuple of Light
        Their filters test triangles.
    normals : (N, 3) float64, optional
        Zero where a point has none.
    triangles : (N,) int64, optional
        By scene-wide number, -1 for none; None: to be found.
    """

    scene: Scene
    points: Array
    lights: tuple[Light, ...]
    normals: Array | None
    triangles: NDArray[np.int64] | None
    progress: Progress | None = None

    def part(self, rows: slice | NDArray[np.int64]) -> Self:
        """Some of the points, or all in another order."""
        normals = None if self.normals is None else self.normals[rows]
        triangles = None if self.triangles is None else self.triangles[rows]
        return replace(self, points=self.points[rows], normals=normals, triangles=triangles)

    def __str__(self) -> str:
        return f"scene {self.scene.name}, {len(self.points)} points, lights {list(self.lights)}"


def point_request(
    scene: Scene,
    points: ArrayLike,
    lights: Lights,
    normals: ArrayLike | None,
    triangles: ArrayLike | None,
    light_samples: int | None,
    progress: Progress | None,
) -> PointRequest:
    """Check the arguments of `Renderer.visibility`; raises SettingsError or SceneError."""
    scene = checked_scene(scene)
    places = _vectors("points", points, None)
    beyond = np.abs(places) > FARTHEST
    if beyond.any():
        raise SettingsError(f"points must be within {FARTHEST:g} of zero, {int(beyond.any(axis=1).sum())} are not")
    numbers = None if triangles is None else _numbers(scene, triangles, len(places))
    chosen = scene.lights if lights is None else as_lights("lights", lights)
    samples = _SAMPLES("light_samples", light_samples)
    if progress is not None and not callable(progress):
        raise refuse("progress", "a function of (done, total, text), or None", progress)
    towards = None if normals is None else _of_any_length(_vectors("normals", normals, len(places)))
    if numbers is not None:
        towards = _beside_unlisted(scene, numbers, towards)
    return PointRequest(scene, places, tuple(_exact(light, samples) for light in chosen), towards, numbers, progress)


def _vectors(name: str, value: ArrayLike, count: int | None) -> Array:
    array = as_floats(value, (count, 3))
    if array is None:
        shape = "(N, 3)" if count is None else f"({count}, 3), a row for each point"
        raise refuse(name, f"an array {shape} of numbers", value)
    finite = np.isfinite(array)
    if not finite.all():
        raise SettingsError(
            f"{name} must be finite: {int((~finite).any(axis=1).sum())} of {len(array)} are not (NaN or infinite)"
        )
    return array


def _of_any_length(vectors: Array) -> Array:
    """The same directions with a largest component of 1, so that no square overflows; zeros stay."""
    largest = np.abs(vectors).max(axis=1, keepdims=True, initial=0.0)
    return np.asarray(vectors / np.where(largest > 0.0, largest, 1.0))


def _numbers(scene: Scene, value: ArrayLike, count: int) -> NDArray[np.int64]:
    array = numbers_in(value)
    if array is None or array.dtype.kind not in "iu" or array.shape != (count,):
        raise refuse("triangles", f"an array ({count},) of integers, a triangle's number for each point or -1", value)
    starts = face_starts(scene)
    if count and (array.min() < -1 or array.max() >= starts[-1]):
        wrong = int(array.min() if array.min() < -1 else array.max())
        raise SettingsError(
            f"triangles must be numbers of the scene's {starts[-1]} triangles, from 0, or -1 for none: got {wrong}"
        )
    numbers = array.astype(np.int64)
    flat = np.array([len(node.mesh.triangles) == node.mesh.count for node in scene.nodes])
    if not flat.all():
        owners = np.searchsorted(starts, np.maximum(numbers, 0), side="right") - 1
        bad = int(((numbers >= 0) & ~flat[owners]).sum())
        if bad:
            raise SettingsError(
                f"triangles has {bad} numbers of balls or tubes, on which points cannot lie: give these -1, with a normal, off the surface"
            )
    return numbers


def _beside_unlisted(scene: Scene, triangles: NDArray[np.int64], normals: Array | None) -> Array | None:
    """The normals, with those of triangles that are not drawn or blend, on the side of the given ones: their points are free."""
    listed = np.array([node.drawn and not node.blends for node in scene.nodes])
    if listed.all() or scene.blending.all():
        return normals
    owners = np.searchsorted(face_starts(scene), np.maximum(triangles, 0), side="right") - 1
    rows = np.flatnonzero((triangles >= 0) & ~listed[owners])
    if len(rows) == 0:
        return normals
    normals = np.zeros((len(triangles), 3)) if normals is None else normals.copy()
    faces = fronts(scene, triangles[rows])
    away = np.einsum("ij,ij->i", normals[rows], faces) < 0.0
    normals[rows] = np.where(away[:, None], -faces, faces)
    return normals


def _exact(light: Light, samples: int | None) -> Light:
    """The light with a filter that tests triangles, and as many points as given, or as its own filter has."""
    shadow = light.shadow
    if shadow is None:
        return light
    own = shadow.filter.points_of_light if shadow.filter is not None and light.has_size else 0
    count = samples or max(own or LIGHT_SAMPLES, LEAST_SAMPLES)
    return replace(light, shadow=Shadow(filter=Exact(light_samples=count), faces=shadow.faces))
