"""Properties for any input: inverses, monotony, orthonormality, ranges and invariances of the float64 core.

Deterministic (derandomize) and free of deadlines, which mean nothing on a shared machine.
"""

from __future__ import annotations

import numpy as np
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from glshadow.core.spaces import (
    CLIP_SPACES,
    Array,
    ClipSpace,
    bias_matrix,
    look_at,
    orthographic,
    perspective,
    project,
    translation,
)
from glshadow.lights import PointLight, SpotLight
from glshadow.shadows.bias import normal_bias, receiver_plane_from_derivatives, receiver_plane_from_normal
from glshadow.shadows.filters import FILTERS, Filter, Pcf
from glshadow.shadows.filters.filter import Needs
from glshadow.shadows.filters.pcf import MAX_RADIUS, box_weights
from glshadow.shadows.metric import metric_range, pack, projected_metric, radial_metric, unpack, window_depth

from ..filters.images import seen

settings.register_profile("glshadow", derandomize=True, deadline=None, max_examples=100, database=None)
deterministic = settings(settings.get_profile("glshadow"))

EPS = np.finfo(np.float64).eps

clips = st.sampled_from(CLIP_SPACES)
kinds = st.sampled_from(["orthographic", "perspective"])


def rounded(low: float, high: float, digits: int = 9) -> st.SearchStrategy[float]:
    """Decimal numbers: without the subnormal ones, whose products underflow."""
    return st.floats(low, high).map(lambda x: round(x, digits))


fractions = rounded(0.0, 1.0, 12)
coordinates = rounded(-1e3, 1e3, 6)
vectors = st.tuples(coordinates, coordinates, coordinates).map(np.array)
directions = vectors.filter(lambda v: np.linalg.norm(v) > 1e-3)


@st.composite
def ranges(draw: st.DrawFn) -> tuple[float, float]:
    """near and far with far / near up to 1e6 and down to 1.001."""
    near = draw(st.floats(1e-3, 1e3))
    return near, near * draw(st.floats(1.001, 1e6))


def clip_of(kind: str, clip: ClipSpace, near: float, far: float, distance: float) -> Array:
    build = orthographic if kind == "orthographic" else perspective
    return project(build(-1, 1, -1, 1, near, far, clip), np.array([0.0, 0.0, -distance]))


def metric_of(kind: str, clip: ClipSpace, near: float, far: float, distance: float) -> float:
    position = clip_of(kind, clip, near, far, distance)
    return float(projected_metric(position[2], clip, *metric_range(kind, clip, near, far)))


def metric_error(near: float, far: float) -> float:
    """Rounding of (z - near) / (far - near) by way of clip z: a few eps of the largest terms, far / (far - near).

    0..1 reversed for spot lights: clip z = near (far - z) / (far - near), divided by near again, so no worse.
    """
    return 16 * EPS * far / (far - near)


@deterministic
@given(kinds, clips, ranges(), fractions)
def test_inverse_of_the_projected_metric(
    kind: str, clip: ClipSpace, planes: tuple[float, float], fraction: float
) -> None:
    near, far = planes
    distance = near + fraction * (far - near)
    metric = metric_of(kind, clip, near, far, distance)
    back = near + metric * (far - near)  # the metric is linear from near to far in every convention
    assert abs(back - distance) <= metric_error(near, far) * (far - near) + 4 * EPS * far


@deterministic
@given(ranges(), fractions)
def test_inverse_of_the_radial_metric(planes: tuple[float, float], fraction: float) -> None:
    near, far = planes
    distance = 2.0 * far * fraction
    back = float(radial_metric(distance, near, far)) * (near + far) - near
    assert abs(back - distance) <= 8 * EPS * (distance + near + far)


@deterministic
@given(kinds, clips, ranges(), fractions, fractions)
def test_the_metric_grows_away_from_the_light(
    kind: str, clip: ClipSpace, planes: tuple[float, float], a: float, b: float
) -> None:
    near, far = planes
    low, high = (near + fraction * (far - near) for fraction in sorted((a, b)))
    assume((high - low) / (far - near) > 2 * metric_error(near, far))
    assert metric_of(kind, clip, near, far, low) < metric_of(kind, clip, near, far, high)
    assert radial_metric(low, near, far) < radial_metric(high, near, far)


@deterministic
@given(kinds, clips, ranges(), fractions, fractions)
def test_window_depth_orders_like_the_metric(
    kind: str, clip: ClipSpace, planes: tuple[float, float], a: float, b: float
) -> None:
    near, far = planes
    low, high = (near + fraction * (far - near) for fraction in sorted((a, b)))
    # Hyperbolic for spot lights: resolvable only where its own step, ~ near far dz / z^2, exceeds the rounding.
    step = (high - low) / (far - near) * (near * far / high**2 if kind == "perspective" else 1.0)
    assume(step > 32 * EPS * far / (far - near))
    depths = [float(window_depth(clip_of(kind, clip, near, far, z)[2:], clip)) * clip.sign for z in (low, high)]
    assert depths[0] < depths[1]


