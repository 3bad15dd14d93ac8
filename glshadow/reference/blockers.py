"""Which node keeps a light from a point, and how far away it is, by rays in float64; for given points and for the pixels of an image."""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from glshadow.arguments import checked_scene
from glshadow.core.cameras import Camera
from glshadow.core.setting import as_floats, numbers_in, refuse
from glshadow.core.spaces import FARTHEST, Array, Bools
from glshadow.errors import SettingsError
from glshadow.lights import Light, Lights, as_lights
from glshadow.reference.aimed import TOGETHER, AimedLight
from glshadow.reference.capsules import CapsuleRays, has_capsules
from glshadow.reference.embree import Ints
from glshadow.reference.rays import Rays
from glshadow.reference.trace import rays_of, shown_surfaces
from glshadow.scene.nodes import Scene


@dataclass(frozen=True, eq=False)
class Blockers:
    """What keeps lights from points.

    Attributes
    ----------
    node : (L, N) int32
        Index in `scene.nodes` of the first node that the ray from the point to the light's centre meets: the one nearest to the point, not
        to the light. -1: the ray is free. A point on a triangle that faces away from the light has its own node, at distance 0.
    distance : (L, N) float64
        From the point along the ray, world units; infinite where it is free.
    triangle : (L, N) int32
        Scene-wide number of the triangle, as in `Frame.triangle`; -1: the ray is free.
    """

    node: Ints
    distance: Array
    triangle: Ints


def blockers(
    scene: Scene,
    points: ArrayLike,
    lights: Lights = None,
    normals: ArrayLike | None = None,
    triangles: ArrayLike | None = None,
) -> Blockers:
    """Which node keeps each light from each point, by rays to the light's centre: Embree's hits, decided in float64.

    The rules are those of `trace`: what blends is no caster, a node that does not receive is never in shadow, a light with `shadow=None` is
    never blocked. A spot's cone and a light's range do not matter.

    Parameters
    ----------
    scene : Scene
    points : (N, 3) floats
        World positions.
    lights : Light or sequence of Light, optional
        None: the scene's own.
    normals : (N, 3) floats, optional
        Point to the side of its triangle on which each point lies. None: the front.
    triangles : (N,) ints, optional
        The triangle on which each point lies, by scene-wide number as in `Frame.triangle`; it does not block the point. -1, or None for
        all: the point lies on none; triangles whose planes contain it up to float32's rounding do not block it.

    Returns
    -------
    Blockers

    Raises
    ------
    SettingsError
        For arrays of another shape, numbers of no triangle, or normals without triangles.
    SceneError
        If the scene is not a Scene.
    ReferenceUnavailable
        If embreex is not installed.
    """
    scene = checked_scene(scene)
    places = _vectors("points", points, None)
    if (np.abs(places) > FARTHEST).any():
        raise SettingsError(f"points must be within {FARTHEST:g} of zero")
    chosen = scene.lights if lights is None else as_lights("lights", lights)
    own = _numbers(scene, triangles, len(places))
    if normals is not None and triangles is None:
        raise SettingsError("normals need triangles: they say on which side of its triangle a point lies")
    sides = None if normals is None else _vectors("normals", normals, len(places))
    low, high = scene.extent
    middle = np.clip(places.mean(axis=0), low, high) if len(places) else low
    rays = (CapsuleRays if has_capsules(scene) else Rays)(scene, middle)
    triangle, distance = _nearest(rays, chosen, own, places - rays.origin, sides)
    return Blockers(_owners(rays, triangle), distance, triangle)


def pixel_blockers(
    scene: Scene, camera: Camera, lights: tuple[Light, ...], triangle: Ints
) -> tuple[Ints, NDArray[np.float32]]:
    """Nodes and distances (L, H, W) as of `Blockers`, at the centres of an image's pixels.

    Parameters
    ----------
    triangle : (H, W) int32
        The triangles that the image shows; -1: no surface, there the node is -1 and the distance NaN.
    """
    height, width = triangle.shape
    shape = (len(lights), height, width)
    node, distance = np.full(shape, -1, dtype=np.int32), np.full(shape, np.nan, dtype=np.float32)
    known = triangle >= 0
    if known.any():
        rays = rays_of(scene, camera)
        hits = shown_surfaces(rays, camera, (width, height), triangle)
        found, far = _nearest(rays, lights, hits.triangle[hits.rows], hits.points, hits.normals)
        node[:, known], distance[:, known] = _owners(rays, found), far
    return node, distance


