"""EnvironmentMap: radiance from every direction, with the irradiance that it gives and the directions that stand for it, in float64."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshadow.core.equirectangular import (
    Inversion,
    directions_within,
    fewer_columns,
    fewer_rows,
    moments,
    reduced,
    solid_angles,
    vectors,
)
from glshadow.core.sample_patterns import GOLDEN_ANGLE, GOLDEN_SHARE, square
from glshadow.core.setting import Settings, numbers_in, refuse, setting
from glshadow.core.spaces import Array
from glshadow.core.srgb import LUMINANCE, linear_from_srgb
from glshadow.errors import SettingsError
from glshadow.lights.environment_reflection import LEVELS, filtered
from glshadow.lights.light import BRIGHTEST_RADIANCE
from glshadow.lights.table import LightTable

MOST_ROWS, MOST_COLUMNS = 512, 1024
"""A map is reduced to this size: a texel is then 0.35 degrees, less than the sun."""
ROWS, COLUMNS = 128, 256
"""Size of the map without its brightest texels, for irradiance and for directions; also cells of the irradiance table."""
BRIGHT = 16.0
"""A texel is bright above this multiple of the mean luminance."""
MOST_BRIGHT = 64
Directions = tuple[Array, Array]
_TOGETHER = 1 << 22  # texels checked at once
STEP_DEGREES = 0.05
"""More directions within one bright texel than its width divided by this would not be seen as steps of a penumbra."""
_ALLOWED = (
    "a file, an EnvironmentMap, or an image (height, width, 3 or 4) of linear radiance: finite numbers from 0 to 3.4e38"
)


def _radiance(name: str, value: Any) -> NDArray[np.float32]:
    if isinstance(value, EnvironmentMap):
        return value.radiance
    if isinstance(value, str | os.PathLike):
        from glshadow.radiance import rows_of_file  # a map given as a file: read when given

        rows = rows_of_file(value)
    else:
        rows = _rows_of(name, value)
    image = np.concatenate([_checked(name, part) for part in rows])
    if len(image) > MOST_ROWS:
        image = fewer_rows(image.astype(np.float64), MOST_ROWS).astype(np.float32)
    image.flags.writeable = False
    return image


def _rows_of(name: str, value: Any) -> Iterator[NDArray[Any]]:
    """The rows of an image given as numbers, some at a time: uint8 and uint16 as in files, sRGB; all others linear."""
    array = numbers_in(value)
    if array is None or array.ndim != 3 or array.shape[2] not in (3, 4) or not array.size:
        raise refuse(name, _ALLOWED, value)
    step = max(_TOGETHER // array.shape[1], 1)
    for first in range(0, len(array), step):
        part = array[first : first + step, :, :3]
        encoded = array.dtype in (np.uint8, np.uint16)
        yield linear_from_srgb(part / np.iinfo(array.dtype).max) if encoded else part


def _checked(name: str, rows: NDArray[Any]) -> NDArray[np.float32]:
    """Some rows of an image, with at most MOST_COLUMNS."""
    with np.errstate(all="ignore"):  # beyond float32: infinite, refused here
        image = rows.astype(np.float32)
    found = {"NaN": np.isnan(image), "infinite": np.isinf(image), "negative": image < 0.0}
    if bad := [what for what, where in found.items() if where.any()]:
        raise SettingsError(f"{name} must be {_ALLOWED}; some of its texels are {' and some '.join(bad)}")
    return image if image.shape[1] <= MOST_COLUMNS else fewer_columns(image, MOST_COLUMNS).astype(np.float32)


@dataclass(frozen=True, eq=False)
class EnvironmentMap(Settings):
    """Radiance from every direction: an equirectangular image. Maps with equal texels are equal.

    Rows go from the zenith down to the nadir. The centre column is towards -z, the column to the right of it towards +x, as a camera that
    looks along -z sees them. A texel is uniform. An image of more than 1024 x 512 texels is reduced to that, by means over solid angle.

    Parameters
    ----------
    radiance : path, or (H, W, 3 or 4) numbers
        Linear. A file in any format of OpenImageIO, such as .hdr and .exr; stored as a read-only (H, W, 3) float32.
    """

    radiance: NDArray[np.float32] = setting(_radiance, help=_ALLOWED)

    @cached_property
    def digest(self) -> str:
        """Hash of the texels."""
        return hashlib.sha256(repr(self.radiance.shape).encode() + self.radiance.tobytes()).hexdigest()

    def __eq__(self, other: object) -> bool:
        return isinstance(other, EnvironmentMap) and bool(self.digest == other.digest)

    def __hash__(self) -> int:
        return hash(self.digest)

    def __repr__(self) -> str:
        height, width = self.radiance.shape[:2]
        return f"EnvironmentMap({width} x {height}, {self.digest[:12]})"

    def __getstate__(self) -> dict[str, Any]:
        return {"radiance": self.radiance}

    def __setstate__(self, state: dict[str, Any]) -> None:
        state["radiance"].flags.writeable = False
        self.__dict__.update(state)

    # -- texels

    @cached_property
    def _texels(self) -> Array:
        """Texels in float64; each is repeated where there are fewer than ROWS x COLUMNS."""
        image: Array = self.radiance.astype(np.float64)
        down, across = (-(-wanted // have) for wanted, have in zip((ROWS, COLUMNS), image.shape[:2], strict=True))
        return np.repeat(np.repeat(image, down, axis=0), across, axis=1)

    @cached_property
    def _luminous(self) -> Array:
        """Luminance of each texel, times its solid angle."""
        return np.asarray((self._texels @ LUMINANCE) * solid_angles(self._texels.shape)[:, None])

    @cached_property
    def _bright(self) -> NDArray[np.int64]:
        """Flat indices of bright texels, the brightest first."""
        flux = self._luminous
        mean = flux.sum() / (4.0 * np.pi)
        found = np.flatnonzero((flux > BRIGHT * mean * solid_angles(flux.shape)[:, None]).ravel())
        return found[np.argsort(-flux.ravel()[found], kind="stable")][:MOST_BRIGHT]

    def _without(self, texels: NDArray[np.int64]) -> Array:
        """Radiance without some texels, reduced to at most ROWS x COLUMNS."""
        rest = self._texels
        if len(texels):
            rest = rest.copy()
            rest.reshape(-1, 3)[texels] = 0.0
        return reduced(rest, ROWS, COLUMNS)

    # -- irradiance

    def irradiance(self, normals: Array) -> Array:
        """Irradiance (..., 3) of white surfaces with unit normals (..., 3) in the map's frame, over that of a uniform map of radiance 1.

        Interpolated in `irradiance_table`, as the snippet does.
        """
        return self._interpolated(self._table[None], normals, 0)

    @staticmethod
    def _interpolated(tables: Array, aims: Array, level: Any) -> Array:
        """Bilinear in one of several tables (L, ROWS + 1, COLUMNS, 3)."""
        down = np.arctan2(np.hypot(aims[..., 0], aims[..., 2]), aims[..., 1]) / np.pi * ROWS
        across = (np.arctan2(aims[..., 0], -aims[..., 2]) / (2.0 * np.pi) + 0.5) * COLUMNS
        row, column = np.clip(down.astype(int), 0, ROWS - 1), np.floor(across).astype(int)
        f, g = (down - row)[..., None], (across - column)[..., None]
        left, right = column % COLUMNS, (column + 1) % COLUMNS
        upper = (1.0 - g) * tables[level, row, left] + g * tables[level, row, right]
        lower = (1.0 - g) * tables[level, row + 1, left] + g * tables[level, row + 1, right]
        return np.asarray((1.0 - f) * upper + f * lower)

    @cached_property
    def irradiance_table(self) -> LightTable:
        """Irradiance by normal: ROWS + 1 rows from the zenith to the nadir, COLUMNS columns from +z over +x towards -z."""
        return LightTable(np.minimum(self._table, BRIGHTEST_RADIANCE).astype(np.float32), repeat=True)

    @cached_property
    def _table(self) -> Array:
        """The sum over texels of radiance x max(0, normal . their vector moment) / pi; around the zenith a convolution for each row."""
        bright = self._bright
        rest = self._without(bright)
        ring, rise = moments(rest.shape)
        spectra = np.fft.rfft(rest, axis=1)
        turn = np.cos(
            2.0 * np.pi * (np.arange(COLUMNS) - 0.5) / COLUMNS
        )  # from a texel's centre to the table's columns
        tilt = np.pi * np.arange(ROWS + 1) / ROWS
        sums = [
            np.einsum(
                "rk,rkc->kc",
                np.fft.rfft(
                    np.maximum(np.sin(each) * ring[:, None] * turn + np.cos(each) * rise[:, None], 0.0), axis=1
                ),
                spectra,
            )
            for each in tilt
        ]
        table = np.maximum(np.fft.irfft(np.array(sums), n=COLUMNS, axis=1), 0.0)
        around = 2.0 * np.pi * np.arange(COLUMNS) / COLUMNS - np.pi
        normals = vectors(np.cos(tilt)[:, None], np.sin(tilt)[:, None], around)
        ring, rise = moments(self._texels.shape)
        for row, column in zip(*np.divmod(bright, self._texels.shape[1]), strict=True):
            angle = 2.0 * np.pi * (column + 0.5) / self._texels.shape[1] - np.pi
            moment = vectors(rise[row], ring[row], angle)
            table += np.maximum(normals @ moment, 0.0)[..., None] * self._texels[row, column]
        table[[0, -1]] = table[[0, -1]].mean(axis=1, keepdims=True)
        return table / np.pi

    # -- reflection

    def reflection(self, aims: Array, roughness: Array) -> Array:
        """What surfaces of a roughness (...) reflect from unit directions (..., 3) in the map's frame; interpolated, as in the snippet."""
        along = np.clip(roughness, 0.0, 1.0) * (LEVELS - 1)
        level = np.minimum(along.astype(int), LEVELS - 2)
        f = (along - level)[..., None]
        lower, upper = (self._interpolated(self._reflection, aims, each) for each in (level, level + 1))
        return np.asarray((1.0 - f) * lower + f * upper)

    @cached_property
    def reflection_table(self) -> LightTable:
        """The levels of roughness, one above the other."""
        levels = self._reflection.reshape(-1, COLUMNS, 3)
        return LightTable(np.minimum(levels, BRIGHTEST_RADIANCE).astype(np.float32), repeat=True)

    @cached_property
    def _reflection(self) -> Array:
        height, width = self._texels.shape[:2]
        row, column = np.divmod(self._bright, width)
        aims = directions_within(row, 0.5, column, 0.5, height, width)
        fluxes = self._texels[row, column] * solid_angles((height, width))[row][:, None]
        return filtered(self._without(self._bright[:0]), self._without(self._bright), aims, fluxes)

    # -- directions

    def directions(self, count: int) -> Directions:
        """At most `count` directions (N, 3) in the map's frame that stand for it, and the light (N, 3) that each stands for. Cached.

        Every bright texel that holds a share 1 / count of the light or more has directions of its own, spread over the texel: for half its
        share of them, but no more than its width needs. The others are a lattice: equal shares of the luminance that is left, those of a
        uniform dome as of SkyLight. Together they have the map's light in each channel,
        whose luminance is 1.
        """
        cached: dict[int, Directions] = self.__dict__.setdefault("_cached", {})
        if count not in cached:
            cached[count] = self._chosen(count)
        return cached[count]

    def _chosen(self, count: int) -> Directions:
        total = self._luminous.sum()
        if not total > 0.0:
            return np.array([[0.0, 1.0, 0.0]]), np.zeros((1, 3))
        share = self._luminous.ravel()[self._bright] / total
        bright, share = self._bright[share * count >= 1.0], share[share * count >= 1.0]
        height, width = self._texels.shape[:2]
        most = max(round(180.0 / height / STEP_DEGREES), 1)
        aims, shares = [], []
        for index, each in zip(bright.tolist(), share.tolist(), strict=True):
            row, column = divmod(index, width)
            own = min(max(int(0.5 * count * each), 1), most)
            places = square(own)
            places = 0.5 + 0.5 * np.clip(places - places.mean(axis=0), -1.0, 1.0)
            aims.append(directions_within(np.full(own, row), places[:, 0], column, places[:, 1], height, width))
            light = self._texels[row, column] * solid_angles((height, width))[row]
            shares.append(np.tile(light / own, (own, 1)))
        left = count - sum(map(len, aims))
        rest = self._without(bright)
        if left > 0 and rest.any():
            found = self._lattice(rest, left)
            aims.append(found[0])
            shares.append(found[1])
        return np.concatenate(aims), np.concatenate(shares) / total

    def _lattice(self, rest: Array, count: int) -> Directions:
        flux = rest * solid_angles(rest.shape)[:, None, None]
        # upwards from the nadir, and against the columns: the spiral of SkyLight
        points = Inversion((flux @ LUMINANCE)[::-1])
        i = np.arange(count)
        row, up, column, across = points.at((i + 0.5) / count, -i * GOLDEN_ANGLE / (2.0 * np.pi) % 1.0)
        row = len(rest) - 1 - row
        aims = directions_within(row, 1.0 - up, column, across, *rest.shape[:2])
        colors = rest[row, column] / (rest[row, column] @ LUMINANCE)[:, None]
        found, wanted = colors.sum(axis=0), flux.sum(axis=(0, 1))
        return aims, colors * (wanted / np.where(found > 0.0, found, 1.0))

    def random_directions(self, count: int, samples: int, generator: np.random.Generator) -> Iterator[Array]:
        """Directions (count, 3) in the map's frame, `samples` times: a random one in each of `samples` equal shares of the luminance."""
        turn = generator.uniform(size=count)
        points, (height, width) = self._inversion, self._texels.shape[:2]
        for k in range(samples):
            row, down, column, across = points.at(
                (k + generator.uniform(size=count)) / samples, (turn + k * GOLDEN_SHARE) % 1.0
            )
            yield directions_within(row, down, column, across, height, width)

    @cached_property
    def _inversion(self) -> Inversion:
        black = not self._luminous.any()
        return Inversion(np.ones_like(self._luminous) if black else self._luminous)
