"""shadow_outline: the shadow of nodes on a plane as polygons."""

from __future__ import annotations

from typing import Any

import numpy as np

from glshadow.arguments import checked_scene, chosen_nodes
from glshadow.core.setting import as_floats, instance, refuse, shown
from glshadow.core.spaces import Array
from glshadow.errors import GlshadowError, SettingsError
from glshadow.lights import Light
from glshadow.outlines.casters import casters_of
from glshadow.outlines.planes import Plane, plane_of
from glshadow.outlines.projected import Projection
from glshadow.outlines.regions import import_shapely, united
from glshadow.outlines.result import ShadowOutline
from glshadow.scene.nodes import Scene


def shadow_outline(
    scene: Scene,
    light: Light | None = None,
    plane: Any = None,
    of: Any = None,
    bounds: Any = None,
) -> ShadowOutline:
    """The shadow of nodes on a plane: polygons with holes, exact to float64.

    Triangles are projected along the light; what lies on the far side of the plane or beyond the light casts nothing, and triangles that
    cross are clipped. What lies in the plane casts nothing. The outline is where `Frame.visibility` of `Exact()` is 0 on that plane, with
    these exceptions: a cut-out material (MASK) counts with its whole triangles, with a warning; the plane has no end, and `receives` and a
    spot's cone do not limit it. What blends casts nothing, and nodes with `casts=False` neither.

    Parameters
    ----------
    scene : Scene
    light : Light, optional
        Directional, point, spot or rectangular; of a light with a size the outline is that of its centre. None: the scene's first.
    plane : optional
        A pair (point, normal); a node that is flat, its name or its index; None: the scene's ground, or where `Scene.with_ground` would
        lay it. A plane has two sides: the light's counts.
    of : optional
        Casters: nodes, their names or indices, one or several; None: all. The node of the plane lies in it and casts nothing.
    bounds : ((u, v), (u, v)), optional
        Least and greatest coordinates in the plane to which the shadow is clipped; needed for casters that reach the light's height
        over the plane, whose shadow has no end.

    Returns
    -------
    ShadowOutline

    Raises
    ------
    SettingsError
        If the light is parallel to the plane or comes from all around, if the shadow has no end, or for arguments that are not allowed.
    SceneError
        If a caster has points or lines.
    GlshadowError
        If shapely is not installed, or fails.

    References
    ----------
    Blinn 1988, "Me and my (fake) shadow", IEEE Computer Graphics and Applications 8, for the projection.
    """
    import_shapely()
    scene = checked_scene(scene)
    light = one_light(scene, light)
    chosen = chosen_nodes("of", scene, of)
    surface = plane_of(scene, plane)
    limits = _bounds(bounds)
    projection = Projection.of(surface, light, scene.extent)
    casters = casters_of(scene, chosen, projection.middle)
    shift = surface.coordinates(projection.middle)
    near = None if limits is None else (limits - shift) * projection.scale
    try:
        shadows = {caster.name: projection.shadow(caster, near) for caster in casters}
        region = united([each for shadow in shadows.values() for each in shadow])
    except import_shapely().errors.ShapelyError as error:
        raise GlshadowError(f"{scene.name}: shapely could not unite the shadows: {error}") from error
    names = tuple(name for name, shadow in shadows.items() if shadow)
    return _result(region, projection, surface, shift, light, names)


def _result(
    region: Any, projection: Projection, plane: Plane, shift: Array, light: Light, names: tuple[str, ...]
) -> ShadowOutline:
    shapely = import_shapely()
    moved = shapely.transform(region, lambda each: each / projection.scale + shift)
    area = region.area / projection.scale**2
    return ShadowOutline(moved, area, plane.origin, plane.axes, plane.normal, light, names)


def one_light(scene: Scene, light: Any) -> Light:
    """The light of an outline; None: the scene's first."""
    if light is None:
        if not scene.lights:
            raise SettingsError("the scene has no light: give light=")
        light = scene.lights[0]
    kept: Light = instance(Light)("light", light)
    if kept.wide and kept.at_infinity:
        raise SettingsError(f"an outline needs a light from one direction or place, got {shown(kept)}")
    return kept


def _bounds(bounds: Any) -> Array | None:
    if bounds is None:
        return None
    given = as_floats(bounds, (2, 2))
    if given is None or not np.isfinite(given).all() or not (given[0] < given[1]).all():
        raise refuse("bounds", "((u, v), (u, v)), least and greatest coordinates in the plane", bounds)
    return given
