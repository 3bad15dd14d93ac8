"""Traces the visibility of every light at every pixel with Embree."""

from __future__ import annotations

from dataclasses import dataclass
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from glshadow.arguments import DEFAULT_SIZE, frame_arguments
from glshadow.core.cameras import Camera
from glshadow.core.sampling import DEFAULT_SAMPLES, offsets, traced
from glshadow.core.setting import shown, whole
from glshadow.core.spaces import Array, Bools
from glshadow.errors import SettingsError
from glshadow.lights import Lights
from glshadow.reference.aimed import AimedLight
from glshadow.reference.capsules import CapsuleRays, has_capsules
from glshadow.reference.embree import Ints, dot
from glshadow.reference.rays import Rays
from glshadow.reference.truth import Truth
from glshadow.scene.nodes import Scene

SAMPLES = whole(1, 1 << 16)

# The last acceleration structure of each living scene: a study traces it repeatedly.
_rays: WeakKeyDictionary[Scene, Rays] = WeakKeyDictionary()


def trace(
    scene: Scene,
    camera: Camera | None = None,
    lights: Lights = None,
    size: tuple[int, int] = DEFAULT_SIZE,
    samples: int | None = None,
    light_samples: int = 1,
    surface: Ints | None = None,
) -> Truth:
    """Trace the exact shadows of an image.

    A point is in shadow iff the open segment from it to the light meets a triangle, a ball or a tube, and unlit if the geometric normal
    that faces the viewer points away from the light. A point of a smooth mesh is moved by its vertex normals, see `geometry.smooth`, and
    is unlit if the interpolated normal points away. Surfaces are two-sided, but the camera sees through back faces that
    their material culls. A node that does not receive is never in shadow; one that does not cast
    shadows nothing. MASK materials have no surface where alpha is below the cutoff (alpha sampled bilinearly at the finest level);
    what blends is neither seen nor a caster; a light with `shadow=None` is never blocked. Outside a spot's cone and behind a
    RectLight visibility is 0; range and strength do not affect it (see `Truth.reached`).

    Parameters
    ----------
    scene : Scene
    camera, lights : optional
        None: the scene's own.
    size : (2,) ints
        Width and height.
    samples : int, optional
        Rays through each pixel, a grid: the counts of an image (1, 4, 8, 16), or another square number. None: 4, the default of images; 1
        with `surface`. Visibility is the mean of rays that meet a surface, alpha their share; everything else is that of the pixel's
        centre.
    light_samples : int
        Points on each light that has a size (a radius, an angle, an area, the sky), stratified and rotated at random (but reproducibly)
        from pixel to pixel. 1: its middle, a hard shadow.

    surface : (H, W) int32, optional
        The triangles that an image shows (`Frame.triangle`), used instead of the first hits of exact rays: at silhouettes an image may show
        another triangle. Points are the intersections of the rays with the triangles' planes, or the nearest points of the triangles where
        the rays miss them. An image's filter and its reference are then compared at the same points.

    Raises
    ------
    ReferenceUnavailable
        If embreex is not installed.
    SettingsError
        If the camera, the lights, the size or a sample count is not allowed.
    SceneError
        If the scene is not a Scene.
    """
    camera, lights, size = frame_arguments(scene, camera, lights, size)
    if samples is None:
        samples = DEFAULT_SAMPLES if surface is None else 1
    samples, light_samples = traced("samples", samples), SAMPLES("light_samples", light_samples)
    if surface is not None:
        surface = _checked_surface(surface, scene, size, samples)
    rays = rays_of(scene, camera)
    sources = [AimedLight(light, rays.origin) for light in lights]
    hits = _surfaces(rays, camera, size, (0.5, 0.5)) if surface is None else shown_surfaces(rays, camera, size, surface)
    generator = np.random.default_rng(20)
    seen = np.zeros(len(hits.triangle))
    total, spread = np.zeros((2, len(lights), len(hits.triangle)))
    for offset in offsets(samples).tolist():
        part = hits if samples == 1 else _surfaces(rays, camera, size, tuple(offset))
        seen[part.rows] += 1.0
        if len(part.rows) == 0:
            continue
        for number, source in enumerate(sources):
            mean, variance = source.visibility(
                rays, part.triangle[part.rows], part.points, part.normals, light_samples, generator
            )
            total[number, part.rows] += mean
            spread[number, part.rows] += variance
    count = np.where(seen > 0, seen, np.nan)
    shape = (len(lights), size[1], size[0])
    facts = [_facts(rays, source, hits) for source in sources]
    return Truth(
        visibility=(total / count).astype(np.float32).reshape(shape),
        cosine=np.array([cosine for cosine, _ in facts], dtype=np.float32).reshape(shape),
        reached=np.array([reached for _, reached in facts], dtype=bool).reshape(shape),
        triangle=hits.triangle.reshape(shape[1:]),
        node=np.where(hits.triangle >= 0, rays.node[hits.triangle], np.int32(-1)).reshape(shape[1:]),
        position=_spread(hits, hits.points + rays.origin).reshape(*shape[1:], 3),
        normal=_spread(hits, hits.normals).reshape(*shape[1:], 3),
        alpha=(seen / samples).astype(np.float32).reshape(shape[1:]),
        samples=samples,
        light_samples=light_samples,
        variance=(spread / count).astype(np.float32).reshape(shape) if light_samples > 1 else None,
        scene=scene,
        camera=camera,
        lights=lights,
        size=size,
        rays=rays,
    )


