"""terrain_shadow and terrain_horizon: lit share, hours of sun and horizon angles of every cell of an elevation model."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshadow.core.setting import as_floats, flag, instance, number, refuse, whole
from glshadow.core.spaces import Array
from glshadow.errors import SettingsError
from glshadow.lights import DirectionalLight
from glshadow.solar.path import SUN_ANGLE, SunPath
from glshadow.terrain.dem import Dem
from glshadow.terrain.geotiff import read_dem, write_geotiff
from glshadow.terrain.horizon import Oriented, Single, between, lit_share, sweep

EARTH_RADIUS = 6_371_008.8
"""Mean radius of the earth, metres (IUGG)."""

Progress = Callable[[int, int, str], None]
"""Called with (finished, all, what was finished)."""

_DISC_STEPS = 16  # of the table of hours, across the sun's disc
_DIFFER = 1.0 / 64.0  # lit shares of a cell's two lines that differ by more are decided by a ray of the cell's own


@dataclass(frozen=True, eq=False, repr=False)
class TerrainRaster:
    """Values on the grid of an elevation model.

    Attributes
    ----------
    values : (B, R, C) float32
        Bands; NaN where there is no height.
    dem : Dem
    names : tuple of str
        Of the bands.
    """

    values: NDArray[np.float32]
    dem: Dem
    names: tuple[str, ...]

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> NDArray[Any]:
        found = self.values[0] if len(self.values) == 1 else self.values
        return np.array(found, dtype=dtype, copy=copy)

    def __repr__(self) -> str:
        return f"TerrainRaster({', '.join(self.names)}; {self.dem!r})"

    def save(self, path: str | os.PathLike[str]) -> Path:
        """Write a GeoTIFF (.tif) with the elevation model's place and reference system; needs the extra `terrain`."""
        return write_geotiff(path, self.values, self.dem, self.names)


@dataclass(frozen=True)
class _Air:
    """What light and receivers are like: drop per squared distance, height of receivers, angle from map y to north."""

    drop: float
    above: float
    turn: float


def terrain_shadow(
    dem: Any,
    sun: DirectionalLight | SunPath,
    *,
    curvature: bool = False,
    refraction: float = 0.13,
    above: float = 0.0,
    convergence: float = 0.0,
    refine: bool = True,
    within: float = 0.5,
    progress: Progress | None = None,
) -> TerrainRaster:
    """The share of the sun's disc that each cell sees, or its hours of sun.

    Parameters
    ----------
    dem : Dem, or path of a GeoTIFF
    sun : DirectionalLight or SunPath
        A light in the axes of a loaded elevation model, x map x, y up, z against map y, as `gs.sun` gives it: the result is the lit
        share. A path: hours of sun, each step weighted by the lit share, for a disc of 0.53 degrees; steps with the sun's middle below 0
        degrees do not count.
    curvature : bool
        Whether the earth's curvature lowers what is far away; heights and map must then be in metres.
    refraction : float
        Share of the curvature that the atmosphere's refraction takes back; 0.13 is usual. Only with `curvature`.
    above : float
        Height of the receivers above the ground, in units of the heights.
    convergence : float
        Degrees from map y to north, clockwise; 0 where the map's columns run north. Used with a path.
    refine : bool
        Of a light: cells whose two lines differ get a ray of their own. See Notes.
    within : float
        Of a path: suns share a sweep if their azimuths differ by at most twice this, degrees.
    progress : callable, optional
        Called with (finished, all, text) after each sweep.

    Returns
    -------
    TerrainRaster
        One band, "lit" in [0, 1] or "hours".

    Raises
    ------
    SettingsError
        If an argument is not allowed.
    SceneError
        If the elevation model is refused, see `Dem`.
    GlshadowError
        If an extra is not installed.

    Notes
    -----
    For each direction, lines run over the field away from the sun, a cell apart. On a line the horizon is exact, for a surface that is
    linear between neighbouring cells of a row (or column) and straight from one row to the next. A cell between two lines takes
    their share linearly, so that a shadow's border is uncertain by a cell across the sun's direction; with `refine` it is that of a ray
    through the cell. The disc's lit share takes the horizon as straight and level across its half degree.
    """
    dem = as_dem(dem)
    air = _air(dem, curvature, refraction, above, convergence)
    refine = flag()("refine", refine)
    within = number(0.0, 45.0, unit="degrees", above=True)("within", within)
    if progress is not None and not callable(progress):
        raise refuse("progress", "a callable (done, total, text) or None", progress)
    if isinstance(sun, SunPath):
        return TerrainRaster(_hours(dem, sun, air, within, progress)[None], dem, ("hours",))
    light: DirectionalLight = instance(DirectionalLight, SunPath)("sun", sun)
    east, up, south = -np.asarray(light.direction)
    elevation = float(np.degrees(np.arctan2(up, np.hypot(east, south))))
    if elevation <= 0.0:
        raise SettingsError(f"the light comes from {-elevation:.2f} degrees below the horizon: a sun must be above it")
    lit = _lit(dem, float(np.degrees(np.arctan2(east, -south))), elevation, light.angle, air, refine)
    if progress is not None:
        progress(1, 1, "lit share")
    return TerrainRaster(lit[None], dem, ("lit",))


