"""Prefiltered moment filters in float64: what is exact, what is a bound, and how much light leaks where it does."""

from __future__ import annotations

import numpy as np
import pytest

import glshadow as gs
from glshadow.core.spaces import Array
from glshadow.shadows.filters.moments import MomentFilter, spread
from glshadow.shadows.filters.msm import least_before
from scripts.shaders.variants import MOMENTS

BOUNDS = tuple(each for each in MOMENTS if not isinstance(each, gs.BabylonEsm))
PLANES = (1e-5, 1e-3, 1e-2, 0.05)  # slope of a plane, in depth from near to far, per texel


def visibility_of(kind: MomentFilter, depths: Array, weights: Array, own: float, slope: Array | None = None) -> float:
    """Visibility of a receiver over a kernel that contains depths with weights."""
    means = (weights[:, None] * kind.encoded(depths)).sum(axis=0)[None]
    deviation, extent = spread(kind.radius, np.zeros((1, 2)) if slope is None else slope[None])
    return float(kind.lit(np.array([own]), means, deviation, extent)[0])


def kernel(radius: int, fraction: float) -> tuple[Array, Array]:
    """Texels from the receiver along a row, and their weights: a box, filtered bilinearly."""
    texels = np.arange(-radius, radius + 2) - fraction
    weights = np.convolve(np.ones(2 * radius + 1), [fraction, 1.0 - fraction][::-1]) / (2 * radius + 1)
    return texels, weights


@pytest.mark.parametrize("kind", BOUNDS, ids=str)
@pytest.mark.parametrize("slope", PLANES)
@pytest.mark.parametrize("fraction", [0.0, 0.3, 0.5])
def test_plane_does_not_shadow_itself(kind: MomentFilter, slope: float, fraction: float) -> None:
    """At any slope: the bias equals the kernel's spread of depth and no more. A moment bias leaves a small residue."""
    texels, weights = kernel(kind.radius, fraction)
    for direction in ((1.0, 0.0), (1.0, 0.7)):
        gradient = slope * np.array(direction)
        depths = 0.5 + np.add.outer(texels * gradient[0], texels * gradient[1])
        lit = visibility_of(kind, depths.ravel(), np.outer(weights, weights).ravel(), 0.5, gradient)
        assert lit >= 1.0 - 2e-3, "a moment bias of 6e-5 costs its square root"


@pytest.mark.parametrize("kind", [gs.Evsm(), gs.Msm()], ids=str)
def test_steep_plane_without_bias_is_darkened(kind: MomentFilter) -> None:
    texels, weights = kernel(kind.radius, 0.3)
    depths = 0.5 + 0.05 * texels
    assert visibility_of(kind, depths, weights, 0.5) < 0.9


@pytest.mark.parametrize("kind", BOUNDS, ids=str)
@pytest.mark.parametrize("share", [0.1, 0.5, 0.9])
def test_two_distant_depths_are_separated(kind: MomentFilter, share: float) -> None:
    """A caster at 0.2 over part of the kernel, the receiver's plane at 0.9 over the rest."""
    lit = visibility_of(kind, np.array([0.2, 0.9]), np.array([1.0 - share, share]), 0.9)
    half = getattr(kind, "half", False)
    bleeding = getattr(kind, "bleeding", 0.0)
    expected = max(share - bleeding, 0.0) / (1.0 - bleeding)
    assert lit == pytest.approx(expected, abs=0.02 if half else 5e-3)


