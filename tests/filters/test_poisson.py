"""Poisson: four texels, and five levels of visibility only."""

from __future__ import annotations

import numpy as np
import pytest

import glshadow as gs
from glshadow.shadows.filters.poisson import PLACES

from .images import along_x, seen, vertical_edge


@pytest.mark.parametrize("radius", [1.0, 3.0])
def test_edge_visibility_counts_its_taps(radius: float) -> None:
    x = np.linspace(10.0, 30.0, 801)
    found = seen(gs.Poisson(radius), vertical_edge(), along_x(x))
    expected = (np.floor(x[:, None] + radius * PLACES[:, 0]) >= 20).mean(axis=1)
    np.testing.assert_array_equal(found, expected)
    assert set(found) == {0.0, 0.25, 0.5, 0.75, 1.0}


def test_reach_covers_every_texel_read() -> None:
    kind = gs.Poisson(3.0)
    for column in range(40):
        lit = np.zeros((40, 40))
        lit[:, column] = 1.0
        assert seen(kind, lit, [[20.3, 20.1]])[0] == 0.0 or abs(column + 0.5 - 20.3) <= kind.reach_texels
    assert np.hypot(*PLACES.T).max() <= kind.radius / kind.radius_texels


@pytest.mark.parametrize("given", [{"radius_texels": 0.4}, {"radius_texels": 17}, {"rotate": 1}])
def test_settings_are_checked(given: dict[str, float]) -> None:
    with pytest.raises(gs.SettingsError, match=f"Poisson {next(iter(given))} must be"):
        gs.Poisson(**given)  # type: ignore[arg-type]
