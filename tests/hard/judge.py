"""Renders with a technique, compares every pixel that faces the light with the reference, and predicts failures.

A mismatch: |visibility - reference| > 0.5 outside the first band, any difference outside the second (half-widths
(radius + 1/2) sqrt 2 and (radius + 1) sqrt 2 texels of the map that was really used, in the light plane). The exact
filter has no texels and no band: any difference is a mismatch, unless the true boundary passes within rounding of the
point, or the picture shows a neighbouring triangle there and is right for that.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshadow.core.spaces import Array, ClipSpace, transform
from glshadow.frame import Frame
from glshadow.lights import DirectionalLight
from glshadow.reference.aimed import AimedLight, moved_over, perpendicular
from glshadow.reference.embree import dot
from glshadow.reference.trace import trace
from glshadow.reference.truth import Truth
from glshadow.renderer import Renderer
from glshadow.shadows.bias import (
    FACET_SLOPE,
    ClipBias,
    ConstantBias,
    NoBias,
    NormalOffsetBias,
    ReceiverPlaneBias,
    SlopeScaledBias,
)
from glshadow.shadows.filters import Exact, Filter
from glshadow.shadows.metric import Target, metric_range
from glshadow.shadows.view import ShadowView

from .registry import Picture, Technique

Bools = NDArray[np.bool_]
Ints = NDArray[Any]

LEAST_COSINE = 2e-6
"""N.L below which float32 cannot decide which side of a face the light is on: 16 roundings of 2^-24, doubled."""

SAME = 1e-5
"""Visibility that counts as equal: a filter's weights are sums of float32 products (16 roundings) over 25 texels."""

PLANE_SLACK = 1e-6
"""Fraction of the scene's size: a rasterised triangle whose plane passes this close to the traced point is the same surface."""

OTHER_SURFACE_SHARE = 0.02
"""Pixels that may show another surface than the ray through their centre: vertices are snapped to 1/256 pixel."""

EXACT_ROUNDINGS = 8.0
"""In 2^-24 of the scene's size: how far float32 moves a receiver across its ray from the eye; more along a slanted plane."""

SNAPPED = 1.0 / 64.0
"""Texels added to a band: rasterisers snap casters' vertices to 1/256 texel, and positions are rounded."""

ROUNDINGS = 16.0
"""In 2^-24 of the reach: float32 error that the derived bias allows; used only to predict its loss."""

DIRECTIONS, COARSE_SPOKES, FEW = 20, 80, 500
AT_ONCE = 4000  # points moved in one call: fewer are not faster, more would be moved in vain
_SPOKES = [
    (ring / rings, 2.0 * np.pi * (turn + 0.5 * (ring % 2)) / directions)
    for rings, directions in ((4, DIRECTIONS), (12, 36))  # for the few left over finer, so that thin features are found
    for ring in range(rings, 0, -1)
    for turn in range(directions)
]


@dataclass(frozen=True)
class Outcome:
    """The comparison of one picture with its reference.

    Attributes
    ----------
    leak, acne : (H, W) bool
        Mismatches: dark drawn lit, lit drawn dark.
    judged : (H, W) bool
        Pixels that face the light, in its reach, and show the surface that was traced.
    """

    picture: Picture
    technique: Technique
    frame: Frame
    truth: Truth
    judged: Bools
    leak: Bools
    acne: Bools

    @property
    def mismatches(self) -> int:
        return int((self.leak | self.acne).sum())

    def off_creases(self) -> int:
        """Mismatches except lit pixels drawn darker within the filter's reach of a concave crease."""
        radius = self.technique.filter.radius
        crease = near_crease(self.frame, self.truth, (radius + 1.0) * np.sqrt(2.0), self.acne)
        return int((self.leak | (self.acne & ~crease)).sum())

    def __str__(self) -> str:
        dark = self.judged & (self.truth.visibility[0] < 0.5)
        used = self.frame.used[0]
        return (
            f"{self.picture.name} / {self.technique.name}: leak {int(self.leak.sum())}, acne {int(self.acne.sum())} of "
            f"{int(self.judged.sum())} pixels ({int(dark.sum())} dark), texel {used.texel}"
        )


@cache
def truth_of(picture: Picture) -> Truth:
    return trace(picture.scene, picture.camera, [picture.light], picture.size, samples=1)


