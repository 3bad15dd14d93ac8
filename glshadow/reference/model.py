"""Shadow mapping in float64 numpy: the twin of caster pass and receiver, for tiny maps and a handful of triangles.

A driver may put a vertex elsewhere by a fraction of a pixel and rounds every sum to float32, so the twin answers with intervals:
all that limited precision may give. Where an interval is one number, the picture has to show that number.

    triangles --cast--> StoredMap [low, high] per texel --receive--> visibility [low, high] per point

It mirrors glsl/pass/caster, metric, projection, bias, depth, compare and filter; one tile per view, placed in an atlas as the
renderer places them.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from glshadow.core.bias import (
    Bias,
    ClipBias,
    ConstantBias,
    NormalOffsetBias,
    ReceiverPlaneBias,
    SlopeScaledBias,
    bias_factor,
)
from glshadow.core.kernels import Filter, Hard, box_weights
from glshadow.core.lights import DirectionalLight, Light, to_light
from glshadow.core.metric import Target, metric_range, projected_metric, radial_metric, window_depth
from glshadow.core.spaces import Array, transform
from glshadow.core.view import ShadowView

SNAP = 1.0 / 128.0  # texels by which rasterisers move vertices: 1/512 at 8 bits below the pixel, and once more for its derivatives


@dataclass(frozen=True)
class Precision:
    """What limited precision may do.

    Parameters
    ----------
    stored : float
        Error of a stored or a compared depth, in stored units.
    texels : float
        Error of a position on the map.
    world : float
        World units by which a receiver may be misplaced along the light; the derived bias takes it off the distance.
    """

    stored: float = 0.0
    texels: float = 0.0
    world: float = 0.0


@dataclass(frozen=True, eq=False)
class StoredMap:
    """An atlas (H, W), row 0 at v = 0: the least and the greatest value that each texel may hold."""

    views: tuple[ShadowView, ...]
    target: Target
    low: Array
    high: Array

    def tile(self, number: int) -> tuple[Array, Array]:
        """Least and greatest values (R, R) of one view, row 0 at its **top**, as in Frame.shadow_maps."""
        view = self.views[number]
        x, y = view.tile
        block = np.s_[y : y + view.resolution, x : x + view.resolution]
        return self.low[block][::-1], self.high[block][::-1]


def stored_depth(view: ShadowView, target: Target, xy: Array, depth: Array) -> Array:
    """What a map stores for the point at `depth` along the view through `xy` (..., 2), world units or tangents; not rounded."""
    if view.kind == "point" and not target.is_depth:
        return radial_metric(depth * np.sqrt(1.0 + (xy**2).sum(axis=-1)), view.near, view.far)
    matrix = view.clip_from_view
    clip_z = -matrix[2, 2] * depth + matrix[2, 3]
    if not target.is_depth:
        return projected_metric(clip_z, view.clip, *metric_range(view.kind, view.clip, view.near, view.far))
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
    flat = local * (1.0, 1.0, -1.0) if view.kind != "directional" else np.column_stack([local[:, :2], np.ones(3)])
    texel, window = np.array(view.texel), view.window
    index = np.arange(view.resolution) + 0.5
    centres = np.stack(np.broadcast_arrays(window[0] + index * texel[0], window[2] + index[:, None] * texel[1]), axis=-1)
    edges = np.cross(flat, np.roll(flat, -1, axis=0))  # homogeneous lines through the corners
    edges *= np.sign(np.linalg.det(flat))
    inside = centres @ edges[:, :2].T + edges[:, 2]
    inside = (inside / np.maximum(np.hypot(*(edges[:, :2] * texel).T), 1e-300)).min(axis=-1)  # texels to the nearest edge
    normal = np.cross(local[1] - local[0], local[2] - local[0])
    if not normal.any() or (view.kind == "directional" and normal[2] == 0.0):
        return  # edge-on
    plane = float(normal @ local[0])
    shifts = SNAP * texel * np.array([(0, 0), (-1, -1), (-1, 1), (1, -1), (1, 1)])[:, None, None, :]
    xy = centres + shifts
    if view.kind == "directional":
        depth, ahead = (xy @ normal[:2] - plane) / normal[2], np.ones(centres.shape[:2], dtype=bool)
    else:
        inverse = (xy @ normal[:2] - normal[2]) / plane
        ahead = (inverse > 0.0).all(axis=0)
        depth = 1.0 / np.where(inverse > 0.0, inverse, 1.0)
    value = stored_depth(view, target, xy, depth) + _offset(view, target, bias, texel, normal, plane, local)
    value = np.clip(value, 0.0, 1.0)
    least, most = value.min(axis=0), value.max(axis=0)
    maybe, surely = ahead & (inside > -SNAP), ahead & (inside > SNAP)
    nearer = np.maximum if target.is_depth and view.clip.reversed else np.minimum
    # the nearer end of a texel's interval follows every triangle that may cover it, the farther one those that surely do
    near_side, far_side = (high, low) if nearer is np.maximum else (low, high)
    near_value, far_value = (most, least) if nearer is np.maximum else (least, most)
    near_side[:] = np.where(maybe, nearer(near_side, near_value), near_side)
    far_side[:] = np.where(surely, nearer(far_side, far_value), far_side)


def _offset(
    view: ShadowView, target: Target, bias: Bias | None, texel: Array, normal: Array, plane: float, local: Array
) -> float:
    """What a caster-side bias adds to the stored depth of a triangle."""
    if isinstance(bias, ClipBias) and bias.caster:
        return bias.clip * (view.clip.sign * bias_factor(view.clip) / _span(view) if target.is_depth else 1.0)
    if not isinstance(bias, SlopeScaledBias):
        return 0.0
    _, scale = depth_line(view)
    slope = np.abs(scale * normal[:2] * texel / (normal[2] if view.kind == "directional" else plane)).max()
    depths = -local[:, 2]
    greatest = stored_depth(view, target, np.zeros((3, 2)), depths).max() if (depths > 0.0).all() else 1.0
    # the smallest step that GL promises to resolve, as llvmpipe takes it
    step = {Target.DEPTH16: 2.0**-15, Target.DEPTH24: 2.0**-23}.get(target, 2.0 ** (np.floor(np.log2(greatest)) - 23.0))
    return float(view.clip.sign * (bias.factor * slope + bias.units * step))


def _span(view: ShadowView) -> float:
    return 1.0 if view.clip.zero_to_one else 2.0


def depth_line(view: ShadowView) -> tuple[float, float]:
    """(x, y) with window depth = x + y * d, d the distance along a sun's view, or 1 / depth of a lamp's."""
    at = stored_depth(view, Target.DEPTH32F, np.zeros((2, 2)), np.array([1.0, 2.0]))
    y = at[1] - at[0] if view.kind == "directional" else 2.0 * (at[0] - at[1])
    return float(at[0] - y), float(y)


def receive(
    stored: StoredMap,
    light: Light,
    points: Array,
    normals: Array,
    kernel: Filter,
    bias: Bias,
    precision: Precision | None = None,
) -> tuple[Array, Array]:
    """Visibility of a light, least and greatest.

    Parameters
    ----------
    points, normals : (N, 3) float64
        World; normals of unit length on the side that is seen, N.L > 0.

    Returns
    -------
    (N,) float64, (N,) float64
    """
    precision = precision or Precision()
    towards, distance = to_light(light, points)
    moved = _moved(stored.views[0], light, points, normals, towards, distance, bias)
    low, high = np.ones(len(points)), np.zeros(len(points))
    sure = np.zeros(len(points), dtype=bool)
    for view in stored.views:
        local = transform(view.view_from_world, moved)
        mine, certain = _on_face(view, local, precision.texels)
        sure |= certain
        if not mine.any():
            continue
        normal = normals[mine] @ view.view_from_world[:3, :3].T
        for shift in precision.texels * np.array([(-1, -1), (-1, 1), (1, -1), (1, 1)]):
            least, most = _compared(stored, view, local[mine], normal, shift, kernel, bias, precision)
            low[mine], high[mine] = np.minimum(low[mine], least), np.maximum(high[mine], most)
    return np.where(sure, low, 0.0), np.where(sure, high, 1.0)


def _moved(
    view: ShadowView, light: Light, points: Array, normals: Array, towards: Array, distance: Array, bias: Bias
) -> Array:
    if isinstance(bias, ConstantBias):
        share = bias.world if isinstance(light, DirectionalLight) else np.minimum(bias.world, 0.999 * distance)[:, None]
        return np.asarray(points + towards * share)
    if not isinstance(bias, NormalOffsetBias):
        return points
    cosine = (normals * towards).sum(axis=-1, keepdims=True)
    amount = bias.texels * max(view.texel) * np.sqrt(np.maximum(0.0, 1.0 - cosine**2))
    if not isinstance(light, DirectionalLight):
        # texels grow with the depth along the axes of the light's view, which are the world's around a point light
        axes = view.view_from_world[:3, :3] if view.kind == "spot" else np.eye(3)
        amount = amount * np.abs((points - np.asarray(light.position)) @ axes.T).max(axis=-1, keepdims=True)
    return np.asarray(points + normals * amount)


def _on_face(view: ShadowView, local: Array, texels: float) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Which points a view answers for, and for which of them that is certain."""
    if view.kind != "point":
        every = np.ones(len(local), dtype=bool)
        return every, every
    depth, widest = -local[:, 2], np.abs(local[:, :2]).max(axis=-1)
    slack = texels * max(view.texel) * np.abs(depth)
    return depth >= widest - slack, depth > widest + slack