def node_shadows(scene: Scene, camera: Camera, light: Light, triangle: Ints, nodes: list[int], attached: bool) -> Bools:
    """For each of some nodes the pixels (K, H, W) whose ray to the light's centre meets it, wherever on the ray.

    Parameters
    ----------
    triangle : (H, W) int32
        The triangles that the image shows.
    attached : bool
        Whether surfaces of the node that face away from the light count.
    """
    height, width = triangle.shape
    masks = np.zeros((len(nodes), height, width), dtype=bool)
    known = triangle >= 0
    if light.shadow is None or not known.any():
        return masks
    rays = rays_of(scene, camera)
    hits = shown_surfaces(rays, camera, (width, height), triangle)
    own = hits.triangle[hits.rows]
    source = AimedLight(light, rays.origin)
    receivers = source.receivers(rays, own, hits.points, hits.normals, False)
    aim, end = source.towards(receivers.points)
    tested = receivers.open_to(aim) & rays.receives[own]
    boxes = dict(zip(scene.drawn.tolist(), scene.corners, strict=True))
    for mask, number in zip(masks, nodes, strict=True):
        marked = np.zeros(len(own), dtype=bool)
        if number in boxes and scene.nodes[number].casts and not scene.nodes[number].blends:
            margin = 1e-5 * rays.size  # above float32's rounding
            low, high = (
                boxes[number].min(axis=0) - rays.origin - margin,
                boxes[number].max(axis=0) - rays.origin + margin,
            )
            rows = np.flatnonzero(tested)
            rows = rows[_meets(low, high, receivers.points[rows], aim[rows], end[rows])]
            if len(rows):
                alone = _casting_alone(rays, number)
                marked[rows] = receivers.blocked(alone, aim[rows], end[rows], rows)
            if attached:
                marked |= ~receivers.open_to(aim) & rays.receives[own] & (rays.node[own] == number)
        mask[known] = marked
    return masks


def _nearest(
    rays: Rays, lights: tuple[Light, ...], own: Ints, points: Array, sides: Array | None
) -> tuple[Ints, Array]:
    """Triangles and distances (L, N)."""
    count = len(own)
    triangle, distance = np.full((len(lights), count), -1, dtype=np.int32), np.full((len(lights), count), np.inf)
    step = max(TOGETHER, 1 << 18)
    for number, light in enumerate(lights):
        source = AimedLight(light, rays.origin)
        for k in range(0, count if light.shadow is not None else 0, step):
            part = slice(k, min(k + step, count))
            given = None if sides is None else sides[part]
            triangle[number, part], distance[number, part] = _of_light(rays, source, own[part], points[part], given)
    return triangle, distance


def _of_light(rays: Rays, source: AimedLight, own: Ints, points: Array, sides: Array | None) -> tuple[Ints, Array]:
    triangle, distance = np.full(len(own), -1, dtype=np.int32), np.full(len(own), np.inf)
    free = np.flatnonzero(own < 0)
    if len(free):
        aim, end = source.towards(points[free])
        triangle[free], distance[free] = rays.blockers(own[free], points[free], aim, end)
    placed = np.flatnonzero((own >= 0) & rays.receives[own])
    if len(placed) == 0:
        return triangle, distance
    mine = own[placed]
    side = _fronts(rays, mine, points[placed]) if sides is None else sides[placed]
    receivers = source.receivers(rays, mine, points[placed], side, False)
    aim, end = source.towards(receivers.points)
    open_to = receivers.open_to(aim)
    rows = np.flatnonzero(open_to)
    found = rays.blockers(mine[rows], receivers.points[rows], aim[rows], end[rows], receivers.lifted[rows])
    triangle[placed], distance[placed] = np.where(open_to, np.int32(-1), mine), np.where(open_to, np.inf, 0.0)
    triangle[placed[rows]], distance[placed[rows]] = found
    return triangle, distance


def _fronts(rays: Rays, triangle: Ints, points: Array) -> Array:
    mirrored = np.array([np.linalg.det(node.world_from_mesh[:3, :3]) < 0.0 for node in rays.scene.nodes])
    return np.where(mirrored[rays.node[triangle], None], -1.0, 1.0) * rays.facing(triangle, points)


def _owners(rays: Rays, triangle: Ints) -> Ints:
    return np.where(triangle >= 0, rays.node[triangle], np.int32(-1)).astype(np.int32)


def _casting_alone(rays: Rays, number: int) -> Rays:
    """The same rays, but that only one node casts shadows."""
    alone = copy(rays)
    for name in ("casts", "_casting", "_casting_boxes"):
        vars(alone).pop(name, None)
    vars(alone)["casting"] = np.arange(len(rays.scene.nodes)) == number
    return alone


def _meets(low: Array, high: Array, starts: Array, directions: Array, length: Array) -> Bools:
    """Whether rays meet a box."""
    with np.errstate(divide="ignore", invalid="ignore"):
        one, other = (low - starts) / directions, (high - starts) / directions
    # NaN: the ray runs within a side of the box
    near = np.where(np.isnan(one), -np.inf, np.fmin(one, other)).max(axis=1)
    far = np.where(np.isnan(one), np.inf, np.fmax(one, other)).min(axis=1)
    return np.asarray((near <= far) & (far >= 0.0) & (near <= length))


def _vectors(name: str, value: Any, count: int | None) -> Array:
    array = as_floats(value, (count, 3))
    if array is None or not np.isfinite(array).all():
        raise refuse(name, f"an array ({'N' if count is None else count}, 3) of finite numbers", value)
    return array


def _numbers(scene: Scene, value: Any, count: int) -> Ints:
    if value is None:
        return np.full(count, -1, dtype=np.int32)
    array, total = numbers_in(value), sum(node.mesh.count for node in scene.nodes)
    if array is None or array.dtype.kind not in "iu" or array.shape != (count,):
        raise refuse("triangles", f"an array ({count},) of integers, a triangle's number for each point or -1", value)
    if count and (array.min() < -1 or array.max() >= total):
        wrong = int(array.min() if array.min() < -1 else array.max())
        raise SettingsError(f"triangles must be numbers of the scene's {total} triangles, or -1 for none: got {wrong}")
    return array.astype(np.int32)
