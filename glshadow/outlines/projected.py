"""Shadows of triangles on a plane: clipped to what lies between plane and light, and projected in float64."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from glshadow.core.setting import shown
from glshadow.core.spaces import Array
from glshadow.errors import SettingsError
from glshadow.lights import Light
from glshadow.outlines.casters import Caster, Indices, clip
from glshadow.outlines.planes import ROUNDED, Plane
from glshadow.outlines.regions import covered

GRAZING = 1e-9
"""Sine of the angle between a plane and the light below which the light is parallel to the plane."""
_NEAREST = 1e-12  # of the light's height over the plane: what is that near to the light's own height is left out


@dataclass(frozen=True, eq=False)
class Projection:
    """From world points to coordinates of a plane along the light, as homogeneous coordinates.

    Attributes
    ----------
    plane : Plane
    middle : (3,) float64
        Point of the plane to which all positions are relative.
    place : (4,) float64
        The light relative to `middle`: position and 1, or the direction to it and 0.
    scale : float
        A power of two that makes coordinates about 1.
    rounded : float
        World units: points that are less than this off the plane are on it.
    """

    plane: Plane
    middle: Array
    place: Array
    scale: float
    rounded: float

    @classmethod
    def of(cls, plane: Plane, light: Light, bounds: Array) -> Projection:
        """The projection of a scene with world bounds (2, 3).

        Raises
        ------
        SettingsError
            If the light is parallel to the plane.
        """
        middle = plane.foot(0.5 * (bounds[0] + bounds[1]))
        place = np.array(light.place)
        place[:3] -= place[3] * middle
        height = float(place[:3] @ plane.normal)
        size = float(np.abs(bounds - middle).max())
        reach = float(np.abs(np.concatenate([bounds, plane.origin[None]])).max()) + size
        if abs(height) <= GRAZING * float(np.linalg.norm(place[:3])) or (place[3] and abs(height) <= ROUNDED * reach):
            raise SettingsError(f"the light is parallel to the plane, on which no shadow falls then: {shown(light)}")
        return cls(plane, middle, place, float(2.0 ** -np.floor(np.log2(size))), ROUNDED * reach)

    def homogeneous(self, points: Array) -> tuple[Array, float]:
        """Rows (x, y, w, height) of points (V, 3) relative to `middle`, scaled; heights are above the plane on the light's side.

        Also the light's height; 1 for a light at infinity.
        """
        axes = np.concatenate([self.plane.axes, self.plane.normal[None]])
        u, v, h = (sum(points[:, k] * axis[k] for k in range(3)) for axis in axes)
        lu, lv, lh = (float(axis @ self.place[:3]) for axis in axes)
        h = np.where(np.abs(h) <= self.rounded, 0.0, h)
        if lh < 0.0:
            h, lh = -h, -lh
        if self.place[3] == 0.0:
            x, y, w = u - lu * (h / lh), v - lv * (h / lh), np.ones(len(h))
        else:
            x, y, w = u - lu * (h / lh), v - lv * (h / lh), 1.0 - h / lh
        return np.stack([x * self.scale, y * self.scale, w, h * self.scale], axis=1), lh * self.scale

    def shadow(self, caster: Caster, bounds: Array | None) -> list[Any]:
        """Polygons in scaled coordinates relative to `middle` whose union is a caster's shadow.

        Parameters
        ----------
        bounds : (2, 2) float64, optional
            Least and greatest coordinates, scaled and relative to `middle`, to which shadows are clipped.

        Raises
        ------
        SettingsError
            If the shadow has no end, and there are no bounds.
        """
        rows, triangles = self.projected(caster, bounds)
        if not len(triangles):
            return []
        used = np.unique(triangles)
        place = np.zeros((len(rows), 2))
        place[used] = rows[used, :2] / rows[used, 2:3]
        return covered(place, triangles)

    def projected(self, caster: Caster, bounds: Array | None) -> tuple[Array, Indices]:
        """Homogeneous rows (V, 4) and triangles (T, 3) of what lies between plane and light."""
        rows, _ = self.homogeneous(caster.points)
        triangles = caster.triangles
        triangles = triangles[(rows[triangles, 3] > 0.0).any(axis=1)]
        rows, triangles = _clipped(rows, triangles, 3)
        triangles = triangles[(rows[triangles, 2] > _NEAREST).any(axis=1)]
        if len(triangles) and bounds is None and (rows[triangles, 2] <= _NEAREST).any():
            raise SettingsError(
                f"the shadow of node {caster.name!r} has no end, as it reaches the light's height over the plane: give bounds="
                f"((u, v), (u, v)), least and greatest coordinates in the plane"
            )
        if bounds is None or not len(triangles):
            return rows, triangles
        kept = rows.copy()
        kept[:, 2] -= _NEAREST
        rows, triangles = clip(rows, triangles, kept[:, 2])
        for axis in range(2):
            rows, triangles = clip(rows, triangles, rows[:, axis] - bounds[0, axis] * rows[:, 2])
            rows, triangles = clip(rows, triangles, bounds[1, axis] * rows[:, 2] - rows[:, axis])
        return rows, triangles


def _clipped(rows: Array, triangles: Indices, column: int) -> tuple[Array, Indices]:
    """Clip where a column is not negative; new vertices have 0 there."""
    count = len(rows)
    rows, triangles = clip(rows, triangles, rows[:, column])
    rows[count:, column] = 0.0
    return rows, triangles