@deterministic
@given(kinds, clips, ranges(), fractions, st.floats(1e-6, 1e6))
def test_metric_and_depth_are_invariant_to_scale(
    kind: str, clip: ClipSpace, planes: tuple[float, float], fraction: float, scale: float
) -> None:
    near, far = planes
    distance = near + fraction * (far - near)
    tolerance = 2 * metric_error(near, far)
    one, other = (metric_of(kind, clip, k * near, k * far, k * distance) for k in (1.0, scale))
    assert abs(one - other) <= tolerance
    depths = [window_depth(clip_of(kind, clip, k * near, k * far, k * distance)[2:], clip) for k in (1.0, scale)]
    assert abs(depths[0] - depths[1]) <= tolerance
    assert (
        abs(radial_metric(distance, near, far) - radial_metric(scale * distance, scale * near, scale * far)) <= 8 * EPS
    )


@deterministic
@given(rounded(0.0, 1.0 - 2.0**-24, 12))
def test_unpack_inverts_pack(value: float) -> None:
    packed = pack(value)
    assert (packed >= -1e-9).all()  # v 255^3 is rounded at 2^-29, which a digit 0 may show as -2^-29 / 255
    assert (packed <= 1.0).all()
    assert abs(unpack(packed) - value) <= 4 * EPS
    stored = np.rint(packed * 255.0) / 255.0
    assert abs(unpack(stored) - value) <= 0.5 * 255.0**-4 + 4 * EPS


@deterministic
@given(hnp.arrays(np.uint8, 4))
def test_pack_recovers_the_bytes(digits: np.ndarray) -> None:
    """The same number; and the same bytes unless rounding can carry: 0 0 1 0 may return as 255 254 0 0."""
    value = unpack(digits / 255.0)
    assume(value <= 1.0 - 2.0**-24)
    again = np.rint(pack(value) * 255.0)
    assert abs(unpack(again / 255.0) - value) <= 4 * EPS
    if ((digits > 0) & (digits < 255)).all():
        np.testing.assert_array_equal(again, digits)


@deterministic
@given(rounded(-10.0, 10.0), rounded(-10.0, 10.0))
def test_packing_keeps_the_order(a: float, b: float) -> None:
    """Clamped, never wrapped: nothing beyond far appears near. Monotonic to half a step of the finest byte."""
    low, high = sorted((a, b))
    stored = [float(unpack(np.rint(pack(value) * 255.0) / 255.0)) for value in (low, high)]
    assert stored[0] <= stored[1] + 255.0**-4


@deterministic
@given(vectors, directions, directions)
def test_look_at_is_a_rigid_motion(position: Array, offset: Array, up: Array) -> None:
    view = look_at(position, position + offset, up)
    axes = view[:3, :3]
    sine = np.linalg.norm(np.cross(offset, up)) / (np.linalg.norm(offset) * np.linalg.norm(up))
    # The cross product of two nearly parallel vectors loses 1 / sine; below 1e-6 another axis takes over.
    tolerance = 16 * EPS / (sine if sine > 1e-6 else 1e-6)
    np.testing.assert_allclose(axes @ axes.T, np.eye(3), rtol=0, atol=tolerance)
    assert abs(np.linalg.det(axes) - 1.0) <= tolerance
    np.testing.assert_allclose(project(view, position)[:3], 0.0, rtol=0, atol=64 * EPS * (1.0 + np.abs(position).max()))
    ahead = project(view, position + offset)[:3]
    distance = np.linalg.norm(offset)
    size = np.abs(position).max() + distance
    np.testing.assert_allclose(
        ahead, [0.0, 0.0, -distance], rtol=0, atol=tolerance * distance + 64 * EPS * (1.0 + size)
    )


@deterministic
@given(vectors, directions, directions, vectors)
def test_look_at_is_translation_invariant(position: Array, offset: Array, up: Array, shift: Array) -> None:
    sine = np.linalg.norm(np.cross(offset, up)) / (np.linalg.norm(offset) * np.linalg.norm(up))
    assume(sine > 1e-3)
    here = look_at(position, position + offset, up)
    there = look_at(position + shift, position + offset + shift, up) @ translation(shift)
    size = 1.0 + np.abs(np.array([position, offset, shift])).max()
    # The direction is a difference of positions: eps size / |offset|, turned into roll by 1 / sine.
    tolerance = 64 * EPS * size / np.linalg.norm(offset) / sine
    np.testing.assert_allclose(there[:3, :3], here[:3, :3], rtol=0, atol=tolerance)
    np.testing.assert_allclose(there[:3, 3], here[:3, 3], rtol=0, atol=tolerance * size * 4)


