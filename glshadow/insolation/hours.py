"""sun_hours: hours of direct sun, shaded shares and irradiation, summed over the suns of a path."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from glshadow.arguments import as_scene
from glshadow.core.setting import as_path, instance, number, optional, refuse, whole
from glshadow.core.spaces import Array
from glshadow.insolation.result import SunHours
from glshadow.insolation.state import Sums, Unfinished
from glshadow.insolation.targets import Target, target_of
from glshadow.insolation.weather import Weather, weather_of
from glshadow.journal import digest_of
from glshadow.renderer import Renderer
from glshadow.scene.nodes import Scene
from glshadow.solar.path import SunPath, sunlight
from glshadow.solar.sharing import SharedSuns, shared_suns

Progress = Callable[[int, int, str], None]
"""Called with (finished suns, all suns, text)."""

SKY_DIRECTIONS = 256
"""Directions of a uniform sky, each for the same solid angle: the sky view is right to about 0.01."""

MOST_VALUES = 1 << 23  # points times suns of one call
MOST_SUNS = 16  # of one call: each has triangle lists of its own


class Visibility(Protocol):
    """What tells which points see which lights: `Renderer`, or anything with this method."""

    def visibility(
        self,
        scene: Scene,
        points: ArrayLike,
        lights: Any = None,
        normals: ArrayLike | None = None,
        triangles: ArrayLike | None = None,
    ) -> NDArray[np.float32]:
        """Visibility (L, N) of lights at world points (N, 3)."""
        ...


def sun_hours(
    scene: Any,
    path: SunPath,
    to: str | ArrayLike = "faces",
    *,
    normals: ArrayLike | None = None,
    per_face: int = 4,
    cell: float | None = None,
    seed: int = 0,
    within: float = 0.5,
    weather: Any = None,
    weather_label: str = "left",
    keep: str | os.PathLike[str] | None = None,
    renderer: Visibility | None = None,
    progress: Progress | None = None,
) -> SunHours:
    """Hours of direct sun on a scene.

    Parameters
    ----------
    scene : Scene, or anything that `load` takes
        Its lights do not count.
    path : SunPath
        With the world's directions of north and up. Every step counts with its length where the sun's middle is above the horizon and seen.
    to : {"faces", "vertices"} or (N, 3) floats
        Faces: the mean over `per_face` points of each. Vertices: the mean of the faces around each, weighted by area. Points: world
        positions, seen from all around or on the side of their normals.
    normals : (N, 3) floats, optional
        Of points.
    per_face : int
        Sample points of a face, or of each of its parts.
    cell : float, optional
        Divide faces until no edge is longer than this, world units: each part has values of its own. None: faces as they are.
    seed : int
        Changes the points.
    within : float
        Suns at most this angle apart share one shadow, degrees; 0: none do. A shadow's border then moves by at most that angle, which
        the sun passes in `4 within / cos(declination)` minutes: twice a day for each thing that shades a point.
    weather : pandas.DataFrame, optional
        Columns dni and dhi in W/m^2 and an index with a time zone, as pvlib gives them: adds `direct`, and with dhi `diffuse`.
    weather_label : {"left", "right", "middle"}
        Whether a row's time is the beginning, the end or the middle of what it stands for.
    keep : path, optional
        A file ending in .npz for unfinished sums, with a journal next to it: an interrupted call that is made again goes on from there.
    renderer : Renderer, optional
        None: a temporary one.
    progress : callable, optional
        Called as (finished suns, all suns, text).

    Returns
    -------
    SunHours

    Raises
    ------
    SettingsError
        If an argument is not allowed, or the weather does not cover the path.
    SceneError
        If the scene has no faces.
    GlshadowError
        If the extra `sun` is not installed, or `keep` cannot be written.

    Notes
    -----
    The sun is a point here: over a day, its penumbrae average out. A face receives sun on its front alone (counter-clockwise).
    """
    scene = as_scene(scene, usual="plain")
    path = instance(SunPath)("path", path)
    within = number(0.0, 10.0, unit="degrees")("within", within)
    cell = optional(number(0.0, above=True), "faces as they are")("cell", cell)
    count, seed = whole(1, 4096)("per_face", per_face), whole(0, (1 << 63) - 1)("seed", seed)
    target = target_of(scene, to, count, seed, normals, cell)
    if progress is not None and not callable(progress):
        raise refuse("progress", "a callable (done, total, text) or None", progress)
    if renderer is not None and not callable(getattr(renderer, "visibility", None)):
        raise refuse("renderer", "a Renderer or None", renderer)
    given = None if weather is None else weather_of(weather, path, weather_label)
    file = optional(_npz, "not kept")("keep", keep)
    shared = shared_suns(path, within)
    request = (
        digest_of(*scene.nodes, path, target.points, target.per_place, target.normals, within, given)
        if file is not None
        else ""
    )
    with _renderer(renderer) as eyes:
        sums = _summed(scene, path, target, shared, given, eyes, Unfinished(file, request), progress)
        sky = None if given is None or given.diffuse is None else _sky_view(scene, path, target, eyes)
    return _result(scene, path, target, shared, sums, given, sky)


def _npz(name: str, value: Any) -> Any:
    path = as_path(name, value)
    if path.suffix.lower() != ".npz":
        raise refuse(name, "a file that ends in .npz", str(path))
    return path


@contextmanager
def _renderer(given: Visibility | None) -> Iterator[Visibility]:
    if given is not None:
        yield given
        return
    with Renderer() as own:
        yield own


def _summed(
    scene: Scene,
    path: SunPath,
    target: Target,
    shared: SharedSuns,
    weather: Weather | None,
    eyes: Visibility,
    unfinished: Unfinished,
    progress: Progress | None,
) -> Sums:
    """Sums over all suns, saved from time to time."""
    count, suns = len(target.areas), len(shared.directions)
    sums = unfinished.read() or Sums.zero(count, suns, weather is not None)
    weights = _weights(path, shared)
    energy = None if weather is None else _energies(path, shared, weather)
    steps = _per_call(len(target.points))
    shares = target.areas / target.areas.sum() if target.areas.sum() > 0.0 else np.full(count, 1.0 / count)
    while sums.done < suns:
        part = slice(sums.done, min(sums.done + steps, suns))
        aims = shared.directions[part]
        seen = _seen(scene, target, aims, eyes)
        front = np.ones(seen.shape) if target.place_normals is None else (aims @ target.place_normals.T > 0.0) * 1.0
        for into, values in ((sums.hours, seen), (sums.possible, front)):
            into += weights[:, part] @ values
        sums.mean_seen[part], sums.mean_front[part] = seen @ shares, front @ shares
        if energy is not None:
            incident = np.linalg.norm(energy[part], axis=1)[:, None]
            if target.place_normals is not None:
                incident = np.maximum(energy[part] @ target.place_normals.T, 0.0)
            sums.direct += (seen * incident).sum(axis=0)
        sums.done = part.stop
        unfinished.write(sums)
        if progress is not None:
            progress(sums.done, suns, "suns")
    unfinished.write(sums, at_once=True)
    return sums


def _per_call(points: int) -> int:
    return max(1, min(MOST_SUNS, MOST_VALUES // max(points, 1)))


def _weights(path: SunPath, shared: SharedSuns) -> Array:
    """Hours (12 + 24, G) that each direction stands for, by month, and by hour of the day."""
    up = shared.group >= 0
    found = np.zeros((36, len(shared.directions)))
    np.add.at(found, (path.month[up] - 1, shared.group[up]), path.hours[up])
    np.add.at(found, (12 + path.hour[up], shared.group[up]), path.hours[up])
    return found


def _energies(path: SunPath, shared: SharedSuns, weather: Weather) -> Array:
    """Sums (G, 3) over the suns of each direction of direct irradiation, kWh/m^2, times the direction to the sun."""
    up = shared.group >= 0
    found = np.zeros((len(shared.directions), 3))
    np.add.at(found, shared.group[up], (1e-3 * weather.direct * path.hours)[up, None] * path.directions[up])
    return found


def _seen(scene: Scene, target: Target, aims: Array, eyes: Visibility) -> Array:
    """Seen shares (L, F) of suns in directions (L, 3) at the places."""
    lights = [sunlight(aim, angle=0.0) for aim in aims]
    found = eyes.visibility(scene, target.points, lights, normals=target.normals, triangles=target.triangles)
    return np.asarray(found.reshape(len(lights), -1, target.per_place).mean(axis=2, dtype=np.float64))


def _sky_view(scene: Scene, path: SunPath, target: Target, eyes: Visibility) -> Array:
    """Share (F,) of a uniform sky's light, relative to a horizontal face that sees all of it."""
    k = np.arange(SKY_DIRECTIONS) + 0.5
    around, up = np.pi * (1.0 + np.sqrt(5.0)) * k, k / SKY_DIRECTIONS  # Fibonacci's lattice on the hemisphere
    flat = np.sqrt(1.0 - up * up)
    aims = np.stack([flat * np.cos(around), flat * np.sin(around), up], axis=1) @ path.axes
    found = np.zeros(len(target.areas))
    steps = _per_call(len(target.points))
    for start in range(0, SKY_DIRECTIONS, steps):
        part = aims[start : start + steps]
        seen = _seen(scene, target, part, eyes)
        weight = 1.0 if target.place_normals is None else 2.0 * np.maximum(part @ target.place_normals.T, 0.0)
        found += (seen * weight).sum(axis=0) / SKY_DIRECTIONS
    return found


