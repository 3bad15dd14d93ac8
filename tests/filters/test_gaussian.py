"""Gaussian: the weights that others compute from few hardware taps, its edge, its reach."""

from __future__ import annotations

import numpy as np
import pytest

import glshadow as gs
from glshadow.shadows.filters.gaussian import BELLS, bell_weights

from .images import along_x, seen, vertical_edge

EPS = np.finfo(np.float64).eps
# offset and weight of the hardware's bilinear taps by the fraction s, as Castano 2013 gives them (Babylon.js, Bevy and others)
TAPS = {
    1: lambda s: [((2 - s) / (3 - 2 * s) - 1, 3 - 2 * s), (s / (1 + 2 * s) + 1, 1 + 2 * s)],
    2: lambda s: [
        ((3 - 2 * s) / (4 - 3 * s) - 2, 4 - 3 * s),
        ((3 + s) / 7, 7.0),
        (s / (1 + 3 * s) + 2, 1 + 3 * s),
    ],
    3: lambda s: [
        ((5 - 4 * s) / (6 - 5 * s) - 3, 6 - 5 * s),
        ((16 - 4 * s) / (28 - 11 * s) - 1, 28 - 11 * s),
        ((5 + 7 * s) / (17 + 11 * s) + 1, 17 + 11 * s),
        (s / (1 + 5 * s) + 3, 1 + 5 * s),
    ],
}


@pytest.mark.parametrize("radius", list(BELLS))
@pytest.mark.parametrize("fraction", [0.0, 0.25, 0.6, 0.999])
def test_weights_equal_those_of_the_hardware_taps(radius: int, fraction: float) -> None:
    expected = np.zeros(2 * radius + 2)
    for offset, weight in TAPS[radius](fraction):
        left = int(np.floor(offset))
        share = offset - left
        expected[left + radius] += weight * (1 - share)
        if share > 0.0:
            expected[left + radius + 1] += weight * share
    np.testing.assert_allclose(bell_weights(fraction, radius), expected / expected.sum(), atol=8 * EPS)


@pytest.mark.parametrize("radius", list(BELLS))
def test_straight_edge_is_the_sum_of_its_weights(radius: int) -> None:
    x = np.linspace(10.0, 30.0, 801)
    found = seen(gs.Gaussian(radius), vertical_edge(), along_x(x))
    base = np.floor(x - 0.5)
    texels = base[:, None] - radius + np.arange(2 * radius + 2)
    expected = (bell_weights(x - 0.5 - base, radius) * (texels >= 20)).sum(axis=1)
    np.testing.assert_allclose(found, expected, atol=64 * EPS)
    assert (np.diff(found) >= -64 * EPS).all()
    np.testing.assert_allclose(found + found[::-1], 1.0, atol=64 * EPS)  # no edge is shifted


@pytest.mark.parametrize("given", [{"radius": 0}, {"radius": 4}, {"radius": 1.5}])
def test_settings_are_checked(given: dict[str, float]) -> None:
    with pytest.raises(gs.SettingsError, match="Gaussian radius must be"):
        gs.Gaussian(**given)  # type: ignore[arg-type]
