"""Views of a light, fitted to what its shadow maps must cover. Pure float64 functions of scene, light and camera."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from typing import TYPE_CHECKING, cast

import numpy as np

from glshadow.core.cameras import Camera
from glshadow.core.spaces import Array, project, rigid_inverse, transform, view_axes
from glshadow.geometry.fitting import shaded_receivers
from glshadow.geometry.ranges import view_depth
from glshadow.shadows.fit_request import FitRequest, Fitted
from glshadow.shadows.view import Cascade, ShadowView, shadow_views

if TYPE_CHECKING:
    from glshadow.lights.distant import DistantLight
    from glshadow.shadows.fits import Cascades, Lispsm


def around(request: FitRequest, receivers: list[Array]) -> Fitted:
    """Views around receivers, or around what casters can shade of them where that is little."""
    light, shaded = request.light, None
    if light.at_infinity and any(len(points) for points in receivers):
        shaded = shaded_receivers(light.rays_to(np.zeros(3)), receivers, request.casters, *request.boxes)
    receivers, inside = (receivers, True) if shaded is None else (shaded, False)
    found = shadow_views(
        light,
        receivers,
        request.casters,
        request.clip,
        request.resolution,
        request.guard,
        fine=request.fine,
        all_inside=inside,
    )
    return Fitted(found, None if shaded is None else np.concatenate(shaded))


STABLE_SHARE = 1e-3
"""Share of the distance of stable cascades: the first slice starts no nearer."""

LEAST_SHARE = 1e-6
"""Smallest width of a view's window, as a share of the extent of what it covers."""


def cascades(request: FitRequest, settings: Cascades) -> Fitted:
    """One view for each slice; none is left out, so that their tiles stay where they are."""
    light = cast("DistantLight", request.light)  # `derive.resolved` fits no other light so
    if settings.stable:
        return Fitted(_snapped(request, settings, light), request.scene.reshape(-1, 3))
    if request.depth_tiles is None or not len(request.depth_tiles.nearest):  # not known yet: as many
        one = around(request, request.seen).views[:1]
        return Fitted(tuple(replace(each, inset=_inset(request), gutter=0) for each in one * settings.count))
    depth_tiles = request.depth_tiles
    ends = split(
        settings, float(depth_tiles.nearest.min()), float(depth_tiles.farthest.max()), request.camera.is_perspective
    )
    slices = [depth_tiles.between(near, far) for near, far in pairwise(ends)]
    points = np.concatenate(slices)
    origin = 0.5 * (points.min(axis=0) + points.max(axis=0))
    axes = _along_view(light, request.camera)
    shade = (request.casters - origin) @ axes[:2].T
    depth = light.depth_range(points, request.casters, axes, origin)
    least = LEAST_SHARE * max(float(np.ptp(points, axis=0).max()), 1e-300)
    found = []
    for number, inside in enumerate(slices):
        flat = (inside - origin) @ axes[:2].T if len(inside) else np.zeros((1, 2))
        low, high = (
            np.maximum(flat.min(axis=0), shade.min(axis=0)),
            np.minimum(flat.max(axis=0), shade.max(axis=0)),
        )
        if (low >= high).any():  # nothing casts a shadow there
            low, high = flat.min(axis=0), flat.max(axis=0)
        half = 0.5 * np.maximum(high - low, least) * _widened(request)
        found.append(
            _cascade(request, settings, rigid_inverse(axes, origin), 0.5 * (low + high), half, depth, ends, number)
        )
    return Fitted(tuple(found), points)


def split(settings: Cascades, near: float, far: float, perspective: bool = True) -> list[float]:
    """Start and end depths of the slices. An orthographic camera gets slices of equal depth."""
    share = np.arange(settings.count + 1) / settings.count
    even = near + (far - near) * share
    if perspective and near > 0.0:
        even = settings.split * near * (far / near) ** share + (1.0 - settings.split) * even
    return [near, *(float(each) for each in even[1:-1]), far]


