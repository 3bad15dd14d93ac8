"""Shadow mapping in float64 numpy: the twin of caster pass and receiver, for tiny maps and a handful of triangles.

A driver may move a vertex by a fraction of a pixel and rounds every sum to float32, so the twin computes
intervals: all values that limited precision may give. Where an interval is one number, the image must show that number.

    triangles --cast--> StoredMap [low, high] per texel --receive--> visibility [low, high] per point

It mirrors glsl/pass/caster, metric, projection, bias, depth, compare and filter; one tile per view, placed in an atlas
as the renderer places them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from glshadow.core.cameras import PerspectiveCamera, pixel_rays
from glshadow.core.spaces import Array, transform
from glshadow.lights import Light
from glshadow.shadows.bias import FACET_SLOPE, SNAP_TEXELS, WINDOW_PER_CLIP, Bias
from glshadow.shadows.filters import Filter
from glshadow.shadows.metric import Target, metric_range, projected_metric, radial_metric, window_depth
from glshadow.shadows.view import ShadowView


@dataclass(frozen=True)
class Precision:
    """Error bounds of limited precision.

    Parameters
    ----------
    stored : float
        Error of a stored or a compared depth, in stored units.
    texels : float
        Error of a position on the map.
    world : float
        World units by which a receiver may be misplaced along the light; the derived bias subtracts it from the distance.
    """

    stored: float = 0.0
    texels: float = 0.0
    world: float = 0.0


@dataclass(frozen=True, eq=False)
class StoredMap:
    """An atlas (H, W), row 0 at v = 0: the minimum and the maximum value that each texel may hold."""

    views: tuple[ShadowView, ...]
    target: Target
    low: Array
    high: Array

    def tile(self, number: int) -> tuple[Array, Array]:
        """Minimum and maximum values (R, R) of one view, row 0 at its **top**, as in Frame.shadow_maps."""
        view = self.views[number]
        x, y = view.tile
        block = np.s_[y : y + view.resolution, x : x + view.resolution]
        return self.low[block][::-1], self.high[block][::-1]


def stored_depth(view: ShadowView, target: Target, xy: Array, depth: Array) -> Array:
    """The stored value of the point at `depth` along the view through `xy` (..., 2), world units or tangents."""
    if view.projection == "cube" and not target.is_depth:
        return radial_metric(depth * np.sqrt(1.0 + (xy**2).sum(axis=-1)), view.near, view.far)
    matrix = view.clip_from_view
    clip_z = -matrix[2, 2] * depth + matrix[2, 3]
    if not target.is_depth:
        return projected_metric(clip_z, view.clip, *metric_range(view.projection, view.clip, view.near, view.far))
    return window_depth(np.stack([clip_z, -matrix[3, 2] * depth + matrix[3, 3]], axis=-1), view.clip)


def cast(
    views: tuple[ShadowView, ...],
    triangles: ArrayLike,
    target: Target,
    bias: Bias | None = None,
    precision: Precision | None = None,
) -> StoredMap:
    """Draw triangles, both sides, into the maps of one light.

    Parameters
    ----------
    triangles : (T, 3, 3) array_like
        World positions.
    bias : optional
        Only SlopeScaledBias and ClipBias(caster=True, normal=0) act here.
    """
    precision = precision or Precision()
    size = np.max([np.add(view.tile, view.resolution) for view in views], axis=0)
    nothing = 1.0 if not target.is_depth else views[0].clip.clear_depth
    low, high = np.full((size[1], size[0]), nothing), np.full((size[1], size[0]), nothing)
    for view in views:
        block = np.s_[view.tile[1] : view.tile[1] + view.resolution, view.tile[0] : view.tile[0] + view.resolution]
        for triangle in np.asarray(triangles, dtype=np.float64):
            _draw(low[block], high[block], view, triangle, target, bias, precision)
    margin = precision.stored + target.quantum
    return StoredMap(views, target, np.clip(low - margin, 0.0, 1.0), np.clip(high + margin, 0.0, 1.0))


def _draw(
    low: Array, high: Array, view: ShadowView, triangle: Array, target: Target, bias: Bias | None, precision: Precision
) -> None:
    local = transform(view.view_from_world, triangle)
    texel, index = np.array(view.texel), np.arange(view.resolution) + 0.5
    x, y = view.window[0] + index * texel[0], view.window[2] + index * texel[1]
    centres = np.stack(np.broadcast_arrays(x, y[:, None]), axis=-1)
    inside, xy, depth = _rasterised(local, centres, texel, view.projection == "orthographic")
    value = stored_depth(view, target, xy, depth) + _offset(view, target, bias, local)
    value = np.clip(value, 0.0, 1.0)
    least, most = value.min(axis=0), value.max(axis=0)
    maybe, surely = inside > -SNAP_TEXELS, inside > SNAP_TEXELS
    # an interval's near end follows every triangle that may cover the texel, its far end those that certainly do
    if target.is_depth and view.clip.reversed:
        high[maybe], low[surely] = np.maximum(high, most)[maybe], np.maximum(low, least)[surely]
    else:
        low[maybe], high[surely] = np.minimum(low, least)[maybe], np.minimum(high, most)[surely]


def _rasterised(local: Array, centres: Array, texel: Array, parallel: bool) -> tuple[Array, Array, Array]:
    """A triangle (3, 3) in view space over a grid of rays through `centres` (H, W, 2).

    Returns
    -------
    inside : (H, W) float64
        Texels from the triangle's nearest edge, negative outside, -inf where the ray never meets its plane.
    xy, depth : (5, H, W, 2), (5, H, W) float64
        Where the ray hits the plane; first unmoved, then moved by SNAP_TEXELS towards each corner of the texel.
    """
    flat = np.column_stack([local[:, :2], np.ones(3) if parallel else -local[:, 2]])
    # homogeneous lines through the corners
    edges = np.cross(flat, np.roll(flat, -1, axis=0)) * np.sign(np.linalg.det(flat))
    inside = (centres @ edges[:, :2].T + edges[:, 2]) / np.maximum(np.hypot(*(edges[:, :2] * texel).T), 1e-300)
    xy = centres + SNAP_TEXELS * texel * np.array([(0, 0), (-1, -1), (-1, 1), (1, -1), (1, 1)])[:, None, None, :]
    normal = np.cross(local[1] - local[0], local[2] - local[0])
    plane = float(normal @ local[0])
    if (normal[2] if parallel else plane) == 0.0:  # edge-on
        return np.full(centres.shape[:2], -np.inf), xy, np.ones(xy.shape[:3])
    if parallel:
        return inside.min(axis=-1), xy, (xy @ normal[:2] - plane) / normal[2]
    inverse = (xy @ normal[:2] - normal[2]) / plane
    ahead = (inverse > 0.0).all(axis=0)
    return np.where(ahead, inside.min(axis=-1), -np.inf), xy, 1.0 / np.where(inverse > 0.0, inverse, 1.0)


def _offset(view: ShadowView, target: Target, bias: Bias | None, local: Array) -> float:
    """The stored depth that a caster-side bias adds to a triangle."""
    if bias is None:
        return 0.0
    if bias.of_caster is not None:
        return bias.of_caster[0] * (view.clip.sign * WINDOW_PER_CLIP if target.is_depth else 1.0)
    factor, units = bias.polygon_offset
    if factor == units == 0.0:
        return 0.0
    normal = np.cross(local[1] - local[0], local[2] - local[0])
    below = normal[2] if view.projection == "orthographic" else normal @ local[0]
    if below == 0.0:
        return 0.0  # edge-on: covers no texel
    slope = np.abs(_window_slope(view) * normal[:2] * np.array(view.texel) / below).max()
    depths = -local[:, 2]
    greatest = stored_depth(view, target, np.zeros((3, 2)), depths).max() if (depths > 0.0).all() else 1.0
    greatest = float(np.clip(greatest, 2.0**-126, 1.0))
    # the smallest step that GL promises to resolve, as llvmpipe takes it
    step = {Target.DEPTH16: 2.0**-15, Target.DEPTH24: 2.0**-23}.get(target, 2.0 ** (np.floor(np.log2(greatest)) - 23.0))
    return float(view.clip.sign * (factor * slope + units * step))


def _window_slope(view: ShadowView) -> float:
    """Window depth per unit of distance along a directional light's view, or per unit of a local light's 1 / depth."""
    at = stored_depth(view, Target.DEPTH32F, np.zeros((2, 2)), np.array([1.0, 2.0]))
    return float(at[1] - at[0] if view.projection == "orthographic" else 2.0 * (at[0] - at[1]))


def first_hits(
    camera: PerspectiveCamera, size: tuple[int, int], triangles: ArrayLike
) -> tuple[Array, NDArray[np.intp], NDArray[np.bool_]]:
    """The surfaces at the pixels' centres.

    Returns
    -------
    depth : (H, W) float64
        Along the view, infinite where there is nothing.
    triangle : (H, W) int
        The one that is hit; 0 where there is nothing.
    border : (H, W) bool
        Where a moved vertex may show another surface.
    """
    left, right, bottom, top = camera.window(size)
    rays = pixel_rays(camera, size) @ camera.view_from_world[:3, :3].T
    pixel = np.array([(right - left) / size[0], (top - bottom) / size[1]])
    corners = transform(camera.view_from_world, triangles)
    drawn = [_rasterised(corner, rays[..., :2], pixel, parallel=False) for corner in corners]
    inside, depth = np.stack([each[0] for each in drawn]), np.stack([each[2][0] for each in drawn])
    hits = [np.where(inside > margin, depth, np.inf) for margin in (0.0, -SNAP_TEXELS, SNAP_TEXELS)]
    border = hits[1].argmin(axis=0) != hits[2].argmin(axis=0)
    border |= np.isinf(hits[1].min(axis=0)) != np.isinf(hits[2].min(axis=0))
    return hits[0].min(axis=0), hits[0].argmin(axis=0), border


def receive(
    stored: StoredMap,
    light: Light,
    points: Array,
    normals: Array,
    filter: Filter,
    bias: Bias,
    precision: Precision | None = None,
) -> tuple[Array, Array]:
    """Visibility of a light, minimum and maximum.

    Parameters
    ----------
    points, normals : (N, 3) float64
        World; normals of unit length on the side that is seen, N.L > 0.

    Returns
    -------
    (N,) float64, (N,) float64
    """
    precision = precision or Precision()
    towards, distance = light.to_light(points)
    moved = bias.moved(points, normals, towards, distance, _lean(stored.views[0], light, points, normals, towards))
    low, high = np.ones(len(points)), np.zeros(len(points))
    sure = np.zeros(len(points), dtype=bool)
    for view in stored.views:
        local = transform(view.view_from_world, moved)
        mine, certain = _on_face(view, local, precision.texels)
        sure |= certain
        if not mine.any():
            continue
        normal = normals[mine] @ view.view_from_world[:3, :3].T
        receivers = _projected(view, stored.target, local[mine], normal, filter, bias)
        for shift in precision.texels * np.array([(-1, -1), (-1, 1), (1, -1), (1, 1)]):
            least, most = _filtered(stored, receivers, shift, filter, precision)
            low[mine], high[mine] = np.minimum(low[mine], least), np.maximum(high[mine], most)
    return np.where(sure, low, 0.0), np.where(sure, high, 1.0)


def _lean(view: ShadowView, light: Light, points: Array, normals: Array, towards: Array) -> Array:
    """World size of a texel along the way that normals lean, times the sine of their angle to the view's axis or to the light; (N,)."""
    rotation, texel = view.view_from_world[:3, :3], np.array(view.texel)
    if view.projection == "orthographic":
        return np.asarray(np.linalg.norm(normals @ rotation[:2].T * texel, axis=1))
    least = texel.max() * np.sqrt(np.maximum(1.0 - (normals * towards).sum(axis=1) ** 2, 0.0))
    if view.projection == "perspective":
        depth = np.maximum(-transform(view.view_from_world, points)[:, 2], 0.0)
        across = np.linalg.norm(normals @ rotation[:2].T * texel, axis=1)
    else:  # faces look along the axes, and their texels are square
        away = np.abs(light.rays_to(points))
        depth, face = away.max(axis=1), away.argmax(axis=1)
        across = texel[0] * np.linalg.norm(np.where(np.arange(3) == face[:, None], 0.0, normals), axis=1)
    return np.asarray(depth * np.maximum(across, least))


