"""Pcf and Hard: weights, plateaus, ramps, levels and reach."""

from __future__ import annotations

import numpy as np
import pytest

from glshadow.errors import SettingsError
from glshadow.shadows.filters import Hard, Pcf
from glshadow.shadows.filters.pcf import MAX_RADIUS, box_weights

from .images import along_x, seen, vertical_edge

RADII = range(MAX_RADIUS + 1)
ATOL = 4 * np.finfo(np.float64).eps  # sums of at most 10 weights of at most 1
PLATEAU = 128 * np.finfo(np.float64).eps  # sums of at most 100 products


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
def test_straight_edge_is_a_linear_ramp_centred_on_the_edge(radius: int) -> None:
    """K bilinear taps a texel apart: a ramp of width K texels, 1/2 on the edge itself; in x and in y alike."""
    width = 2 * radius + 1
    x = np.linspace(8.0, 32.0, 481)
    expected = np.clip(0.5 + (x - 20.0) / width, 0.0, 1.0)
    np.testing.assert_allclose(seen(Pcf(radius), vertical_edge(), along_x(x)), expected, atol=PLATEAU)
    turned = seen(Pcf(radius), vertical_edge().T, along_x(x)[:, ::-1])
    np.testing.assert_allclose(turned, expected, atol=PLATEAU)


def test_radius_zero_is_the_hardware_comparison() -> None:
    """Bilinear weights from frac(u S - 0.5), the four texels round the position (Luna prints frac(u S))."""
    lit = np.array([[0.0, 1.0, 0.0], [1.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    for x, y in [(1.3, 1.9), (0.5, 0.5), (1.5, 1.0), (2.25, 1.75), (1.0, 2.0)]:
        i, j = int(np.floor(x - 0.5)), int(np.floor(y - 0.5))
        s, t = x - 0.5 - i, y - 0.5 - j
        texel = {(a, b): lit[min(max(b, 0), 2), min(max(a, 0), 2)] for a in (i, i + 1) for b in (j, j + 1)}
        bottom = (1 - s) * texel[i, j] + s * texel[i + 1, j]
        top = (1 - s) * texel[i, j + 1] + s * texel[i + 1, j + 1]
        assert seen(Pcf(0), lit, [[x, y]])[0] == pytest.approx((1 - t) * bottom + t * top, abs=ATOL)


@pytest.mark.parametrize("kind", [Hard(), Pcf(0)], ids=str)
def test_texel_centre_is_the_texel(kind: Hard | Pcf) -> None:
    rng = np.random.default_rng(7)
    lit = rng.integers(0, 2, size=(6, 9)).astype(np.float64)
    y, x = np.mgrid[0:6, 0:9]
    centres = np.stack([x.ravel() + 0.5, y.ravel() + 0.5], axis=-1)
    np.testing.assert_array_equal(seen(kind, lit, centres), lit.ravel())


def test_three_by_three_has_ten_levels_on_a_slanted_edge() -> None:
    """At texel centres nine comparisons of equal weight: 0/9 to 9/9, each of them occurs, and nothing between."""
    y, x = np.mgrid[0:64, 0:64]
    lit = ((x + 0.5) * np.cos(0.4) + (y + 0.5) * np.sin(0.4) > 40.0).astype(np.float64)
    centres = np.stack([x[2:-2, 2:-2].ravel() + 0.5, y[2:-2, 2:-2].ravel() + 0.5], axis=-1)
    ninths = seen(Pcf(1), lit, centres) * 9.0
    np.testing.assert_allclose(ninths, np.rint(ninths), atol=1e-13)
    assert set(np.rint(ninths).astype(int)) == set(range(10))


def test_settings() -> None:
    assert (Hard().radius, Hard().slack_texels, Hard().reach_texels) == (0, 0.5, 0.5)
    for radius in RADII:
        assert (Pcf(radius).slack_texels, Pcf(radius).reach_texels) == (1.0, radius + 1.0)
    assert Pcf().radius == 1


@pytest.mark.parametrize("radius", [-1, MAX_RADIUS + 1, 12, 1.0, "1", None, True])
def test_radius_is_checked(radius: object) -> None:
    with pytest.raises(
        SettingsError, match=rf"Pcf radius must be an integer in \[0, {MAX_RADIUS}\] texels, got {radius!r}"
    ):
        Pcf(radius)  # type: ignore[arg-type]


@pytest.mark.parametrize("radius", RADII)
def test_reach_covers_every_texel_read(radius: int) -> None:
    """A texel centre beyond the reach never matters; one just inside does."""
    reach = Pcf(radius).reach_texels
    for x in (20.0, 20.3, 20.5, 20.9):
        for column in range(40):
            lit = np.zeros((24, 40))
            lit[:, column] = 1.0
            assert (seen(Pcf(radius), lit, [[x, 12.0]])[0] > 0.0) == (abs(column + 0.5 - x) < reach - 1e-12)