def _snapped(request: FitRequest, settings: Cascades, light: DistantLight) -> tuple[ShadowView, ...]:
    """Squares of a size that depends on the camera's lens alone, at whole texels of a lattice that depends on the scene alone."""
    camera, corners = request.camera, request.scene.reshape(-1, 3)
    origin = 0.5 * (corners.min(axis=0) + corners.max(axis=0))
    last = settings.distance or _power_of_two(request.far, 1.0)
    first = min(max(_power_of_two(request.near, 0.0), STABLE_SHARE * last), 0.5 * last)
    ends = split(settings, first, last, camera.is_perspective)
    axes = view_axes(np.asarray(light.direction))
    depth = light.depth_range(corners, request.casters, axes, origin)
    left, right, bottom, top = camera.window(request.size)
    window = np.array([(x, y) for x in (left, right) for y in (bottom, top)])
    found = []
    for number, (start, end) in enumerate(pairwise(ends)):
        scales = (start, end) if camera.is_perspective else (1.0, 1.0)
        local = np.concatenate(
            [np.column_stack([window * s, np.full(4, -d)]) for s, d in zip(scales, (start, end), strict=True)]
        )
        centre = local.mean(axis=0)
        reach = float(np.linalg.norm(local - centre, axis=1).max())
        # of seven bits, so that whole texels, and sums of them, are exact; and one more for the step from `centre` to the lattice
        texel = _rounded_up(2.0 * (1.0 + 2.0 / request.resolution) * reach * _widened(request) / request.resolution)
        half = 0.5 * texel * request.resolution
        world = camera.view_from_world[:3, :3].T @ (centre - camera.view_from_world[:3, 3])
        middle = np.floor((world - origin) @ axes[:2].T / texel) * texel
        view = rigid_inverse(axes, origin)
        found.append(_cascade(request, settings, view, middle, np.full(2, half), depth, ends, number))
    return tuple(found)


def warped(request: FitRequest, settings: Lispsm, plain: Fitted) -> Fitted:
    """One view in perspective along the camera's view; `plain`, that of a single cascade, where perspective gives no smaller texels."""
    if not plain.views:
        return plain
    view = replace(plain.views[0], cascade=None)
    depth_tiles, camera = request.depth_tiles, request.camera
    if depth_tiles is None or not len(depth_tiles.nearest) or not camera.is_perspective:
        return Fitted((view,), plain.shaded)
    axes, origin = view.view_from_world[:3, :3], -view.view_from_world[:3, :3].T @ view.view_from_world[:3, 3]
    near, far = float(depth_tiles.nearest.min()), float(depth_tiles.farthest.max())
    local = _inside(view, transform(view.view_from_world, depth_tiles.between(near, far)).reshape(-1, 8, 3))
    sine = float(np.linalg.norm(axes[:2] @ camera.view_from_world[2, :3]))
    if not len(local) or sine < 1e-3:
        return Fitted((view,), plain.shaded)
    depth = np.clip(view_depth(camera, local @ axes + origin), near, far)
    low, high = float(local[:, 1].min()), float(local[:, 1].max())
    start = float(depth.min())
    distance = (start if settings.psm else start + np.sqrt(start * (start + (high - low) * sine))) / sine
    casters = (request.casters - origin) @ axes.T
    made = _in_perspective(request, view, local, float(casters[:, 2].max()), low, float(distance))
    better = _texels(made, local, depth) < _texels(view, local, depth)
    return Fitted((made if better else view,), plain.shaded)


def _inside(view: ShadowView, depth_tiles: Array) -> Array:
    """Corners (M * 8, 3) of boxes around what lies in a view's window of blocks (B, 8, 3), given by their corners in the view.

    Parts outside are not shaded. Boxes rather than inside corners: a block may cover the window without a corner in it.
    """
    left, right, bottom, top = view.window
    low = np.maximum(depth_tiles.min(axis=1), (left, bottom, -np.inf))
    high = np.minimum(depth_tiles.max(axis=1), (right, top, np.inf))
    held = (low <= high).all(axis=1)
    ends = np.stack([low[held], high[held]], axis=1)
    return np.stack([ends[:, [i, j, k], [0, 1, 2]] for i in (0, 1) for j in (0, 1) for k in (0, 1)], axis=1).reshape(
        -1, 3
    )