def test_light_bleeding_matches_its_closed_form() -> None:
    """Three depths, all of them before the receiver: any visibility is light bleeding."""
    depths, weights = np.array([0.1, 0.8]), np.array([0.5, 0.5])
    bled = {str(kind): visibility_of(kind, depths, weights, 0.9) for kind in (gs.Vsm(), gs.Evsm(), gs.Msm(), gs.Esm())}
    # Chebyshev: variance .49 / (.49 + .9^2) in x from -1 to 1
    assert bled["vsm:1,0"] == pytest.approx(0.49 / (0.49 + 0.9**2), abs=1e-3)
    assert bled["esm:1,80"] == pytest.approx(0.5 * np.exp(-8.0), rel=1e-9)
    assert bled["evsm:1,0,4"] < 0.01
    assert bled["msm:1,0"] < 0.2
    less = visibility_of(gs.Vsm(1, 0.3), depths, weights, 0.9)
    assert less == pytest.approx((0.49 / (0.49 + 0.9**2) - 0.3) / 0.7, abs=1e-3)


@pytest.mark.parametrize("bounded", [False, True])
def test_bound_is_a_lower_bound_of_shadow(bounded: bool) -> None:
    """Random distributions have at least as much weight before x as the bound; one of three depths attains it."""
    rng = np.random.default_rng(5)
    for count in (3, 4, 9):
        z, weights = rng.uniform(-1.0, 1.0, (200, count)), rng.dirichlet(np.ones(count), 200)
        moments = np.stack([(weights * z**k).sum(axis=1) for k in range(1, 5)], axis=-1)
        for x in (z[:, 0] + 1e-9, rng.uniform(-0.99, 0.99, 200)):
            before = (weights * (z < x[:, None])).sum(axis=1)
            bound = least_before(moments, x, bounded)
            assert (bound <= before + 1e-5).all()
        if count == 3:
            own = least_before(moments, z[:, 0], bounded)
            np.testing.assert_allclose(own, (weights * (z < z[:, :1])).sum(axis=1), atol=1e-4)
    loose, tight = (least_before(moments, x, each) for each in (False, True))
    assert (tight >= loose - 1e-6).all()
    assert (tight > loose + 1e-3).any()


@pytest.mark.parametrize("half", [False, True])
def test_moments_are_recovered_from_their_encoding(half: bool) -> None:
    kind = gs.Msm(half=half)
    depth = np.linspace(0.0, 1.0, 101)
    stored = kind.encoded(depth)
    if half:
        assert stored.min() >= -1e-12
        assert stored.max() <= 1.0 + 1e-12
    x = 2.0 * depth - 1.0
    np.testing.assert_allclose(kind._powers(stored), np.stack([x, x**2, x**3, x**4], axis=-1), atol=1e-12)


def test_babylon_esm_at_the_stored_receiver() -> None:
    """1 - exp(0): dark; close: exp(0), lit."""
    one = np.ones(1)
    assert visibility_of(gs.BabylonEsm(0), np.array([0.4]), one, 0.4) == pytest.approx(0.0)
    assert visibility_of(gs.BabylonEsm(0), one, one, 0.4) == pytest.approx(1.0)  # nothing is stored
    assert visibility_of(gs.BabylonEsm(0, close=True), np.array([0.4]), one, 0.4) == pytest.approx(1.0)
    assert visibility_of(gs.BabylonEsm(0, close=True), np.array([0.4]), one, 0.5) == pytest.approx(np.exp(-5.0))


@pytest.mark.parametrize(
    ("kind", "given"),
    [
        (gs.Esm, {"exponent": 90.0}), (gs.Esm, {"radius": 17}), (gs.Vsm, {"bleeding": 1.0}), (gs.Evsm, {"components": 3}),
        (gs.Msm, {"half": 1}), (gs.BabylonEsm, {"depth_scale": 0.0}),
    ],
)  # fmt: skip
def test_settings_are_checked(kind: type[gs.Filter], given: dict[str, float]) -> None:
    with pytest.raises(gs.SettingsError, match=f"{kind.__name__} {next(iter(given))} must be"):
        kind(**given)


def test_prefiltered_maps_need_depths() -> None:
    with pytest.raises(gs.SettingsError, match="leave target at None, got r32f"):
        gs.Shadow(filter=gs.Vsm(), target=gs.Target.R32F)
