"""GeoTIFF files: elevation models read from them, arrays written to them."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshadow.core.setting import as_path, number, refuse, whole
from glshadow.errors import GlshadowError, SceneError, SettingsError, required
from glshadow.files import replacing
from glshadow.terrain.dem import Dem

SUFFIXES = (".tif", ".tiff")


def read_dem(source: str | os.PathLike[str] | bytes, band: int = 1, factor: float = 1.0) -> Dem:
    """Read an elevation model: a GeoTIFF, or another raster that GDAL reads.

    Parameters
    ----------
    source : path, or bytes of a file
    band : int
        Number of the band, from 1.
    factor : float
        Map units per unit of the heights: 0.3048 for feet on a map in metres.

    Returns
    -------
    Dem
        float32 where the file's numbers are exact in it, else float64; NaN where the file has no data.

    Raises
    ------
    SceneError
        If the file is missing or broken, has no such band, does not say where it is on a map, or is in degrees.
    GlshadowError
        If rasterio is not installed.
    """
    band = whole(1, 1 << 16)("band", band)
    factor = number(0.0, above=True)("factor", factor)
    rasterio = _rasterio("a GeoTIFF")
    label = "the elevation model"
    if not isinstance(source, bytes):
        path = as_path("source", source)
        label = path.name
        if not path.is_file():
            raise SceneError(f"file not found: {path}")
    try:
        held = rasterio.MemoryFile(source) if isinstance(source, bytes) else _Opened(path)
        with held as opened, opened.open() as file:
            return _read(file, band, factor, label)
    except (rasterio.errors.RasterioError, rasterio.errors.NotGeoreferencedWarning) as error:  # warnings may be errors
        raise SceneError(f"{label} cannot be read as a raster: {' '.join(str(error).split())}") from error


class _Opened:
    """A path with the interface of rasterio's MemoryFile."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def __enter__(self) -> _Opened:
        return self

    def __exit__(self, *_: object) -> None:
        """Nothing to release."""

    def open(self) -> Any:
        """The dataset."""
        return _rasterio("a GeoTIFF").open(self.path)


def _read(file: Any, band: int, factor: float, label: str) -> Dem:
    if band > file.count:
        raise SceneError(f"{label} has {file.count} bands, there is no band {band}")
    if file.transform.is_identity and file.crs is None:
        raise SceneError(
            f"{label} is an image, not an elevation model: it does not say how large its cells are. Give heights and transform: "
            "glshadow.Dem(array, (width, 0, west, 0, -height, north))"
        )
    kept = np.float32 if np.can_cast(file.dtypes[band - 1], np.float32) else np.float64
    values = file.read(band, masked=True)
    heights = values.astype(kept).filled(np.nan)
    scale, offset = file.scales[band - 1], file.offsets[band - 1]
    if (scale, offset) != (1.0, 0.0):
        heights = heights * heights.dtype.type(scale) + heights.dtype.type(offset)
    crs = None if file.crs is None else file.crs.to_string()
    return Dem(heights, tuple(file.transform)[:6], crs, factor)


def write_geotiff(
    path: str | os.PathLike[str], values: NDArray[np.float32], dem: Dem, names: tuple[str, ...] = ()
) -> Path:
    """Write bands (B, R, C) on the grid of an elevation model; NaN is the value of no data.

    Raises
    ------
    SettingsError
        If the path does not end in .tif or .tiff.
    GlshadowError
        If it cannot be written, or rasterio is not installed.
    """
    path = as_path("path", path)
    if path.suffix.lower() not in SUFFIXES:
        raise refuse("path", f"a file that ends in {' or '.join(SUFFIXES)}", str(path))
    rasterio = _rasterio("writing a GeoTIFF")
    try:
        crs = None if dem.crs is None else rasterio.crs.CRS.from_user_input(dem.crs)
    except rasterio.errors.CRSError as error:
        raise SettingsError(f"crs {dem.crs!r}: {error}") from None
    count, rows, columns = values.shape
    settings = {
        "driver": "GTiff", "dtype": "float32", "nodata": float("nan"), "count": count, "height": rows, "width": columns, "crs": crs,
        "transform": rasterio.Affine(*dem.transform), "compress": "deflate", "predictor": 3, "tiled": True, "bigtiff": "if_safer",
    }  # fmt: skip
    try:
        with replacing(path) as part, rasterio.open(part, "w", **settings) as file:
            for number_, each in enumerate(values, start=1):
                file.write(each, number_)
                if names:
                    file.set_band_description(number_, names[number_ - 1])
    except rasterio.errors.RasterioError as error:
        raise GlshadowError(f"{path} cannot be written: {error}") from error
    return path


def _rasterio(what: str) -> Any:
    required(what, "terrain", "rasterio")
    import rasterio

    return rasterio