def terrain_horizon(
    dem: Any,
    azimuths: Sequence[float] | int = 36,
    *,
    curvature: bool = False,
    refraction: float = 0.13,
    above: float = 0.0,
    convergence: float = 0.0,
    progress: Progress | None = None,
) -> TerrainRaster:
    """Elevation angles of the horizon of each cell.

    Parameters
    ----------
    dem : Dem, or path of a GeoTIFF
    azimuths : sequence of float, or int
        Degrees clockwise from north; a number N: 0, 360 / N, and so on.
    curvature, refraction, above, convergence, progress
        As for `terrain_shadow`.

    Returns
    -------
    TerrainRaster
        A band for each azimuth, degrees; -90 where nothing of the model is in that direction.

    Raises
    ------
    SettingsError, SceneError, GlshadowError
        As `terrain_shadow`.
    """
    dem = as_dem(dem)
    air = _air(dem, curvature, refraction, above, convergence)
    given = _azimuths(azimuths)
    if len(given) == 0 or not np.isfinite(given).all():
        raise refuse("azimuths", "degrees clockwise from north, or a number of directions", azimuths)
    found = np.full((len(given), *dem.heights.shape), np.nan, dtype=np.float32)
    for number_, azimuth in enumerate(given.tolist()):
        field = Oriented.of(dem.heights, dem.cell, azimuth + air.turn)
        target, single = field.view(found[number_]), Single(field)
        for row, place, before, after, share in sweep(field, air.drop, air.above):
            values = between(before, after, share)
            single.add_unknown(row, place, values)
            target[row, place] = np.degrees(np.arctan(values))
        for cells, tangents in single.tangents(air.drop, air.above):
            target[cells] = np.degrees(np.arctan(tangents))
        if progress is not None:
            progress(number_ + 1, len(given), f"{azimuth:g} degrees")
    found[:, np.isnan(dem.heights)] = np.nan
    return TerrainRaster(found, dem, tuple(f"horizon {each:g}" for each in given.tolist()))


def _azimuths(value: Any) -> Array:
    """Azimuths (N,) in degrees, as given or N around."""
    given = as_floats(value, (None,))
    if given is not None:
        return given
    count: int = whole(1, 3600)("azimuths", value)
    return np.arange(count, dtype=np.float64) * (360.0 / count)


def as_dem(source: Any) -> Dem:
    """An elevation model, or the one in a file."""
    if isinstance(source, str | os.PathLike):
        return read_dem(source)
    found: Dem = instance(Dem)("dem", source)
    return found


def _air(dem: Dem, curvature: Any, refraction: Any, above: Any, convergence: Any) -> _Air:
    bent = flag()("curvature", curvature)
    share = number(-10.0, 1.0)("refraction", refraction)
    height = number()("above", above)
    turn = number(-360.0, 360.0, unit="degrees")("convergence", convergence)
    return _Air((1.0 - share) / (2.0 * EARTH_RADIUS) if bent else 0.0, height, turn)


def _lit(dem: Dem, azimuth: float, elevation: float, angle: float, air: _Air, refine: bool) -> NDArray[np.float32]:
    """Lit shares (R, C) of a sun at an azimuth from map y."""
    found = np.full(dem.heights.shape, np.nan, dtype=np.float32)
    field = Oriented.of(dem.heights, dem.cell, azimuth)
    target, single = field.view(found), Single(field)
    for row, place, before, after, share in sweep(field, air.drop, air.above):
        first, second = lit_share(elevation, before, angle), lit_share(elevation, after, angle)
        target[row, place] = values = between(first, second, share)
        single.add_unknown(row, place, values)
        if refine and share > 0.0:
            single.add(row, place.start + np.flatnonzero(np.abs(first - second) > _DIFFER))
    floor = float(np.tan(np.radians(max(elevation - 0.5 * angle, -89.0))))
    for cells, tangents in single.tangents(air.drop, air.above, floor):
        target[cells] = lit_share(elevation, tangents, angle)
    found[np.isnan(dem.heights)] = np.nan
    return found


def _hours(dem: Dem, path: SunPath, air: _Air, within: float, progress: Progress | None) -> NDArray[np.float32]:
    """Hours of sun (R, C)."""
    total = np.zeros(dem.heights.shape, dtype=np.float32)
    up = np.flatnonzero(path.is_up)
    sectors = np.floor(path.azimuth[up] / (2.0 * within)).astype(np.int64)
    numbers = np.unique(sectors)
    for done, sector in enumerate(numbers.tolist(), start=1):
        rows = up[sectors == sector]
        azimuth = 0.5 * float(path.azimuth[rows].min() + path.azimuth[rows].max())
        tangents, hours = _table(path.elevation[rows], path.hours[rows])
        field = Oriented.of(dem.heights, dem.cell, azimuth + air.turn)
        target, single = field.view(total), Single(field)
        for row, place, before, after, share in sweep(field, air.drop, air.above):
            first, second = (np.interp(each, tangents, hours) for each in (before, after))
            values = between(first, second, share)
            single.add_unknown(row, place, values)
            target[row, place] += np.nan_to_num(values)
        for cells, found in single.tangents(air.drop, air.above, float(tangents[0])):
            target[cells] += np.interp(found, tangents, hours)
        if progress is not None:
            progress(done, len(numbers), f"azimuth {azimuth:.1f} degrees")
    total[np.isnan(dem.heights)] = np.nan
    return total


def _table(elevations: Array, hours: Array) -> tuple[Array, Array]:
    """Tangents of horizons, ascending, and the hours that suns of these elevations are above them."""
    across = SUN_ANGLE * np.linspace(-0.5, 0.5, _DISC_STEPS + 1)
    horizons = np.unique(elevations[:, None] + across)
    horizons = horizons[np.abs(horizons) < 90.0]
    tangents = np.tan(np.radians(horizons))
    lit = np.array([lit_share(float(each), tangents, SUN_ANGLE) for each in elevations])
    return tangents, np.asarray(hours @ lit)
