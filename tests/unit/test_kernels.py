"""Percentage closer filtering: weights, plateaus, ramps and levels."""

from __future__ import annotations

import numpy as np
import pytest

from glshadow.core.filters import MAX_RADIUS, Hard, Pcf, box_weights, pcf
from glshadow.errors import SettingsError

RADII = range(MAX_RADIUS + 1)
ATOL = 4 * np.finfo(np.float64).eps  # sums of at most 10 weights of at most 1


def vertical_edge(width: int = 40, edge: int = 20, height: int = 24) -> np.ndarray:
    """Lit from column `edge` on: the true edge is at x = edge texels."""
    return np.broadcast_to((np.arange(width) >= edge).astype(np.float64), (height, width))


def along_x(x: np.ndarray, y: float = 12.0) -> np.ndarray:
    return np.stack([x, np.full_like(x, y)], axis=-1)


@pytest.mark.parametrize("radius", RADII)
def test_weights_sum_to_one_and_are_the_box(radius: int) -> None:
    fraction = np.linspace(0.0, 1.0, 64, endpoint=False)
    weights = box_weights(fraction, radius)
    assert weights.shape == (64, 2 * radius + 2)
    assert (weights >= 0.0).all()
    np.testing.assert_allclose(weights.sum(axis=-1), 1.0, atol=ATOL)
    # The definition: the mean of 2 radius + 1 bilinear taps (1 - f, f), one texel apart.
    taps = np.zeros_like(weights)
    for tap in range(2 * radius + 1):
        taps[:, tap] += (1.0 - fraction) / (2 * radius + 1)
        taps[:, tap + 1] += fraction / (2 * radius + 1)
    np.testing.assert_allclose(weights, taps, atol=ATOL)


@pytest.mark.parametrize("radius", RADII)
def test_plateaus_are_zero_and_one(radius: int) -> None:
    """To the last bit: weights that do not sum to one would show here first."""
    width = 2 * radius + 1
    x = np.linspace(8.0, 32.0, 481)
    visibility = pcf(vertical_edge(), along_x(x), radius)
    dark, light = x <= 20.0 - 0.5 * width, x >= 20.0 + 0.5 * width
    np.testing.assert_array_equal(visibility[dark], 0.0)
    np.testing.assert_array_equal(visibility[light], 1.0)
    assert dark.any()
    assert light.any()


@pytest.mark.parametrize("radius", RADII)
def test_straight_edge_is_a_linear_ramp_centred_on_the_edge(radius: int) -> None:
    """K bilinear taps a texel apart: a ramp of width K texels, 1/2 on the edge itself; in x and in y alike."""
    width = 2 * radius + 1
    x = np.linspace(8.0, 32.0, 481)
    expected = np.clip(0.5 + (x - 20.0) / width, 0.0, 1.0)
    np.testing.assert_allclose(pcf(vertical_edge(), along_x(x), radius), expected, atol=1e-14)
    turned = pcf(vertical_edge().T, along_x(x)[:, ::-1], radius)
    np.testing.assert_allclose(turned, expected, atol=1e-14)
    assert pcf(vertical_edge(), along_x(np.array([20.0])), radius)[0] == pytest.approx(0.5, abs=1e-14)


def test_radius_zero_is_the_hardware_comparison() -> None:
    """Bilinear weights from frac(u S - 0.5), the four texels round the position (Luna prints frac(u S))."""
    lit = np.array([[0.0, 1.0, 0.0], [1.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    for x, y in [(1.3, 1.9), (0.5, 0.5), (1.5, 1.0), (2.25, 1.75), (1.0, 2.0)]:
        i, j = int(np.floor(x - 0.5)), int(np.floor(y - 0.5))
        s, t = x - 0.5 - i, y - 0.5 - j
        texel = {(a, b): lit[min(max(b, 0), 2), min(max(a, 0), 2)] for a in (i, i + 1) for b in (j, j + 1)}
        bottom = (1 - s) * texel[i, j] + s * texel[i + 1, j]
        top = (1 - s) * texel[i, j + 1] + s * texel[i + 1, j + 1]
        assert pcf(lit, [[x, y]], 0)[0] == pytest.approx((1 - t) * bottom + t * top, abs=ATOL)


def test_texel_centre_is_the_texel() -> None:
    rng = np.random.default_rng(7)
    lit = rng.integers(0, 2, size=(6, 9)).astype(np.float64)
    y, x = np.mgrid[0:6, 0:9]
    centres = np.stack([x.ravel() + 0.5, y.ravel() + 0.5], axis=-1)
    np.testing.assert_array_equal(pcf(lit, centres, 0), lit.ravel())


def test_three_by_three_has_ten_levels_on_a_slanted_edge() -> None:
    """At texel centres nine comparisons with equal weight: 0/9 to 9/9, every one of them, and nothing between."""
    y, x = np.mgrid[0:64, 0:64]
    lit = ((x + 0.5) * np.cos(0.4) + (y + 0.5) * np.sin(0.4) > 40.0).astype(np.float64)
    centres = np.stack([x[2:-2, 2:-2].ravel() + 0.5, y[2:-2, 2:-2].ravel() + 0.5], axis=-1)
    ninths = pcf(lit, centres, 1) * 9.0
    np.testing.assert_allclose(ninths, np.rint(ninths), atol=1e-13)
    assert set(np.rint(ninths).astype(int)) == set(range(10))


def test_outside_counts_as_the_nearest_texel() -> None:
    lit = vertical_edge(8, 4, 8)
    positions = np.array([[-50.0, 3.0], [60.0, 3.0], [0.0, -9.0], [8.0, 99.0]])
    np.testing.assert_allclose(pcf(lit, positions, 2), [0.0, 1.0, 0.0, 1.0], atol=2 * ATOL)


def test_settings() -> None:
    assert (Hard().radius, Hard().slack_texels, Hard().reach_texels) == (0, 0.5, 0.5)
    for radius in RADII:
        filter_ = Pcf(radius)
        assert (filter_.slack_texels, filter_.reach_texels) == (1.0, radius + 1.0)
    assert Pcf().radius == 1


@pytest.mark.parametrize("radius", [-1, MAX_RADIUS + 1, 12, 1.0, "1", None, True])
def test_radius_is_checked(radius: object) -> None:
    with pytest.raises(
        SettingsError, match=rf"filter radius must be an integer in \[0, {MAX_RADIUS}\] texels, got {radius!r}"
    ):
        Pcf(radius)  # type: ignore[arg-type]


@pytest.mark.parametrize("radius", RADII)
def test_reach_covers_every_texel_that_is_read(radius: int) -> None:
    """A texel centre further away than the reach never matters; one just inside does."""
    reach = Pcf(radius).reach_texels
    for x in (20.0, 20.3, 20.5, 20.9):
        for column in range(40):
            lit = np.zeros((24, 40))
            lit[:, column] = 1.0
            seen = pcf(lit, [[x, 12.0]], radius)[0]
            assert (seen > 0.0) == (abs(column + 0.5 - x) < reach - 1e-12)
