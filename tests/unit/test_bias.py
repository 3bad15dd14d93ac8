"""Bias settings and formulas."""

from __future__ import annotations

import numpy as np
import pytest

from glshadow.core.spaces import CLIP_SPACES, Array, ClipSpace
from glshadow.errors import SettingsError
from glshadow.shadows.bias import (
    SNAP_TEXELS,
    ClipBias,
    ConstantBias,
    NoBias,
    NormalOffsetBias,
    ReceiverPlaneBias,
    SlopeScaledBias,
    bias_factor,
    normal_bias,
    receiver_plane_from_derivatives,
    receiver_plane_from_normal,
)
from glshadow.shadows.filters import Disc, Filter, Gaussian, Hard, Pcf, Poisson
from glshadow.shadows.metric import window_depth

COUNT = 400


def random_planes() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """True gradients (N, 2) and screen derivatives (N, 3) of (u, v, depth) on planes with those gradients."""
    rng = np.random.default_rng(20_160)
    gradient = rng.normal(size=(COUNT, 2)) * 10.0 ** rng.uniform(-3, 3, size=(COUNT, 1))
    duv = rng.normal(size=(2, COUNT, 2)) * 10.0 ** rng.uniform(-6, 0, size=(2, COUNT, 1))
    # Well-conditioned footprints: the determinant amplifies rounding by the product of lengths over the area.
    area = np.abs(duv[0, :, 0] * duv[1, :, 1] - duv[0, :, 1] * duv[1, :, 0])
    good = area > 1e-2 * np.linalg.norm(duv[0], axis=-1) * np.linalg.norm(duv[1], axis=-1)
    depth = np.einsum("knj,nj->kn", duv, gradient)
    dx, dy = (np.c_[duv[k], depth[k]][good] for k in range(2))
    return gradient[good], dx, dy


def test_receiver_plane_follows_both_of_lunas_derivations() -> None:
    gradient, dx, dy = random_planes()
    ours = receiver_plane_from_derivatives(dx, dy)
    scale = np.abs(gradient).max(axis=-1, keepdims=True)
    for k in range(len(gradient)):
        (ux, vx, zx), (uy, vy, zy) = dx[k], dy[k]
        # First: a step (du, dv) in the map is a step [dx dy] = [du dv] J^-1 on the screen, J = [[ux, vx], [uy, vy]];
        # the depth changes by dx zx + dy zy. Unit steps in u and in v give the two components.
        inverse = np.array([[vy, -vx], [-uy, ux]]) / (ux * vy - vx * uy)
        through_screen = [np.array([1.0, 0.0]) @ inverse @ [zx, zy], np.array([0.0, 1.0]) @ inverse @ [zx, zy]]
        # Second: the chain rule [zx zy] = [zu zv] [[ux, uy], [vx, vy]], solved for [zu zv] within the map.
        in_map = np.array([zx, zy]) @ np.array([[vy, -uy], [-vx, ux]]) / (ux * vy - uy * vx)
        # random_planes lets a conditioning of 1e2 through: 100 * a few eps, well below 1e-12 of the scale.
        np.testing.assert_allclose(ours[k], through_screen, rtol=0, atol=1e-12 * scale[k, 0])
        np.testing.assert_allclose(ours[k], in_map, rtol=0, atol=1e-12 * scale[k, 0])
    np.testing.assert_allclose(ours, gradient, rtol=0, atol=1e-12 * scale.max())
    assert (np.abs(ours - gradient) <= 1e-12 * scale).all()


def test_receiver_plane_from_normal_is_the_same_plane() -> None:
    gradient, dx, dy = random_planes()
    scale = np.abs(gradient).max(axis=-1, keepdims=True)
    from_normal = receiver_plane_from_normal(np.cross(dx, dy))
    assert (np.abs(from_normal - gradient) <= 1e-12 * scale).all()
    assert (np.abs(from_normal - receiver_plane_from_derivatives(dx, dy)) <= 1e-12 * scale).all()


def test_receiver_plane_predicts_the_depth_of_a_tap() -> None:
    """Depth at (u + du, v + dv) on a known plane: 0.3 u - 1.7 v + 0.2."""
    dx, dy = np.array([2e-3, 1e-3, 0.0]), np.array([-1e-3, 3e-3, 0.0])
    for derivative in (dx, dy):
        derivative[2] = 0.3 * derivative[0] - 1.7 * derivative[1]
    np.testing.assert_allclose(receiver_plane_from_derivatives(dx, dy), [0.3, -1.7], rtol=1e-12)
    np.testing.assert_allclose(receiver_plane_from_normal([0.3, -1.7, -1.0]), [0.3, -1.7], rtol=1e-15)


