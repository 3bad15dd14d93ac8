"""Views of a light, fitted to what its maps have to cover. Pure functions of scene, light and camera, float64."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np

from glshadow.core.cameras import Camera
from glshadow.core.fit import shaded_receivers
from glshadow.core.fits import Cascades
from glshadow.core.lights import DirectionalLight, Light
from glshadow.core.spaces import Array, ClipSpace, rigid_inverse, view_axes
from glshadow.core.view import Cascade, ShadowView, shadow_views, sun_range


@dataclass(frozen=True, eq=False)
class Blocks:
    """What a camera was found to see: for each block of pixels that shows a surface, how near and how far that is.

    Parameters
    ----------
    starts, rays : (B, 4, 3) float64
        World; through the corners of each block, rays of unit view depth.
    nearest, farthest : (B,) float64
        View depths.
    """

    starts: Array
    rays: Array
    nearest: Array
    farthest: Array

    def between(self, near: float, far: float) -> Array:
        """World points (N, 3) around what lies between two depths."""
        low, high = np.maximum(self.nearest, near), np.minimum(self.farthest, far)
        some = low <= high
        depths = np.stack([low[some], high[some]], axis=1)[:, :, None, None]
        points = self.starts[some][:, None] + depths * self.rays[some][:, None]
        return np.asarray(points.reshape(-1, 3))


@dataclass(frozen=True, eq=False)
class Asked:
    """What a fit is asked for.

    Parameters
    ----------
    scene : (N, 8, 3) float64
        World corners of all bodies' boxes; `boxes`: the same as bounds and matrices.
    seen : list of N arrays (M, 3)
        World corners of what the camera sees of each.
    casters : (K, 3) float64
        World corners of everything that casts.
    size : (2,) ints
        Of the picture.
    near, far : float
        Of the camera.
    guard : int
        Texels around what is covered that a filter may reach into.
    blocks : Blocks, optional
        What is really seen, where that was found out.
    """

    light: Light
    scene: Array
    boxes: tuple[Array, Array]
    seen: list[Array]
    casters: Array
    camera: Camera
    size: tuple[int, int]
    near: float
    far: float
    clip: ClipSpace
    resolution: int
    guard: int
    blocks: Blocks | None = None


@dataclass(frozen=True, eq=False)
class Fitted:
    """Views of a light; `shaded`: world points around the receivers they are for, where these are not all that are seen."""

    views: tuple[ShadowView, ...]
    shaded: Array | None = field(default=None, repr=False)


def around(asked: Asked, receivers: list[Array]) -> Fitted:
    """Views around receivers, or around what casters can shade of them where that is little."""
    light, shaded = asked.light, None
    if isinstance(light, DirectionalLight) and any(len(points) for points in receivers):
        shaded = shaded_receivers(np.asarray(light.direction), receivers, asked.casters, *asked.boxes)
    receivers, inside = (receivers, True) if shaded is None else (shaded, False)
    found = shadow_views(light, receivers, asked.casters, asked.clip, asked.resolution, asked.guard, all_inside=inside)
    return Fitted(found, None if shaded is None else np.concatenate(shaded))


STABLE_SHARE = 1e-3
"""Of the distance that stable cascades reach: where the first begins."""


def cascades(asked: Asked, settings: Cascades) -> Fitted:
    """One view for each slice; none is left out, so that their tiles stay where they are."""
    light = asked.light
    assert isinstance(light, DirectionalLight)
    if settings.stable:
        return Fitted(_snapped(asked, settings, light), asked.scene.reshape(-1, 3))
    if asked.blocks is None or not len(asked.blocks.nearest):  # not known yet: as many
        one = around(asked, asked.seen).views[:1]
        return Fitted(tuple(replace(each, inset=_inset(asked), gutter=0) for each in one * settings.count))
    blocks = asked.blocks
    ends = split(settings, float(blocks.nearest.min()), float(blocks.farthest.max()), asked.camera.is_perspective)
    slices = [blocks.between(near, far) for near, far in pairwise(ends)]
    points = np.concatenate(slices)
    origin = 0.5 * (points.min(axis=0) + points.max(axis=0))
    axes = _along_view(light, asked.camera)
    shade = (asked.casters - origin) @ axes[:2].T
    depth = sun_range(light, points, asked.casters, axes, origin)
    least = 1e-6 * max(float(np.ptp(points, axis=0).max()), 1e-300)
    found = []
    for number, inside in enumerate(slices):
        flat = (inside - origin) @ axes[:2].T if len(inside) else np.zeros((1, 2))
        low, high = (
            np.maximum(flat.min(axis=0), shade.min(axis=0)),
            np.minimum(flat.max(axis=0), shade.max(axis=0)),
        )
        if (low >= high).any():  # nothing casts there
            low, high = flat.min(axis=0), flat.max(axis=0)
        half = 0.5 * np.maximum(high - low, least) * _widened(asked)
        found.append(
            _cascade(asked, settings, rigid_inverse(axes, origin), 0.5 * (low + high), half, depth, ends, number)
        )
    return Fitted(tuple(found), points)


def split(settings: Cascades, near: float, far: float, perspective: bool = True) -> list[float]:
    """Where slices begin and end; of an orthographic camera they are equal."""
    share = np.arange(settings.count + 1) / settings.count
    even = near + (far - near) * share
    if perspective and near > 0.0:
        even = settings.split * near * (far / near) ** share + (1.0 - settings.split) * even
    return [near, *(float(each) for each in even[1:-1]), far]


def _snapped(asked: Asked, settings: Cascades, light: DirectionalLight) -> tuple[ShadowView, ...]:
    """Squares of a size that depends on the camera's lens alone, at whole texels of a lattice that depends on the scene alone."""
    camera, corners = asked.camera, asked.scene.reshape(-1, 3)
    origin = 0.5 * (corners.min(axis=0) + corners.max(axis=0))
    reach = settings.distance or float(np.linalg.norm(np.ptp(corners, axis=0)))
    ends = split(settings, STABLE_SHARE * reach, reach, camera.is_perspective)
    axes = view_axes(np.asarray(light.direction))
    depth = sun_range(light, corners, asked.casters, axes, origin)
    left, right, bottom, top = camera.window(asked.size)
    window = np.array([(x, y) for x in (left, right) for y in (bottom, top)])
    found = []
    for number, (start, end) in enumerate(pairwise(ends)):
        scales = (start, end) if camera.is_perspective else (1.0, 1.0)
        local = np.concatenate(
            [np.column_stack([window * s, np.full(4, -d)]) for s, d in zip(scales, (start, end), strict=True)]
        )
        centre = local.mean(axis=0)
        half = _rounded_up(float(np.linalg.norm(local - centre, axis=1).max())) * _widened(asked)
        texel = 2.0 * half / asked.resolution
        world = camera.view_from_world[:3, :3].T @ (centre - camera.view_from_world[:3, 3])
        middle = np.floor((world - origin) @ axes[:2].T / texel) * texel
        view = rigid_inverse(axes, origin)
        found.append(_cascade(asked, settings, view, middle, np.full(2, half), depth, ends, number))
    return tuple(found)