def _compared(
    stored: StoredMap,
    view: ShadowView,
    local: Array,
    normal: Array,
    shift: Array,
    kernel: Filter,
    bias: Bias,
    precision: Precision,
) -> tuple[Array, Array]:
    """Project, follow the plane, compare, filter; visibility least and greatest."""
    texel, sun = np.array(view.texel), view.kind == "directional"
    depth = -local[:, 2]
    ahead = depth > 0.0 if view.kind == "spot" else np.ones(len(local), dtype=bool)
    depth = depth if sun else np.where(ahead & (depth > 0.0), depth, 1.0)
    xy = local[:, :2] if sun else local[:, :2] / depth[:, None]
    position = (xy - np.array([view.window[0], view.window[2]])) / texel + shift
    inside = ((position >= 0.0) & (position <= view.resolution)).all(axis=1) & ahead
    slope = np.zeros_like(xy)
    if isinstance(bias, ReceiverPlaneBias):
        below = normal[:, 2] if sun else (normal * local).sum(axis=-1)
        slope = normal[:, :2] * texel / below[:, None]
    slack = kernel.slack_texels * np.abs(slope).sum(axis=-1)
    receiver = _Receiver(view, stored.target, bias, xy, depth, slope, slack, precision)
    lit_low, lit_high = np.zeros(len(local)), np.zeros(len(local))
    for offset, weight in _taps(position, kernel):
        at = np.floor(position).astype(np.int64) if isinstance(kernel, Hard) else np.floor(position - 0.5).astype(np.int64)
        x, y = (np.clip(at[:, i] + offset[i] + view.tile[i], 0, stored.low.shape[1 - i] - 1) for i in (0, 1))
        block = offset if isinstance(kernel, Hard) else _block_corner(at, offset, kernel.radius) - position
        least, most = receiver.lit(np.broadcast_to(block, position.shape), stored.low[y, x], stored.high[y, x])
        lit_low += weight * least
        lit_high += weight * most
    return np.where(inside, lit_low, 1.0), np.where(inside, lit_high, 1.0)