@pytest.mark.parametrize(
    ("dx", "dy"),
    [
        ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0)),
        ((1e-3, 2e-3, 0.5), (2e-3, 4e-3, 0.7)),  # parallel in the map: the plane contains the light ray
        ((1e-3, 2e-3, 0.5), (1e-3, 2e-3 * (1 + 1e-9), 0.7)),  # so nearly that float32 derivatives could not show it
        ((0.0, 0.0, 0.5), (1e-3, 0.0, 0.0)),
    ],
)
def test_receiver_plane_edge_on_is_zero(dx: tuple[float, ...], dy: tuple[float, ...]) -> None:
    np.testing.assert_array_equal(receiver_plane_from_derivatives(dx, dy), [0.0, 0.0])


def test_receiver_plane_from_normal_edge_on_is_zero() -> None:
    np.testing.assert_array_equal(
        receiver_plane_from_normal([[1.0, 2.0, 0.0], [1.0, 2.0, 4.0]]), [[0.0, 0.0], [-0.25, -0.5]]
    )


def test_small_footprints_are_not_singular() -> None:
    """Singular is measured against the Jacobian's own terms: a footprint of 1e-9 of the map is small, not edge-on."""
    np.testing.assert_allclose(
        receiver_plane_from_derivatives([1e-9, 0, 3e-9], [0, 1e-9, -2e-9]), [3.0, -2.0], rtol=1e-12
    )


def test_receiver_plane_needs_three_components() -> None:
    with pytest.raises(SettingsError, match=r"last axis of 3.*\(2,\)"):
        receiver_plane_from_derivatives([1.0, 2.0], [1.0, 2.0])


def test_normal_bias_closed_form() -> None:
    for degrees in (0.0, 30.0, 45.0, 89.0, 90.0, 150.0):
        towards = np.array([np.sin(np.radians(degrees)), np.cos(np.radians(degrees)), 0.0])
        moved = normal_bias(np.array([1.0, 2.0, 3.0]), np.array([0.0, 1.0, 0.0]), towards, 0.05)
        # sqrt(1 - c^2) loses half the digits where the sine is near 0.
        np.testing.assert_allclose(
            moved, [1.0, 2.0 - 0.05 * np.sin(np.radians(degrees)), 3.0], rtol=0, atol=0.05 * 2e-8
        )


def test_normal_bias_straight_above_moves_nothing() -> None:
    """A unit vector rounded over length 1: 1 - (N.L)^2 is negative; Babylon's shader gets NaN and loses the caster."""
    normal = np.array([0.282216260515, 0.940720868384, -0.188144173677])
    normal = normal / np.linalg.norm(normal) * (1.0 + 2.0**-40)
    assert 1.0 - (normal @ normal) ** 2 < 0.0
    position = np.array([[1.0, 2.0, 3.0]])
    np.testing.assert_array_equal(normal_bias(position, normal[None], normal[None], 0.05), position)


@pytest.mark.parametrize("clip", CLIP_SPACES, ids=str)
def test_bias_factor_moves_window_depth_alike(clip: ClipSpace) -> None:
    """Babylon's bias b moves window depth by b / 2 in every convention, away from the light."""
    bias, z, w = 0.01, 0.3, 4.0
    moved = z + clip.sign * bias * w * bias_factor(clip)
    step = window_depth([moved, w], clip) - window_depth([z, w], clip)
    assert step == pytest.approx(clip.sign * 0.5 * bias, rel=1e-12)


@pytest.mark.parametrize(
    ("build", "name"),
    [
        (lambda v: ConstantBias(v), "ConstantBias world"),
        (lambda v: SlopeScaledBias(factor=v), "SlopeScaledBias factor"),
        (lambda v: SlopeScaledBias(units=v), "SlopeScaledBias units"),
        (lambda v: NormalOffsetBias(v), "NormalOffsetBias texels"),
        (lambda v: ClipBias(0.0, normal=v), "ClipBias normal"),
    ],
)
@pytest.mark.parametrize("value", [-0.5, np.nan, np.inf])
def test_bias_settings_refuse(build: object, name: str, value: float) -> None:
    with pytest.raises(
        SettingsError, match=rf"{name} must be a finite number in \[0, inf\)( or None \(derived\))?, got {value}"
    ):
        build(value)  # type: ignore[operator]


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_clip_bias_may_be_negative_but_not_infinite(value: float) -> None:
    assert ClipBias(-1e-3).clip == -1e-3
    with pytest.raises(SettingsError, match=f"ClipBias clip must be a finite number, got {value}"):
        ClipBias(value)


