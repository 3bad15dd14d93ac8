"""Dem: a digital elevation model, heights on a grid with their place on a map."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from glshadow.core.setting import Settings, as_floats, number, numbers_in, optional, refuse, setting, text
from glshadow.core.spaces import Array
from glshadow.errors import SceneError
from glshadow.terrain.horizon import Heights

Affine = tuple[float, float, float, float, float, float]


def _heights(name: str, value: Any) -> Heights:
    if isinstance(value, np.ma.MaskedArray):
        value = np.ma.filled(value.astype(np.float64), np.nan)
    if value is not None and hasattr(value, "dtype") and getattr(value.dtype, "kind", "") == "f" and value.ndim == 2:
        kept = np.asarray(value)  # float32 of a large file stays as it is
    else:
        found = numbers_in(value)
        if found is None or found.ndim != 2:
            raise refuse(name, "numbers (rows, columns), NaN where there is no height", value)
        kept = found.astype(np.float64)
    if min(kept.shape) < 2:
        raise refuse(name, "at least 2 x 2 cells", value)
    if not np.isfinite(kept).any():
        raise SceneError(f"{name} has no height: all {kept.size} cells are empty")
    if np.isinf(kept).any():
        raise SceneError(f"{name} has {int(np.isinf(kept).sum())} infinite heights: give NaN where there is none")
    return kept


def _affine(name: str, value: Any) -> Affine:
    kept = as_floats(tuple(value)[:6] if isinstance(value, tuple) else value, (6,))
    if kept is None or not np.isfinite(kept).all():
        raise refuse(
            name,
            "6 numbers (a, b, c, d, e, f): x = a column + b row + c and y = d column + e row + f of a cell's corner, as in rasterio",
            value,
        )
    a, b, _, d, e, _ = kept.tolist()
    sides = np.hypot(a, d), np.hypot(b, e)
    if min(sides) == 0.0 or abs(a * e - b * d) < 1e-6 * sides[0] * sides[1]:
        raise refuse(name, "a transform whose cells have an area", value)
    return tuple(kept.tolist())


@dataclass(frozen=True, eq=False, repr=False)
class Dem(Settings):
    """Heights at the middles of the cells of a grid.

    Parameters
    ----------
    heights : (R, C) float32 or float64
        Row 0 is the first of the file: of a map with north up, the northern. NaN: no height. Masked arrays are taken too.
    transform : (6,) floats, or affine.Affine
        From columns and rows of cell corners to map x and y, as rasterio has it: (a, b, c, d, e, f). Map units are those of the heights.
    crs : str, optional
        Coordinate reference system, as GeoTIFF files get it: "EPSG:32632" or WKT. None: not known.
    factor : float
        Map units per unit of the heights: 0.3048 for heights in feet on a map in metres.

    Raises
    ------
    SceneError
        If there is no height, or the map is in degrees.
    """

    refusal = SceneError

    heights: Heights = setting(_heights, help="(rows, columns)")
    transform: Affine = setting(_affine, help="affine transform of cell corners to the map")
    crs: str | None = setting(optional(text(), "not known"), None, help="coordinate reference system")
    factor: float = setting(number(0.0, above=True), 1.0, help="map units per unit of the heights")

    def __post_init__(self) -> None:
        super().__post_init__()
        refuse_degrees(self.crs, self.transform, self.heights.shape)
        if self.factor != 1.0:
            object.__setattr__(self, "heights", self.heights * self.heights.dtype.type(self.factor))
            object.__setattr__(self, "factor", 1.0)

    def __repr__(self) -> str:
        rows, columns = self.heights.shape
        width, height = self.cell_size
        return f"Dem({rows} x {columns} cells of {width:g} x {height:g}, crs={self.crs and self.crs[:40]!r})"

    @property
    def cell(self) -> Array:
        """(2, 2) float64: map vectors of a column and of a row, as columns."""
        a, b, _, d, e, _ = self.transform
        return np.array([[a, b], [d, e]])

    @property
    def cell_size(self) -> tuple[float, float]:
        """Width and height of a cell in map units."""
        width, height = np.linalg.norm(self.cell, axis=0)
        return float(width), float(height)

    @property
    def place(self) -> Array:
        """(3,) float64: the middle of the grid in world axes, x map x, y up, z against map y."""
        rows, columns = self.heights.shape
        _, _, c, _, _, f = self.transform
        east, north = self.cell @ (0.5 * columns, 0.5 * rows)
        low, high = np.nanmin(self.heights), np.nanmax(self.heights)
        return np.array([east + c, 0.5 * (float(low) + float(high)), -(north + f)])

    def positions(self) -> Array:
        """(R C, 3) float64: the cells' middles in world axes, relative to `place`; NaN heights as they are."""
        rows, columns = self.heights.shape
        column, row = np.meshgrid(
            np.arange(columns) + 0.5 * (1 - columns), np.arange(rows) + 0.5 * (1 - rows)
        )  # from the middle
        east, north = np.tensordot(self.cell, np.stack([column, row]), axes=1)
        heights = self.heights.astype(np.float64) - self.place[1]
        return np.stack([east, heights, -north], axis=-1).reshape(-1, 3)


def refuse_degrees(crs: str | None, transform: Affine, shape: tuple[int, ...]) -> None:
    """Raise an error if a map is known to be in degrees.

    Raises
    ------
    SceneError
        With the command that gives it in metres.
    """
    if crs is None or not _is_geographic(crs):
        return
    a, b, c, d, e, f = transform
    middle = 0.5 * shape[1], 0.5 * shape[0]
    longitude, latitude = a * middle[0] + b * middle[1] + c, d * middle[0] + e * middle[1] + f
    zone = int(np.clip(np.floor((longitude + 180.0) / 6.0) + 1, 1, 60))
    code = f"EPSG:{(32600 if latitude >= 0.0 else 32700) + zone}"
    raise SceneError(
        f"the elevation model is in degrees ({crs[:60]}), its heights are not: slopes and shadows need one unit. Reproject it to metres, "
        f"here UTM zone {zone}: gdalwarp -t_srs {code} -r bilinear in.tif out.tif (rio warp in.tif out.tif --dst-crs {code})"
    )


def _is_geographic(crs: str) -> bool:
    try:
        from rasterio.crs import CRS
        from rasterio.errors import CRSError
    except ImportError:  # without rasterio, by what it says
        return crs.upper().replace(" ", "") in ("EPSG:4326", "OGC:CRS84") or crs.lstrip().startswith(
            ("GEOGCS", "GEOGCRS")
        )
    try:
        return bool(CRS.from_user_input(crs).is_geographic)
    except (CRSError, ValueError) as error:
        raise SceneError(f'crs must be a name such as "EPSG:32632" or WKT, got {crs[:60]!r}: {error}') from None