@st.composite
def windows(draw: st.DrawFn) -> tuple[float, float, float, float]:
    """Off-centre windows, 0.01 to 10 across, edges within 10."""
    centre_x, centre_y = draw(st.floats(-5, 5)), draw(st.floats(-5, 5))
    half_x, half_y = draw(st.floats(0.005, 5)), draw(st.floats(0.005, 5))
    return (centre_x - half_x, centre_x + half_x, centre_y - half_y, centre_y + half_y)


@deterministic
@given(kinds, clips, ranges(), windows(), st.tuples(fractions, fractions, fractions), vectors, directions)
def test_points_inside_the_frustum_land_inside_clip_space(
    kind: str,
    clip: ClipSpace,
    planes: tuple[float, float],
    window: tuple[float, float, float, float],
    fraction: tuple[float, float, float],
    eye: Array,
    forward: Array,
) -> None:
    (near, far), (left, right, bottom, top) = planes, window
    distance = near + fraction[2] * (far - near)
    spread = 1.0 if kind == "orthographic" else distance
    x, y = left + fraction[0] * (right - left), bottom + fraction[1] * (top - bottom)
    view = look_at(eye, eye + forward)
    point = eye + np.array([x * spread, y * spread, -distance]) @ view[:3, :3]
    build = orthographic if kind == "orthographic" else perspective
    position = project(build(*window, near, far, clip) @ view, point)
    assert position[3] > 0
    uvz = project(bias_matrix(clip), position[:3] / position[3])[:3]
    # Positions of up to 1e3 and more: their rounding, over the size of the window and of the depth range.
    size = np.abs(eye).max() + 10.0 * spread + distance
    narrowest = min(right - left, top - bottom) * spread
    axes_error = 1e-9  # look_at with the default up close to the view direction
    slack_uv = (64 * EPS + axes_error) * size / narrowest
    slack_z = (64 * EPS + axes_error) * size / (far - near) * (far / near if kind == "perspective" else 1.0) + 1e-12
    assume(slack_uv < 0.01)
    assume(slack_z < 0.01)
    assert (uvz[:2] >= -slack_uv).all()
    assert (uvz[:2] <= 1.0 + slack_uv).all()
    assert -slack_z <= uvz[2] <= 1.0 + slack_z
    np.testing.assert_allclose(uvz[:2], fraction[:2], rtol=0, atol=slack_uv)


images = hnp.arrays(np.float64, st.tuples(st.integers(1, 12), st.integers(1, 12)), elements=st.sampled_from([0.0, 1.0]))
receivers = hnp.arrays(np.float64, st.tuples(st.integers(1, 8), st.just(2)), elements=rounded(-3.0, 15.0))
radii = st.integers(0, MAX_RADIUS)
kinds = st.sampled_from([each for kind in FILTERS for each in kind.variants() if each.needs is Needs.COMPARISON])
# A nearest texel may change where the position is rounded.
smooth_kinds = st.sampled_from([each for kind in FILTERS for each in kind.variants() if each.slack_texels == 1.0])


@deterministic
@given(images, receivers, kinds)
def test_visibility_is_between_zero_and_one(image: Array, positions: Array, kind: Filter) -> None:
    visibility = seen(kind, image, positions)
    assert visibility.shape == (len(positions),)
    assert (visibility >= 0.0).all()
    assert (visibility <= 1.0 + 128 * EPS).all()
    if image.min() == image.max():
        np.testing.assert_allclose(visibility, image.flat[0], rtol=0, atol=128 * EPS)
    np.testing.assert_allclose(seen(kind, 1.0 - image, positions), 1.0 - visibility, rtol=0, atol=128 * EPS)


@deterministic
@given(images, receivers, smooth_kinds, st.integers(1, 6), st.integers(1, 6))
def test_visibility_moves_with_whole_texels(image: Array, positions: Array, kind: Filter, dx: int, dy: int) -> None:
    moved = np.pad(image, ((dy, 0), (dx, 0)), mode="edge")
    # The fraction of a position moves by the rounding of x + dx.
    np.testing.assert_allclose(
        seen(kind, moved, positions + np.array([dx, dy])), seen(kind, image, positions), rtol=0, atol=128 * EPS
    )


@deterministic
@given(rounded(0.0, 0.999), radii)
def test_weights_are_a_partition(fraction: float, radius: int) -> None:
    weights = box_weights(fraction, radius)
    assert (weights >= 0.0).all()
    assert abs(weights.sum() - 1.0) <= 4 * EPS
    centre = weights @ np.arange(-radius, radius + 2)
    assert abs(centre - fraction) <= 16 * EPS * (radius + 1)  # centred on the receiver, so that no edge is shifted