def _on_face(view: ShadowView, local: Array, texels: float) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Which points a view is used for, and for which of them that is certain."""
    if view.projection != "cube":
        every = np.ones(len(local), dtype=bool)
        return every, every
    depth, widest = -local[:, 2], np.abs(local[:, :2]).max(axis=-1)
    slack = texels * max(view.texel) * np.abs(depth)
    return depth >= widest - slack, depth > widest + slack


@dataclass(frozen=True, eq=False)
class _Receivers:
    """Points of one view, ready for depth comparison; `slope`: gradient of depth, or 1 / depth, per texel."""

    view: ShadowView
    target: Target
    follows: bool
    xy: Array
    depth: Array
    ahead: NDArray[np.bool_]
    slope: Array
    slack_texels: float
    constant: float  # stored units towards the light
    facet: float  # rise between facets: world units of a directional light, else share of depth

    def compare_depth(self, offset: Array, change: float) -> Array:
        """Depth to compare with the texel `offset` (N, 2) texels away, the receiver moved by `change`."""
        view, texel = self.view, np.array(self.view.texel)
        depth = self.depth * (1.0 - (0.0 if view.projection == "orthographic" else self.facet)) + change
        along, slack = (self.slope * offset).sum(axis=-1), self.slack_texels * np.abs(self.slope).sum(axis=-1)
        if view.projection == "orthographic":
            depth = depth - self.facet - slack + along
        else:
            nearer = 1.0 / np.maximum(depth, 1e-30) + slack
            if view.projection == "cube" and not self.target.is_depth and self.follows:
                nearer = nearer * (1.0 + self.slack_texels * texel[0])  # the distance is not affine either
            depth = 1.0 / np.maximum(nearer + along, 1e-30)
        xy = self.xy + (offset * texel if self.follows else 0.0)
        towards = -view.clip.sign if self.target.is_depth else -1.0
        return np.clip(stored_depth(view, self.target, xy, depth) + towards * self.constant, 0.0, 1.0)

    def lit(self, offset: Array, low: Array, high: Array, precision: Precision) -> tuple[Array, Array]:
        """Minimum and maximum result of the comparison with texels that hold `low` to `high`."""
        error = precision.world
        taken_off = error if self.follows else 0.0  # by the derived bias, whatever the real error is
        near, far = (self.compare_depth(offset, change - taken_off) for change in (-error, error))
        if self.target.is_depth and self.view.clip.reversed:
            near, far, low, high = -near, -far, -high, -low
        return np.where(far + precision.stored <= low, 1.0, 0.0), np.where(near - precision.stored <= high, 1.0, 0.0)


def _projected(view: ShadowView, target: Target, local: Array, normal: Array, filter: Filter, bias: Bias) -> _Receivers:
    sun, follows = view.projection == "orthographic", bias.follows_plane
    ahead = np.ones(len(local), dtype=bool) if sun else -local[:, 2] > 0.0
    depth = np.where(ahead, -local[:, 2], 1.0)
    xy = local[:, :2] if sun else local[:, :2] / depth[:, None]
    below = normal[:, 2] if sun else (normal * local).sum(axis=-1)
    slope = normal[:, :2] * np.array(view.texel) / below[:, None] if follows else np.zeros_like(xy)
    facet = FACET_SLOPE * filter.reach_texels * max(view.texel) if follows else 0.0
    constant = 0.0
    if follows and not (target is Target.DEPTH32F and view.clip.reversed):
        constant = target.quantum
    constant += bias.of_compare * (WINDOW_PER_CLIP if target.is_depth else 1.0)
    return _Receivers(view, target, follows, xy, depth, ahead, slope, filter.slack_texels, constant, facet)


def _filtered(
    stored: StoredMap, receivers: _Receivers, shift: Array, filter: Filter, precision: Precision
) -> tuple[Array, Array]:
    view = receivers.view
    position = (receivers.xy - np.array([view.window[0], view.window[2]])) / np.array(view.texel) + shift
    inside = ((position >= 0.0) & (position <= view.resolution)).all(axis=1) & receivers.ahead

    def compare(texel: NDArray[np.int64], place: Array) -> Array:
        x, y = (np.clip(texel[:, k] + view.tile[k], 0, stored.low.shape[1 - k] - 1) for k in (0, 1))
        return np.stack(receivers.lit(place, stored.low[y, x], stored.high[y, x], precision))

    lit = filter.visibility(position, compare)
    return np.where(inside, lit[0], 1.0), np.where(inside, lit[1], 1.0)