def _taps(position: Array, kernel: Filter) -> list[tuple[NDArray[np.int64], Array]]:
    """Texels of the filter, counted from the receiver's own or its lower left, and their weights (N,)."""
    if isinstance(kernel, Hard):
        return [(np.zeros(2, dtype=np.int64), np.ones(len(position)))]
    base = position - 0.5
    weights = box_weights(base - np.floor(base), kernel.radius)
    reach = range(-kernel.radius, kernel.radius + 2)
    return [(np.array([i, j]), weights[:, 0, i + kernel.radius] * weights[:, 1, j + kernel.radius]) for j in reach for i in reach]


def _block_corner(base: NDArray[np.int64], offset: NDArray[np.int64], radius: int) -> Array:
    """Corner in the middle of the block of 2 x 2 texels that a tap is fetched with."""
    return np.asarray(base + offset - (offset + radius) % 2 + 1.0)


@dataclass(frozen=True)
class _Receiver:
    view: ShadowView
    target: Target
    bias: Bias
    xy: Array
    depth: Array
    slope: Array
    slack: Array
    precision: Precision

    def lit(self, offset: Array, low: Array, high: Array) -> tuple[Array, Array]:
        """Least and greatest outcome of the comparison with texels of the plane `offset` texels away."""
        follows = isinstance(self.bias, ReceiverPlaneBias)
        error = self.precision.world
        nearest, farthest = (self._compare(offset, change) for change in ((-2.0 * error if follows else -error), error))
        margin = self.precision.stored
        if self.target.is_depth and self.view.clip.reversed:
            nearest, farthest, low, high = -nearest, -farthest, -high, -low
        least, most = np.where(farthest + margin <= low, 1.0, 0.0), np.where(nearest - margin <= high, 1.0, 0.0)
        return least, most

    def _compare(self, offset: Array, change: float) -> Array:
        """Compare depth in stored units, the receiver moved by `change` along the view."""
        view, depth = self.view, self.depth + change
        xy = self.xy + (offset * np.array(view.texel) if isinstance(self.bias, ReceiverPlaneBias) else 0.0)
        along = (self.slope * offset).sum(axis=-1)
        if view.kind == "directional":
            depth = depth - self.slack + along
        else:
            inverse = 1.0 / np.maximum(depth, 1e-30) + self.slack
            if view.kind == "point" and not self.target.is_depth:
                inverse = inverse * (1.0 + self._stretch())
            depth = 1.0 / np.maximum(inverse + along, 1e-30)
        return np.clip(stored_depth(view, self.target, xy, depth) + self._constant(), 0.0, 1.0)

    def _stretch(self) -> float:
        if not isinstance(self.bias, ReceiverPlaneBias):
            return 0.0
        return self._kernel_slack * self.view.texel[0]

    def _constant(self) -> float:
        return 0.0
