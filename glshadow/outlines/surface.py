"""surface_outline: the shadow on a node that is not flat, as polygons on each of its triangles."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshadow.arguments import checked_scene, chosen_nodes
from glshadow.core.setting import shown
from glshadow.core.spaces import Array, view_axes
from glshadow.errors import GlshadowError, SettingsError
from glshadow.lights import Light
from glshadow.outlines.casters import Indices, caster_of, casters_of, clip
from glshadow.outlines.outline import one_light
from glshadow.outlines.planes import ROUNDED
from glshadow.outlines.projected import GRAZING
from glshadow.outlines.regions import import_shapely, tidy
from glshadow.scene.nodes import Scene

Rings = tuple[tuple[Array, tuple[Array, ...]], ...]
_PAIRS = 1 << 18  # of triangles that are clipped at once


@dataclass(frozen=True, eq=False, repr=False)
class SurfaceOutline:
    """The shadow on the triangles of a node, each on the side that faces the light.

    Attributes
    ----------
    polygons : tuple of (exterior, holes)
        World points (N, 3) of rings, first and last equal; each polygon lies on one triangle.
    triangles : (K,) int64
        The triangle of each polygon, by its number in the node's mesh.
    area, facing_area : float
        Square world units in shadow, and of all triangles that are not edge-on to the light.
    light : Light
    node : str
        The node that receives the shadow.
    """

    polygons: Rings
    triangles: NDArray[np.int64]
    area: float
    facing_area: float
    light: Light
    node: str

    def __repr__(self) -> str:
        return (
            f"SurfaceOutline({self.light.spelling} light on {self.node!r}: {len(self.polygons)} polygons, area {self.area:.6g} of "
            f"{self.facing_area:.6g})"
        )


def surface_outline(scene: Scene, onto: Any, light: Light | None = None, of: Any = None) -> SurfaceOutline:
    """The shadow of directional light on a node that is not flat, exact to float64: on each of its triangles, as on a plane of its own.

    Both sides of a triangle receive light. The node casts on itself. What casts is as for `shadow_outline`.

    Parameters
    ----------
    scene : Scene
    onto : Node, str or int
        The node that receives the shadow, its name or its index.
    light : Light, optional
        At infinity; of one with an angle, the shadow of its centre. None: the scene's first.
    of : optional
        Casters: nodes, their names or indices, one or several; None: all.

    Raises
    ------
    SettingsError
        For a light with a position, or arguments that are not allowed.
    SceneError
        If a caster or the receiver has points or lines.
    GlshadowError
        If shapely is not installed, or fails.
    """
    shapely = import_shapely()
    scene = checked_scene(scene)
    light = one_light(scene, light)
    if not light.at_infinity:
        raise SettingsError(
            f"surface_outline takes light at infinity, got {shown(light)}: use shadow_outline for a plane"
        )
    numbers = chosen_nodes("onto", scene, onto)
    if onto is None or len(numbers) != 1:
        raise SettingsError(f"onto must be one node, got {shown(onto)}")
    low, high = scene.extent
    origin = 0.5 * (low + high)
    forward = -np.asarray(light.place[:3])
    axes = view_axes(forward)
    receiver = caster_of(scene.nodes[numbers[0]], origin, every=True)
    corners = receiver.points[receiver.triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(normals, axis=1)
    slope = -(normals @ forward)
    turned = np.flatnonzero(np.abs(slope) > GRAZING * np.where(length > 0.0, length, np.inf))
    unit = normals[turned] / length[turned, None] * np.sign(slope[turned])[:, None]
    scale = 2.0 ** -np.floor(np.log2(float(np.abs(high - origin).max())))
    flat = scale * np.stack([corners[turned] @ axes[0], corners[turned] @ axes[1]], axis=-1)
    parts = [each.points[each.triangles] for each in casters_of(scene, chosen_nodes("of", scene, of), origin)]
    casting = np.concatenate([np.zeros((0, 3, 3)), *parts])
    rounded = ROUNDED * float(np.abs(np.stack([low, high])).max() + np.abs(high - low).max())
    try:
        shapes = shapely.polygons(flat)
        regions = _regions(casting, corners[turned, 0], unit, axes, scale, shapes, rounded)
    except shapely.errors.ShapelyError as error:
        raise GlshadowError(f"{scene.name}: shapely could not unite the shadows: {error}") from error
    stretch = 1.0 / (np.abs(unit @ forward) * scale**2)
    found, owners, area = [], [], 0.0
    for k, region in regions:
        area += float(region.area * stretch[k])
        for polygon in region.geoms:
            rings = [
                _lifted(shapely.get_coordinates(ring) / scale, axes, forward, corners[turned[k], 0], unit[k]) + origin
                for ring in (polygon.exterior, *polygon.interiors)
            ]
            found.append((rings[0], tuple(rings[1:])))
            owners.append(turned[k])
    facing = float((shapely.area(shapes) * stretch).sum())
    return SurfaceOutline(tuple(found), np.array(owners, dtype=np.int64), area, facing, light, receiver.name)


def _regions(
    casting: Array, feet: Array, normals: Array, axes: Array, scale: float, shapes: Any, rounded: float
) -> list[tuple[int, Any]]:
    """For each receiving triangle in shadow its number and its region, in scaled coordinates across the light.

    Parameters
    ----------
    casting : (T, 3, 3) float64
        Corners of casters.
    feet, normals : (R, 3) float64
        A point of each receiving triangle, and its normal on the side of the light.
    shapes : (R,) shapely polygons
    """
    shapely = import_shapely()
    flat = scale * np.stack([casting @ axes[0], casting @ axes[1]], axis=-1)
    boxes = shapely.box(*flat.min(axis=1).T, *flat.max(axis=1).T)
    pairs = shapely.STRtree(boxes).query(shapes)
    found: dict[int, list[Any]] = {}
    for start in range(0, pairs.shape[1], _PAIRS):
        own, other = pairs[:, start : start + _PAIRS]
        heights = np.einsum("pkj,pj->pk", casting[other] - feet[own, None], normals[own])
        heights[np.abs(heights) <= rounded] = 0.0
        above = (heights > 0.0).any(axis=1)
        own, other, heights = own[above], other[above], heights[above]
        rows = np.concatenate([flat[other].reshape(-1, 2), np.repeat(own, 3)[:, None].astype(np.float64)], axis=1)
        triangles: Indices = np.arange(len(rows), dtype=np.int64).reshape(-1, 3)
        rows, triangles = clip(rows, triangles, heights.ravel())
        owner = np.rint(rows[triangles[:, 0], 2]).astype(np.int64)
        cut = shapely.polygons(rows[triangles, :2])
        solid = shapely.area(cut) > 0.0
        cut = shapely.intersection(cut[solid], shapes[owner[solid]])
        for k, piece in zip(owner[solid].tolist(), cut, strict=True):
            if piece.area > 0.0:
                found.setdefault(k, []).append(piece)
    made = ((k, tidy(shapely.union_all(np.array(found[k], dtype=object)))) for k in sorted(found))
    return [(k, region) for k, region in made if not region.is_empty]


def _lifted(places: Array, axes: Array, forward: Array, foot: Array, normal: Array) -> Array:
    """Points (N, 3) of a triangle's plane from their coordinates (N, 2) across the light."""
    points = places @ axes[:2]
    along = ((foot - points) @ normal) / float(forward @ normal)
    return np.asarray(points + along[:, None] * forward)