def _in_perspective(
    request: FitRequest, view: ShadowView, local: Array, highest: float, low: float, distance: float
) -> ShadowView:
    """A view around points (N, 3) in it; the centre of projection is `distance` in front of the nearest, at y = `low`.

    w = 1 + (y - low) / distance; x / w, -distance / w and z / w: unchanged in size at w = 1. Includes casters up to `highest`.
    """
    warp = np.array(
        [[1, 0, 0, 0], [0, 0, 0, -distance], [0, 0, 1, 0], [0, 1 / distance, 0, 1 - low / distance]], dtype=np.float64
    )
    ahead = project(warp, local)
    flat, w = ahead[:, :3] / ahead[:, 3:], ahead[:, 3]
    ends = np.concatenate([-flat[:, 2], -highest / np.array([w.min(), w.max()])])
    pad = 1e-3 * float(np.ptp(ends))
    lowest, greatest = flat[:, :2].min(axis=0), flat[:, :2].max(axis=0)
    least = LEAST_SHARE * max(float(np.ptp(local, axis=0).max()), distance)
    half, middle = 0.5 * np.maximum(greatest - lowest, least) * _widened(request), 0.5 * (greatest + lowest)
    left, bottom, right, top = map(float, (*(middle - half), *(middle + half)))
    near, far = float(ends.min()) - pad, float(ends.max()) + pad
    return replace(view, window=(left, right, bottom, top), near=near, far=far, warp=warp)


def _texels(view: ShadowView, local: Array, depth: Array) -> float:
    """Mean over points of a texel's larger side per unit of their depth: about its width in pixels."""
    x, y = view.texel
    if view.warp is None:
        return float((max(x, y) / depth).mean())
    w = local @ view.warp[3, :3] + view.warp[3, 3]
    return float((np.maximum(x * w, y * w**2) / depth).mean())


def _inset(request: FitRequest) -> int:
    return request.guard if request.resolution > 4 * request.guard else 0


def _widened(request: FitRequest) -> float:
    """What a window grows by for two guard bands: the filter is exact within one, and only reads the other."""
    inner = request.resolution - 4 * request.guard
    return request.resolution / inner if inner > 0 else 1.0


def _along_view(light: DistantLight, camera: Camera) -> Array:
    """Axes of a directional light, the second along the camera's view: slices of a frustum are narrow across it."""
    axes = view_axes(np.asarray(light.direction))
    forward = axes[:2] @ -camera.view_from_world[2, :3]
    if np.linalg.norm(forward) < 1e-6:
        forward = axes[:2] @ camera.view_from_world[1, :3]
    x, y = forward / np.linalg.norm(forward)
    return np.asarray(np.array([[y, -x, 0.0], [x, y, 0.0], [0.0, 0.0, 1.0]]) @ axes)


def _cascade(
    request: FitRequest,
    settings: Cascades,
    view: Array,
    middle: Array,
    half: Array,
    depth: tuple[float, float],
    ends: list[float],
    number: int,
) -> ShadowView:
    depth_of = -request.camera.view_from_world[2]
    cascade = Cascade(ends[number], ends[number + 1], settings.blend, settings.by_depth, depth_of)
    left, bottom, right, top = map(float, (*(middle - half), *(middle + half)))
    return ShadowView(
        "orthographic", 0, view, (left, right, bottom, top), *depth, request.clip, request.resolution,
        inset=_inset(request), cascade=cascade,
    )  # fmt: skip


def _power_of_two(value: float, up: float) -> float:
    """The next power of two below, or above (`up` 1): a value that a moving camera rarely changes."""
    return float(2.0 ** (np.floor(np.log2(max(value, 1e-30))) + up))


def _rounded_up(value: float) -> float:
    """Rounded up to one of 64 steps between powers of two, so that rounding errors do not change it."""
    step = 2.0 ** (np.floor(np.log2(value)) - 6.0)
    return float(np.ceil(value / step) * step)
