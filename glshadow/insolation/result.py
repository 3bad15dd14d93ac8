"""SunHours: the result of `sun_hours`."""

from __future__ import annotations

import csv
import os
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from glshadow.core.setting import as_path, refuse
from glshadow.core.spaces import Array
from glshadow.files import replacing
from glshadow.scene.faces import face_starts
from glshadow.scene.nodes import Scene
from glshadow.solar.path import SunPath


@dataclass(frozen=True, eq=False, repr=False)
class SunHours:
    """Hours of direct sun of faces, vertices or points over a path.

    Attributes
    ----------
    scene : Scene
    path : SunPath
    kind : {"faces", "vertices", "points"}
    places : (N, 3) float64
        World positions: middles of faces, vertices, or the given points.
    faces : (N,) int64 or None
        Scene-wide numbers of the faces, as in `Frame.triangle`; with `cell`, of the faces that the parts are of.
    corners : (N, 3, 3) float64 or None
        World corners of the faces or parts; of vertices, those of all faces.
    areas : (N,) float64
        Areas of faces, which weight means; of vertices a third of the faces around; 1 for points.
    month_hours, month_possible : (12, N) float64
        Hours of sun by month, and hours that the sun is above the horizon and before the face.
    hour_hours, hour_possible : (24, N) float64
        The same by the hour of the day, of the clock of the path's zone.
    table_hours, table_possible : (12, 24) float64
        Means over all places, weighted by area, by month and hour.
    direct : (N,) float64 or None
        Direct irradiation, kWh/m^2; on the surface, or normal to the sun for points without normals. None without weather.
    diffuse : (N,) float64 or None
        Irradiation from a uniform sky, kWh/m^2, as far as the place sees it. None without a column dhi.
    sky_view : (N,) float64 or None
        Share of the uniform sky's light that arrives; 1 for a horizontal face that sees all of it.
    suns : int
        Directions of the sun whose shadow was computed.
    error : float
        The largest angle between a sun of the path and the direction that stands for it, degrees.
    """

    scene: Scene
    path: SunPath
    kind: str
    places: Array
    faces: NDArray[np.int64] | None
    corners: Array | None
    areas: Array
    month_hours: Array
    month_possible: Array
    hour_hours: Array
    hour_possible: Array
    table_hours: Array
    table_possible: Array
    direct: Array | None
    diffuse: Array | None
    sky_view: Array | None
    suns: int
    error: float
    hours: Array = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "hours", self.month_hours.sum(axis=0))

    def __repr__(self) -> str:
        return (
            f"SunHours({len(self.hours):,} {self.kind}, {self.mean:.1f} h in the mean of {self.possible_mean:.1f} h with the sun before "
            f"them; {self.suns} suns for {int(self.path.is_up.sum())} steps, within {self.error:.2f} degrees)"
        )

    @property
    def possible(self) -> Array:
        """(N,) float64: hours that the sun is above the horizon and before the face, shaded or not."""
        return np.asarray(self.month_possible.sum(axis=0))

    @property
    def mean(self) -> float:
        """Mean hours of sun, weighted by area."""
        return float(self.table_hours.sum())

    @property
    def possible_mean(self) -> float:
        """Mean of the possible hours, weighted by area."""
        return float(self.table_possible.sum())

    @property
    def shaded(self) -> Array:
        """(12, 24) float64: share of the possible hours that are shaded, by month and hour of the day; NaN where there is none."""
        return _share(self.table_hours, self.table_possible)

    @property
    def shaded_by_month(self) -> Array:
        """(12,) float64: shaded share of the possible hours of each month."""
        return _share(self.table_hours.sum(axis=1), self.table_possible.sum(axis=1))

    @property
    def shaded_by_hour(self) -> Array:
        """(24,) float64: shaded share of the possible hours by hour of the day."""
        return _share(self.table_hours.sum(axis=0), self.table_possible.sum(axis=0))

    @property
    def top(self) -> float:
        """Hours of the brightest colour of `images` and pages: the least round number that is not below the most hours."""
        return nice_top(float(np.nanmax(self.hours, initial=0.0)))

    def images(self, size: tuple[int, int] = (640, 480)) -> dict[str, NDArray[np.uint8]]:
        """The model with the colours of its hours, from four sides and from above with north up: caption -> (H, W, 3) uint8.

        The colours are matplotlib's inferno, from 0 to `top`.

        Raises
        ------
        SettingsError
            For points.
        GlshadowError
            Without the extra `study`.
        """
        from glshadow.insolation.page import pictures_of  # slow to import

        return pictures_of(self, size)

    def save(self, path: str | os.PathLike[str]) -> Path:
        """Write a table with one line for each face, vertex or point (.csv), or a page with images and tables, and that table too (.html).

        Raises
        ------
        SettingsError
            If the name ends in something else, or for a page of points.
        GlshadowError
            If it cannot be written; for a page also without the extra `study`.
        """
        path = as_path("path", path)
        if path.suffix.lower() in (".html", ".htm"):
            from glshadow.insolation.page import write_page  # slow to import

            return write_page(self, path)[0]
        if path.suffix.lower() != ".csv":
            raise refuse("path", "a file that ends in .csv or .html", str(path))
        columns: dict[str, NDArray[np.generic]] = {}
        if self.faces is not None:
            owner = np.searchsorted(face_starts(self.scene), self.faces, side="right") - 1
            columns["node"] = np.array([node.name for node in self.scene.nodes])[owner]
            columns["face"] = self.faces
            columns["area"] = self.areas
        columns |= dict(zip("xyz", self.places.T, strict=True))
        columns |= {"hours": self.hours, "possible_hours": self.possible}
        if self.direct is not None:
            columns["direct_kwh_m2"] = self.direct
        if self.diffuse is not None:
            columns["diffuse_kwh_m2"] = self.diffuse
        columns |= {f"hours_{name}": each for name, each in zip(MONTHS, self.month_hours, strict=True)}
        with replacing(path) as part, part.open("w", newline="", encoding="utf-8") as file:
            writer = csv.writer(file)
            writer.writerow(columns)
            for row in zip(*(each.tolist() for each in columns.values()), strict=True):
                writer.writerow([f"{each:.10g}" if isinstance(each, float) else each for each in row])
        return path


def nice_top(most: float) -> float:
    """The least of 1, 1.5, 2, 2.5, 3, 4, 5, 6, 8 times a power of ten that is not below `most`; 1 for 0."""
    if most <= 0.0:
        return 1.0
    power = 10.0 ** np.floor(np.log10(most))
    steps = (1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0)
    return float(next(step * power for step in steps if step * power >= most * (1.0 - 1e-12)))


MONTHS = ("jan", "feb", "mar", "apr", "may", "jun", "jul", "aug", "sep", "oct", "nov", "dec")


def _share(hours: Array, possible: Array) -> Array:
    share = np.full(possible.shape, np.nan)
    np.divide(hours, possible, out=share, where=possible > 0.0)
    return np.asarray(1.0 - share)