def _result(
    scene: Scene,
    path: SunPath,
    target: Target,
    shared: SharedSuns,
    sums: Sums,
    weather: Weather | None,
    sky: Array | None,
) -> SunHours:
    up = shared.group >= 0
    tables = np.zeros((2, 12, 24))
    for table, share in zip(tables, (sums.mean_seen, sums.mean_front), strict=True):
        np.add.at(table, (path.month[up] - 1, path.hour[up]), path.hours[up] * share[shared.group[up]])
    diffuse = None
    if sky is not None and weather is not None and weather.diffuse is not None:
        diffuse = sky * float(1e-3 * weather.diffuse @ path.hours)
    found = SunHours(
        scene, path, target.kind, target.places, target.faces, target.shapes, target.areas, sums.hours[:12],
        sums.possible[:12], sums.hours[12:], sums.possible[12:], tables[0], tables[1],
        sums.direct if weather is not None else None, diffuse, sky, len(shared.directions), shared.error,
    )  # fmt: skip
    if target.vertices is None:
        return found
    values: dict[str, Any] = {
        name: target.at_vertices(getattr(found, name))
        for name in ("month_hours", "month_possible", "hour_hours", "hour_possible", "direct", "diffuse", "sky_view")
        if getattr(found, name) is not None
    }
    return replace(found, places=target.vertices, faces=None, areas=target.vertex_areas(), **values)