def judge(renderer: Renderer, picture: Picture, technique: Technique) -> Outcome:
    light = replace(picture.light, shadow=technique.shadow(picture))
    frame = renderer.render(
        picture.scene, picture.camera, [light], picture.size, outputs=("visibility", "triangle"), samples=1
    )
    truth = truth_of(picture)
    judged = (
        (truth.cosine[0] > LEAST_COSINE)
        & truth.reached[0]
        & ~np.isnan(truth.visibility[0])
        & same_surface(frame, truth)
    )
    difference = np.where(judged, frame.visibility[0] - truth.visibility[0], 0.0)
    assert not np.isnan(difference).any(), "NaN visibility on a surface"
    if isinstance(technique.filter, Exact):
        mismatch = difference != 0.0
        mismatch &= ~_excused(frame, truth, mismatch)
        return Outcome(
            picture, technique, frame, truth, judged, mismatch & (difference > 0), mismatch & (difference < 0)
        )
    radius = light.shadow.filter.radius if light.shadow else 0
    wrong, uneven = np.abs(difference) > 0.5, np.abs(difference) > SAME
    mismatch = wrong & ~near_edge(frame, truth, (radius + 0.5) * np.sqrt(2.0), wrong)
    rest = uneven & ~mismatch
    mismatch |= rest & ~near_edge(frame, truth, (radius + 1.0) * np.sqrt(2.0), rest)
    return Outcome(picture, technique, frame, truth, judged, mismatch & (difference > 0), mismatch & (difference < 0))


def _excused(frame: Frame, truth: Truth, where: Bools) -> Bools:
    """Where the exact boundary is as near as rounding; where another triangle is shown, and the image right for it."""
    if not where.any():
        return where
    towards = truth.position - np.asarray(frame.camera.position)
    with np.errstate(invalid="ignore", divide="ignore"):
        slant = np.abs((towards * truth.normal).sum(axis=-1)) / np.linalg.norm(towards, axis=-1)
        radius = EXACT_ROUNDINGS * 2.0**-24 * truth.rays.size / np.nan_to_num(slant, nan=1.0)
    result = truth.near_edge(0, radius, where)
    other = where & (frame.triangle != truth.triangle)
    if other.any():
        shown = trace(frame.scene, frame.camera, frame.lights, frame.size, surface=frame.triangle, samples=1)
        result |= other & (shown.visibility[0] == frame.visibility[0])
    return result


def same_surface(frame: Frame, truth: Truth) -> Bools:
    """Whether the rasterised triangle lies in the plane of the traced one: coplanar neighbours and duplicates do."""
    drawn, tested = frame.triangle, (frame.triangle >= 0) & (truth.triangle >= 0)
    result = np.zeros(drawn.shape, dtype=bool)
    points = truth.position[tested] - truth.rays.origin
    off = np.abs(truth.rays.plane_distance(drawn[tested], points))
    alike = np.abs(dot(truth.rays.normals[drawn[tested]], truth.rays.normals[truth.triangle[tested]])) > 1.0 - 1e-6
    result[tested] = (drawn[tested] == truth.triangle[tested]) | ((off < PLANE_SLACK * truth.rays.size) & alike)
    missed = (truth.triangle >= 0) & ~result
    assert missed.mean() <= OTHER_SURFACE_SHARE, f"{missed.mean():.1%} of the pixels show another surface than traced"
    return result


def texel_field(view: ShadowView, points: Array) -> Array:
    """Longer side of a texel in world units at world points (..., 3)."""
    texel = max(view.texel)
    if view.projection == "orthographic":
        return np.full(points.shape[:-1], texel)
    local = transform(view.view_from_world, points)
    axial = np.abs(local).max(axis=-1) if view.projection == "cube" else -local[..., 2]
    return np.asarray(texel * np.maximum(axial, 0.0))


def near_edge(frame: Frame, truth: Truth, texels: float, where: Bools) -> Bools:
    """Whether the exact boundary passes within so many texels of the map that was used; an ellipse for directional lights."""
    return _around(frame, truth, texels, where, _other_visibility)


def near_crease(frame: Frame, truth: Truth, texels: float, where: Bools) -> Bools:
    """Whether within so many texels the surface rises above the receiver's own plane, towards the light, and is lit."""
    return _around(frame, truth, texels, where, _rises)