@deterministic
@given(
    hnp.arrays(np.float64, 16, elements=st.floats(0.0, 1.0)),
    st.floats(0.0, 1.0),
    rounded(-3.0, 3.0),
    rounded(0.0, 0.5),
    rounded(0.0, 0.5),
    radii,
    rounded(0.0, 16.0),
)
def test_more_bias_is_never_darker(
    stored: Array, depth: float, slope: float, a: float, b: float, radius: int, x: float
) -> None:
    """A row of a shadow map, a receiver plane evaluated at each texel, and two biases."""
    plane = depth + slope * (np.arange(16) + 0.5 - x) / 16.0
    less, more = (
        seen(Pcf(radius), (plane - bias <= stored).astype(np.float64)[None], np.array([[x, 0.5]]))[0]
        for bias in sorted((a, b))
    )
    assert more >= less - 128 * EPS


gradients = hnp.arrays(np.float64, 2, elements=rounded(-1e3, 1e3, 6))
footprints = hnp.arrays(np.float64, (2, 2), elements=rounded(-1.0, 1.0))


@deterministic
@given(gradients, footprints, footprints, st.floats(1e-9, 1.0))
def test_receiver_plane_does_not_depend_on_the_screen(
    gradient: Array, footprint: Array, turn: Array, scale: float
) -> None:
    """Any two independent screen directions, of any length, span the same plane."""
    worst = 1.0
    for matrix in (footprint, turn):
        lengths = np.linalg.norm(matrix, axis=1)
        assume(lengths.min() > 1e-3)
        sine = abs(np.linalg.det(matrix)) / lengths.prod()
        assume(sine > 1e-2)
        worst *= lengths.max() / (lengths.min() * sine)
    tolerance = 256 * EPS * worst * (np.abs(gradient).max() + 1e-300)
    for uv in (footprint, scale * turn @ footprint):
        depth = uv @ gradient
        uvz = np.column_stack([uv, depth])
        np.testing.assert_allclose(receiver_plane_from_derivatives(*uvz), gradient, rtol=0, atol=tolerance)
        np.testing.assert_allclose(receiver_plane_from_normal(np.cross(*uvz)), gradient, rtol=0, atol=tolerance)


@deterministic
@given(vectors, directions, directions, rounded(0.0, 10.0))
def test_normal_bias_moves_against_the_normal_by_at_most_the_amount(
    position: Array, normal: Array, towards: Array, amount: float
) -> None:
    n, light = normal / np.linalg.norm(normal), towards / np.linalg.norm(towards)
    step = normal_bias(position, n, light, amount) - position
    rounding = 8 * EPS * (np.abs(position).max() + amount)
    assert np.isfinite(step).all()
    assert -amount * (1 + 4 * EPS) - rounding <= step @ n <= rounding
    np.testing.assert_allclose(np.cross(step, n), 0.0, atol=2 * rounding)
    doubled = normal_bias(position, n, light, 2 * amount) - position
    np.testing.assert_allclose(doubled, 2 * step, rtol=0, atol=6 * rounding)


@deterministic
@given(vectors, vectors, vectors)
def test_direction_to_a_light_is_translation_invariant(position: Array, point: Array, shift: Array) -> None:
    assume(np.linalg.norm(position - point) > 1e-2)
    towards, distance = PointLight(position=tuple(position)).to_light(point[None])
    moved_towards, moved_distance = PointLight(position=tuple(position + shift)).to_light((point + shift)[None])
    rounding = 16 * EPS * 3e3
    assert abs(distance[0] - np.linalg.norm(position - point)) <= rounding
    assert abs(moved_distance[0] - distance[0]) <= rounding
    np.testing.assert_allclose(moved_towards, towards, rtol=0, atol=rounding / distance[0] * 2)
    np.testing.assert_allclose(np.linalg.norm(towards), 1.0, rtol=1e-12)


@deterministic
@given(rounded(0.0, 89.0), rounded(0.1, 89.0), directions, rounded(0.0, 180.0), rounded(0.0, 180.0))
def test_cone_never_grows_with_the_angle(inner: float, outer: float, axis: Array, a: float, b: float) -> None:
    inner, outer = sorted((inner, outer))
    light = SpotLight(position=(0, 0, 0), direction=tuple(axis), inner_angle=inner, outer_angle=outer)
    forward = np.asarray(light.direction)
    side = np.cross(forward, np.eye(3)[np.argmin(np.abs(forward))])
    side /= np.linalg.norm(side)
    low, high = np.radians(sorted((a, b)))
    assume(high - low > 1e-6)  # cosines near 0 and 180 degrees hold half the digits
    strength = light.cone(5.0 * np.array([np.cos(t) * forward + np.sin(t) * side for t in (low, high)]))
    assert 0.0 <= strength[1] <= strength[0] <= 1.0