def _inset(asked: Asked) -> int:
    return asked.guard if asked.resolution > 4 * asked.guard else 0


def _widened(asked: Asked) -> float:
    """What a window grows by for two guard bands: one is answered for, one only read."""
    room = asked.resolution - 4 * asked.guard
    return asked.resolution / room if room > 0 else 1.0


def _along_view(light: DirectionalLight, camera: Camera) -> Array:
    """Axes of a sun, the second along the camera's view: slices of a frustum are narrow across it."""
    axes = view_axes(np.asarray(light.direction))
    forward = axes[:2] @ -camera.view_from_world[2, :3]
    if np.linalg.norm(forward) < 1e-6:
        forward = axes[:2] @ camera.view_from_world[1, :3]
    x, y = forward / np.linalg.norm(forward)
    return np.asarray(np.array([[y, -x, 0.0], [x, y, 0.0], [0.0, 0.0, 1.0]]) @ axes)


def _cascade(
    asked: Asked,
    settings: Cascades,
    view: Array,
    middle: Array,
    half: Array,
    depth: tuple[float, float],
    ends: list[float],
    number: int,
) -> ShadowView:
    depth_of = -asked.camera.view_from_world[2]
    cascade = Cascade(ends[number], ends[number + 1], settings.blend, settings.by_depth, depth_of)
    left, bottom, right, top = map(float, (*(middle - half), *(middle + half)))
    return ShadowView(
        "directional", 0, view, (left, right, bottom, top), *depth, asked.clip, asked.resolution,
        inset=_inset(asked), cascade=cascade,
    )  # fmt: skip


def _rounded_up(value: float) -> float:
    """To the next of 64 steps between powers of two: what rounding moves stays the same number."""
    step = 2.0 ** (np.floor(np.log2(value)) - 6.0)
    return float(np.ceil(value / step) * step)
