"""ShadowOutline: a shadow's polygons in a plane, as arrays, shapely geometry, GeoJSON and SVG."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from os import PathLike
from typing import Any

import numpy as np

from glshadow.core.setting import as_floats, as_path, optional, refuse, text, vector
from glshadow.core.spaces import Array, Bools
from glshadow.errors import SettingsError
from glshadow.files import replacing
from glshadow.lights import Light
from glshadow.outlines.planes import Plane
from glshadow.outlines.regions import import_shapely


@dataclass(frozen=True, eq=False, repr=False)
class ShadowOutline:
    """The part of a plane that casters keep a light from.

    Attributes
    ----------
    geometry : shapely.MultiPolygon
        Polygons with holes in the plane's coordinates (u, v), world units; exteriors counter-clockwise seen from the tip of the normal.
        For a horizontal plane u is x and v is -z: east and north. Empty if there is no shadow.
    area : float
        Square world units.
    origin : (3,) float64
        World point with coordinates (0, 0).
    axes : (2, 3) float64
        Unit vectors of u and v in the world.
    normal : (3,) float64
        Unit normal, cross(u, v).
    light : Light
    nodes : tuple of str
        Names of the casters whose shadow falls on the plane.
    """

    geometry: Any
    area: float
    origin: Array
    axes: Array
    normal: Array
    light: Light
    nodes: tuple[str, ...]

    @property
    def polygons(self) -> tuple[tuple[Array, tuple[Array, ...]], ...]:
        """For each polygon its exterior (N, 2) and its holes, each (M, 2): coordinates in the plane, first and last point equal."""
        return tuple(
            (_ring(each.exterior), tuple(_ring(hole) for hole in each.interiors)) for each in self.geometry.geoms
        )

    @property
    def world(self) -> tuple[tuple[Array, tuple[Array, ...]], ...]:
        """As `polygons`, of world points (N, 3)."""
        plane = self._plane
        return tuple(
            (plane.lifted(exterior), tuple(plane.lifted(hole) for hole in holes)) for exterior, holes in self.polygons
        )

    def contains(self, points: Any) -> Bools:
        """Whether points are in the shadow: coordinates (..., 2) in the plane, or world points (..., 3), which are moved along the normal.

        Raises
        ------
        SettingsError
            For another shape, or what is not a number.
        """
        given = as_floats(points, (..., 2))
        if given is None:
            world = as_floats(points, (..., 3))
            if world is None:
                raise refuse("points", "an array (..., 2) or (..., 3) of numbers", points)
            given = self._plane.coordinates(world)
        return np.asarray(import_shapely().contains_xy(self.geometry, given[..., 0], given[..., 1]))

    def to_geojson(
        self,
        path: str | PathLike[str] | None = None,
        crs: str | None = None,
        offset: Sequence[float] = (0.0, 0.0),
    ) -> dict[str, Any]:
        """A GeoJSON FeatureCollection of one MultiPolygon (RFC 7946), with properties `area`, `nodes` and `light`.

        Parameters
        ----------
        path : optional
            Also write it there: .geojson or .json.
        crs : str, optional
            Name of the coordinate reference system, such as "EPSG:25832", written as the member `crs` of GeoJSON 2008, which QGIS and GDAL
            read. Coordinates are not converted. None: not written; readers then take coordinates for longitude and latitude.
        offset : (2,) floats
            Added to coordinates: easting and northing of (0, 0).

        Raises
        ------
        SettingsError
            For another suffix, or values that are not allowed.
        GlshadowError
            If the file cannot be written.
        """
        shapely = import_shapely()
        crs = optional(text(), "not written")("crs", crs)
        moved = shapely.transform(self.geometry, lambda each: each + vector(2)("offset", offset))
        feature = {
            "type": "Feature",
            "geometry": json.loads(shapely.to_geojson(moved)),
            "properties": {
                "area": self.area,
                "nodes": list(self.nodes),
                "light": self.light.spelling,
            },
        }
        collection: dict[str, Any] = {"type": "FeatureCollection", "features": [feature]}
        if crs is not None:
            collection["crs"] = {"type": "name", "properties": {"name": _urn(crs)}}
        if path is not None:
            _write(path, (".geojson", ".json"), json.dumps(collection))
        return collection

    def to_svg(self, path: str | PathLike[str] | None = None, fill: str = "#404040") -> str:
        """An SVG drawing, v up, in world units, with a margin of a fiftieth.

        Parameters
        ----------
        path : optional
            Also write it there: .svg.
        fill : str
            Colour of the shadow, as SVG has them.

        Raises
        ------
        SettingsError
            For another suffix, or a colour that is not plain text.
        GlshadowError
            If the file cannot be written.
        """
        fill = text()("fill", fill)
        if any(each in fill for each in "\"'<>&"):
            raise refuse("fill", "a colour such as #404040 or black", fill)
        (left, bottom), (right, top) = self._box
        margin = 0.02 * max(right - left, top - bottom)
        middle = np.array([0.5 * (left + right), 0.5 * (bottom + top)])
        width, height = right - left + 2.0 * margin, top - bottom + 2.0 * margin
        drawn = []
        for exterior, holes in self.polygons:
            for ring in (exterior, *holes):
                points = (ring[:-1] - middle) * (1.0, -1.0)
                drawn.append("M" + "L".join(f"{x:.12g} {y:.12g}" for x, y in points.tolist()) + "Z")
        drawing = (
            f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="{-0.5 * width:.12g} {-0.5 * height:.12g} {width:.12g} {height:.12g}">\n'
            f'<path fill="{fill}" fill-rule="evenodd" d="{"".join(drawn)}"/>\n</svg>\n'
        )
        if path is not None:
            _write(path, (".svg",), drawing)
        return drawing

    @property
    def _plane(self) -> Plane:
        return Plane(self.origin, self.axes, self.normal)

    @property
    def _box(self) -> Array:
        if self.geometry.is_empty:
            return np.array([[0.0, 0.0], [1.0, 1.0]])
        return np.array(self.geometry.bounds).reshape(2, 2)

    def _repr_svg_(self) -> str:
        """In a notebook: the drawing."""
        return self.to_svg()

    def __repr__(self) -> str:
        count = len(self.geometry.geoms)
        holes = sum(len(each.interiors) for each in self.geometry.geoms)
        return (
            f"ShadowOutline({self.light.spelling} light, {count} polygon{'' if count == 1 else 's'}, "
            f"{holes} hole{'' if holes == 1 else 's'}, area {self.area:.6g})"
        )


def _ring(ring: Any) -> Array:
    return np.asarray(import_shapely().get_coordinates(ring))


def _urn(crs: str) -> str:
    """A name of a coordinate reference system as GeoJSON 2008 has it: EPSG:25832 becomes urn:ogc:def:crs:EPSG::25832."""
    authority, _, code = crs.partition(":")
    return f"urn:ogc:def:crs:{authority.upper()}::{code}" if code.isdigit() else crs


def _write(path: str | PathLike[str], suffixes: tuple[str, ...], content: str) -> None:
    target = as_path("path", path)
    if target.suffix.lower() not in suffixes:
        raise SettingsError(f"path must end in {' or '.join(suffixes)}, got {target.name}")
    with replacing(target) as part:
        part.write_text(content, encoding="utf-8")