def _other_visibility(truth: Truth, source: AimedLight, rows: Ints, found: Ints, place: Array) -> Bools:
    lit = truth.visibility[0].ravel()[rows] > 0.5
    return np.asarray(source.lit(truth.rays, found, place, truth.normal.reshape(-1, 3)[rows]) != lit)


def _rises(truth: Truth, source: AimedLight, rows: Ints, found: Ints, place: Array) -> Bools:
    own, rays = truth.triangle.ravel()[rows], truth.rays
    normal = truth.normal.reshape(-1, 3)[rows]
    height = dot(place - (truth.position.reshape(-1, 3)[rows] - rays.origin), normal)
    return np.asarray((found != own) & (height > 1e-6 * rays.size) & source.lit(rays, found, place, normal))


def _around(
    frame: Frame,
    truth: Truth,
    texels: float,
    where: Bools,
    test: Callable[[Truth, AimedLight, Ints, Ints, Array], Bools],
) -> Bools:
    """Test points within `texels` of pixels, in the light plane and projected back to the surface along the light."""
    result = np.zeros(where.shape, dtype=bool)
    rows = np.flatnonzero(where)
    if len(rows) == 0 or not frame.used[0].views:
        return result
    view, rays = frame.used[0].views[0], truth.rays
    points, own = truth.position.reshape(-1, 3)[rows] - rays.origin, truth.triangle.ravel()[rows]
    source = AimedLight(truth.lights[0], rays.origin)
    # A straight edge at the very rim passes between two directions: circumscribed.
    texels = (texels + SNAPPED) / float(np.cos(np.pi / DIRECTIONS))
    sun = view.projection == "orthographic"
    axes = view.view_from_world[:2, :3] * np.array(view.texel)[:, None]
    size = texel_field(view, truth.position).ravel()[rows]
    u, v = _basis(truth) if sun else (np.zeros(3), np.zeros(3))
    near, first = np.zeros(len(rows), dtype=bool), 0
    while first < len(_SPOKES) and not near.all() and (first < COARSE_SPOKES or (~near).sum() <= FEW):
        # The first and the last stay: alone, a point would be tested in other directions.
        left = np.union1d(np.flatnonzero(~near), [0, len(rows) - 1])
        end = COARSE_SPOKES if first < COARSE_SPOKES else len(_SPOKES)
        end = min(end, first + max(1, AT_ONCE // len(left)))
        ring, turn = np.repeat(np.array(_SPOKES[first:end]), len(left), axis=0).T
        again = np.tile(left, end - first)
        angle, reach = turn, texels * ring * size[again]
        if sun:
            offset = (texels * ring)[:, None] * (np.cos(turn)[:, None] * axes[0] + np.sin(turn)[:, None] * axes[1])
            x, y = offset @ u, offset @ v
            reach, angle = np.hypot(x, y), np.arctan2(y, x)
        moved = moved_over(rays, source, own[again], points[again], reach, angle[:, None])
        near[left] |= test(truth, source, rows[again], *moved).reshape(-1, len(left)).any(axis=0)
        first = end
    result.ravel()[rows] = near
    return result


def _basis(truth: Truth) -> tuple[Array, Array]:
    towards, _ = truth.lights[0].to_light(np.zeros((1, 3)))
    u, v = perpendicular(towards)
    return u[0], v[0]


# -- predicted failures of techniques that cannot pass


@dataclass(frozen=True)
class Prediction:
    """Expected numbers of mismatches."""

    leak: float
    acne: float


def predict(outcome: Outcome) -> Prediction:
    """Mismatches due to the bias alone, as if the map were infinitely fine (leak), or the receiver one plane
    sampled at random places of a texel (acne).

    leak: dark points that are lit once they are moved by what the bias moves them.
    acne: P(sx u + sy v > bias), u and v uniform in +-1/2 texel, s the receiver's slope per texel (nearest texel).
    """
    truth, frame = outcome.truth, outcome.frame
    used, light = frame.used[0], frame.lights[0]
    if not used.views:
        return Prediction(0.0, 0.0)
    view = used.views[0]
    rows = np.flatnonzero(outcome.judged)
    points = truth.position.reshape(-1, 3)[rows]
    normals, own = truth.normal.reshape(-1, 3)[rows], truth.triangle.ravel()[rows]
    towards, distance = light.to_light(points)
    cosine = dot(normals, towards)
    sine = np.sqrt(np.maximum(1.0 - cosine**2, 0.0))
    slope = _slope(view, light, points, normals)
    start = points - truth.rays.origin
    along = np.zeros(len(rows))
    bias = used.bias
    moved = start
    if isinstance(bias, NormalOffsetBias):
        offset = bias.amount * _lean(view, points, normals, sine)
        moved = start + normals * offset[:, None]
        allowed = offset / np.maximum(cosine, 1e-12)  # along the light, on the receiver's plane
    else:
        along = allowed = _along_light(outcome, view, points, slope)
        moved = start + towards * along[:, None]
    left = np.where(np.isfinite(distance), distance - along, np.inf)
    blocked = truth.rays.blocked(own, moved, np.array(towards), left)[0]
    if isinstance(bias, SlopeScaledBias):
        blocked = _slope_scaled_blocked(outcome, view, rows, start, np.array(towards), own)
    dark = truth.visibility[0].ravel()[rows] < 0.5
    share = np.zeros(len(rows))
    if not isinstance(bias, ReceiverPlaneBias):
        share = _self_shadowed(slope, allowed)
    leak, acne = np.zeros(truth.triangle.shape), np.zeros(truth.triangle.shape)
    leak.ravel()[rows] = dark & ~blocked
    acne.ravel()[rows] = np.where(~dark, np.maximum(share, blocked), 0.0)
    radius = used.filter.radius if used.filter else 0
    band = (radius + 0.5) * np.sqrt(2.0)
    leak *= ~near_edge(frame, truth, band, leak > 0)
    if acne.sum() > 0:
        acne *= ~near_edge(frame, truth, band, acne > 0)
    return Prediction(float(leak.sum()), float(acne.sum()))


def _lean(view: ShadowView, points: Array, normals: Array, sine: Array) -> Array:
    """What NormalOffsetBias multiplies: texels along the way that normals lean from the map's axis, or from the light, (N,)."""
    rotation = view.view_from_world[:3, :3]
    if view.projection == "orthographic":
        return np.asarray(np.linalg.norm(normals @ rotation[:2].T * np.array(view.texel), axis=1))
    axis = np.broadcast_to(rotation[2], normals.shape)
    if view.projection == "cube":
        axis = np.eye(3)[np.abs(transform(view.view_from_world, points)).argmax(axis=1)] @ rotation
    across = np.sqrt(np.maximum(1.0 - dot(normals, axis) ** 2, 0.0))
    return texel_field(view, points) * np.maximum(across, sine)


def _slope(view: ShadowView, light: object, points: Array, normals: Array) -> Array:
    """|d distance along the light ray| per texel in the map's two directions, (N, 2)."""
    rotation = view.view_from_world[:3, :3]
    if view.projection == "orthographic":
        n = normals @ rotation.T
        return np.abs(n[:, :2]) / np.maximum(n[:, 2:], 1e-12) * np.array(view.texel)
    towards, _ = light.to_light(points)  # type: ignore[arg-type]
    texel = texel_field(view, points)
    cosine = np.maximum(dot(normals, towards), 1e-12)
    axis = np.cross(towards, np.eye(3)[np.abs(towards).argmin(axis=1)])
    axis /= np.linalg.norm(axis, axis=1, keepdims=True)
    other = np.cross(towards, axis)
    return np.abs(np.stack([dot(normals, axis), dot(normals, other)], axis=1)) / cosine[:, None] * texel[:, None]


def _along_light(outcome: Outcome, view: ShadowView, points: Array, slope: Array) -> Array:
    """World units along the light that a bias subtracts from the compare depth, (N,)."""
    used = outcome.frame.used[0]
    bias, filter_ = used.bias, used.filter
    assert filter_ is not None
    if isinstance(bias, ConstantBias):
        return np.full(len(points), bias.world)
    step = _world_step(outcome, view, points)
    if isinstance(bias, ClipBias):
        return bias.clip * (0.5 if view.clip.zero_to_one else 1.0) * step / (1.0 if view.clip.zero_to_one else 2.0)
    if isinstance(bias, ReceiverPlaneBias):
        assert used.target is not None
        facet = FACET_SLOPE * filter_.reach_texels * texel_field(view, points)
        slack = filter_.slack_texels * slope.sum(axis=1)
        return np.asarray(1.5 * used.target.quantum * step + facet + slack + rounding(outcome))
    assert isinstance(bias, NoBias | SlopeScaledBias)
    if isinstance(bias, SlopeScaledBias):
        return bias.factor * slope.max(axis=1)
    return np.zeros(len(points))


def rounding(outcome: Outcome) -> float:
    """The renderer's own figure for float32 rounding in the derived bias."""
    frame = outcome.frame
    centre = outcome.picture.scene.bounds.mean(axis=0)
    left, right, _, _ = frame.camera.window(frame.size)
    reach = np.abs(np.asarray(frame.camera.position) - centre).max()
    reach += frame.far * np.hypot(1.0, np.abs([left, right]).max())
    view = frame.used[0].views[0]
    offset = np.asarray(getattr(frame.lights[0], "position", centre)) - centre
    if view.projection == "orthographic":
        offset = transform(view.view_from_world, centre)
    return float(ROUNDINGS * 2.0**-24 * max(reach, np.abs(offset).max()))


def default_allowance(reach: float, filter_: Filter, texel: float) -> float:
    """World units that the derived bias subtracts under an overhead light, format aside; `reach` is the scene's size."""
    return ROUNDINGS * 2.0**-24 * reach + FACET_SLOPE * filter_.reach_texels * texel


def _world_step(outcome: Outcome, view: ShadowView, points: Array) -> Array:
    """World units along the light per unit of stored depth, (N,)."""
    target = outcome.frame.used[0].target
    assert target is not None
    if view.projection == "orthographic":
        return np.full(len(points), view.far - view.near)
    depth = -transform(view.view_from_world, points)[:, 2]
    if view.projection == "cube":
        depth = np.abs(transform(view.view_from_world, points)).max(axis=1)
    if target.is_depth:
        along = depth**2 * (view.far - view.near) / (view.far * view.near)
        if view.clip == ClipSpace(True, True) and target is Target.DEPTH32F:
            along = along * view.near / depth  # reversed floats round relative to 1 / depth
        return np.asarray(along)
    low, high = metric_range(view.projection, view.clip, view.near, view.far)
    if view.projection == "cube":
        return np.full(len(points), low + high)
    return np.full(len(points), abs((low + high) / view.clip_from_view[2, 2]))


def _self_shadowed(slope: Array, allowed: Array) -> Array:
    """P(sx u + sy v > allowed), u and v uniform in [-1/2, 1/2]; slopes (N, 2)."""
    grid = (np.arange(16) + 0.5) / 16 - 0.5
    u, v = (part.ravel() for part in np.meshgrid(grid, grid))
    share = np.zeros(len(slope))
    for a, b in zip(u, v, strict=True):
        share += slope[:, 0] * a + slope[:, 1] * b > allowed
    return share / len(u)


def _slope_scaled_blocked(
    outcome: Outcome, view: ShadowView, rows: NDArray[np.int64], start: Array, towards: Array, own: NDArray[np.int32]
) -> Bools:
    """Polygon offset pushes every caster away by its own slope: blocked where one still lies in front."""
    bias = outcome.frame.used[0].bias
    assert isinstance(bias, SlopeScaledBias)
    rays = outcome.truth.rays
    blocked, gap = rays.blocked(own, start, towards, np.full(len(own), np.inf) if isinstance(
        outcome.picture.light, DirectionalLight) else outcome.picture.light.to_light(start + rays.origin)[1])  # fmt: skip
    result = np.zeros(len(own), dtype=bool)
    some = np.flatnonzero(blocked)
    if len(some) == 0:
        return result
    # The caster stored in the map is the one nearest to the light: shoot back from it.
    far = np.where(np.isfinite(gap[some]), gap[some], 0.0)
    hit, place = rays.first_hits(
        start[some] + towards[some] * (0.5 * far)[:, None], towards[some], np.full(len(some), np.inf)
    )
    normal = rays.normals[np.maximum(hit, 0)]
    facing = normal * np.sign(dot(normal, towards[some]))[:, None]
    slope = _slope(view, outcome.picture.light, place + rays.origin, facing)
    result[some] = (hit < 0) | (bias.factor * slope.max(axis=1) < dot(place - start[some], towards[some]))
    return result