def test_bias_settings_are_values() -> None:
    for value in (
        ReceiverPlaneBias(),
        ConstantBias(0.1),
        SlopeScaledBias(),
        NormalOffsetBias(),
        ClipBias(1e-3),
        NoBias(),
    ):
        assert value == type(value)(**vars(value))
        hash(value)


FILTERS: tuple[Filter, ...] = (Hard(), Pcf(0), Pcf(1), Pcf(4), Disc(), Disc(4.0, 64), Gaussian(), Poisson(3.0))


def tilted(count: int = 2000) -> tuple[Array, Array]:
    """Normals (N, 3) of planes under a light along +z, tilted by up to 89.9 degrees, every eighth along a diagonal of the map."""
    generator = np.random.default_rng(11)
    tilt, turn = np.radians(generator.uniform(0.0, 89.9, count)), generator.uniform(0.0, 2.0 * np.pi, count)
    turn[::8] = 0.25 * np.pi * (1.0 + 2.0 * generator.integers(0, 4, len(turn[::8])))
    normals = np.stack([np.sin(tilt) * np.cos(turn), np.sin(tilt) * np.sin(turn), np.cos(tilt)], axis=1)
    return normals, generator.uniform(8.0, 9.0, (count, 2))


def share_lit(filter_: Filter, bias: SlopeScaledBias | NormalOffsetBias, snapped: float = SNAP_TEXELS) -> Array:
    """Lit fraction on infinite planes through the origin, texels 1 wide; the plane is drawn `snapped` texels off along x and y."""
    normals, position = tilted()
    slope = normals[:, :2] / normals[:, 2:]  # of depth, which grows along -z
    points = np.column_stack([position, -(slope * position).sum(axis=1)])
    towards = np.broadcast_to((0.0, 0.0, 1.0), points.shape)
    moved = bias.moved(points, normals, towards, np.full(len(points), np.inf), np.hypot(*normals[:, :2].T))
    pushed = bias.polygon_offset[0] * np.abs(slope).max(axis=1) - snapped * np.abs(slope).sum(axis=1)

    def compare(texel: Array, _: Array) -> Array:
        stored = (slope * (texel + 0.5)).sum(axis=1) + pushed
        return np.asarray(-moved[:, 2] <= stored + 1e-9 * (1.0 + np.abs(stored)))[None]

    return filter_.visibility(moved[:, :2], compare)[0]


@pytest.mark.parametrize("filter_", FILTERS, ids=str)
@pytest.mark.parametrize("kind", [SlopeScaledBias, NormalOffsetBias])
def test_derived_bias_prevents_self_shadowing_of_planes(
    filter_: Filter, kind: type[SlopeScaledBias] | type[NormalOffsetBias]
) -> None:
    """At any slope: the closed form for every texel of the kernel. With a bias smaller by a sixth some planes shadow themselves."""
    bias = kind().derived(filter_.reach_texels)
    np.testing.assert_allclose(share_lit(filter_, bias), 1.0, rtol=0.0, atol=1e-12)  # sums of weights
    given = bias.factor if isinstance(bias, SlopeScaledBias) else bias.texels
    assert given is not None
    assert bias.shortfall(filter_.reach_texels, 1.0) == ""
    less = kind(given * 5.0 / 6.0)
    name = "factor" if kind is SlopeScaledBias else "texels"
    assert name in less.shortfall(filter_.reach_texels, 1.0)
    if not isinstance(filter_, Disc | Poisson):  # whose reach is that of a square around a round kernel
        assert (share_lit(filter_, less) < 1.0 - 1e-9).any()


def test_given_bias_is_kept() -> None:
    for bias in (SlopeScaledBias(1.1), NormalOffsetBias(1.5), ConstantBias(0.1), NoBias(), ReceiverPlaneBias()):
        assert bias.derived(2.0) is bias


@pytest.mark.parametrize("tilt", [5.0, 30.0, 44.0, 46.0])
def test_constant_bias_reports_its_maximum_tilt(tilt: float) -> None:
    """A plane of that tilt rises by sqrt(2) reach texels times its tangent, along the map's diagonal."""
    reach, texel = 2.0, 0.05
    said = ConstantBias(float(np.sqrt(2.0) * reach * texel * np.tan(np.radians(tilt)))).shortfall(reach, texel)
    assert (f"more than {tilt:.2g} degrees" in said) == (tilt < 45.0)