def _checked_surface(surface: Ints, scene: Scene, size: tuple[int, int], samples: int) -> Ints:
    shape = (size[1], size[0])
    if not isinstance(surface, np.ndarray) or surface.dtype.kind not in "iu" or surface.shape != shape or samples > 1:
        raise SettingsError(
            f"surface must be an array of integers with one triangle per pixel, for one sample: got {shown(surface)} for "
            f"{shape} (height, width) and samples {samples}"
        )
    count = sum(node.mesh.count for node in scene.nodes)
    if surface.max() >= count:
        raise SettingsError(
            f"surface must hold indices of the scene's {count} triangles from 0, or -1 for none, got {int(surface.max())}"
        )
    return surface.astype(np.int32)


def rays_of(scene: Scene, camera: Camera) -> Rays:
    """The scene's acceleration structure, relative to the point of its box nearest to the eye, for precision near the camera."""
    origin = np.clip(np.asarray(camera.position), *scene.extent)
    rays = _rays.get(scene)
    if rays is None or not np.array_equal(rays.origin, origin):
        rays = (CapsuleRays if has_capsules(scene) else Rays)(scene, origin)
        _rays[scene] = rays
    return rays


@dataclass(frozen=True)
class Hits:
    """Visible surfaces: `rows` (N,) are the pixels that see one, with `points` and `normals` (N, 3)."""

    triangle: Ints  # (H * W,)
    rows: NDArray[np.int64]
    points: Array
    normals: Array


def _surfaces(rays: Rays, camera: Camera, size: tuple[int, int], offset: tuple[float, float]) -> Hits:
    origins, directions = (each.reshape(-1, 3) for each in camera.rays(size, offset))
    starts = origins - rays.origin + directions * (camera.near or 0.0)
    length = np.full(len(directions), np.inf if camera.far is None else camera.far - (camera.near or 0.0))
    triangle, points = rays.first_hits(starts, directions, length, camera=True)
    rows = np.flatnonzero(triangle >= 0)
    normals = rays.facing(triangle[rows], points[rows])
    away = dot(normals, directions[rows]) > 0.0
    return Hits(triangle, rows, points[rows], np.where(away[:, None], -normals, normals))


def shown_surfaces(rays: Rays, camera: Camera, size: tuple[int, int], surface: Ints) -> Hits:
    triangle = surface.ravel().astype(np.int32)
    rows = np.flatnonzero(triangle >= 0)
    origins, directions = (each.reshape(-1, 3)[rows] for each in camera.rays(size))
    own, eye = triangle[rows], origins - rays.origin
    corners, normals = rays.corners[own], rays.normals[own]
    depth = (corners - eye[:, None]) @ -camera.view_from_world[2, :3]  # directions have unit view depth
    slant = dot(normals, directions)
    along = dot(normals, corners[:, 0] - eye) / np.where(slant == 0.0, 1.0, slant)
    points = eye + np.clip(along, depth.min(axis=1), depth.max(axis=1))[:, None] * directions
    points -= normals * dot(normals, points - corners[:, 0])[:, None]
    points = _onto(points, corners, normals)
    points, normals = rays.shown(own, eye, directions, points, np.where((slant > 0.0)[:, None], -normals, normals))
    return Hits(triangle, rows, points, normals)


def _onto(points: Array, corners: Array, normals: Array) -> Array:
    """The points, which are in the planes of triangles, moved to the triangles (N, 3) if they are outside by more than rounding."""
    following = np.roll(corners, -1, axis=1)
    along, offset = following - corners, points[:, None] - corners
    inside = np.einsum("nkj,nj->nk", np.cross(along, offset), normals)
    length2 = (along * along).sum(axis=-1)
    outside = np.flatnonzero((inside < -1e-6 * length2).any(axis=1))
    if len(outside) == 0:
        return points
    along, offset, length2 = along[outside], offset[outside], length2[outside]
    share = np.clip((along * offset).sum(axis=-1) / np.where(length2 > 0.0, length2, 1.0), 0.0, 1.0)
    candidates = corners[outside] + share[..., None] * along
    nearest = ((candidates - points[outside, None]) ** 2).sum(axis=-1).argmin(axis=1)
    points = points.copy()
    points[outside] = candidates[np.arange(len(outside)), nearest]
    return points


def _spread(hits: Hits, values: Array) -> Array:
    image = np.full((len(hits.triangle), *values.shape[1:]), np.nan)
    image[hits.rows] = values
    return image


def _facts(rays: Rays, source: AimedLight, hits: Hits) -> tuple[Array, Bools]:
    """N.L (H * W,), NaN where there is no surface, and whether the light reaches the point."""
    receivers = source.receivers(rays, hits.triangle[hits.rows], hits.points, hits.normals, False)
    towards, _ = source.towards(receivers.points)
    cosine = _spread(hits, dot(receivers.normals, towards))
    reached = np.zeros(len(hits.triangle), dtype=bool)
    reached[hits.rows] = source.light.reaches(receivers.points)
    return cosine, reached
