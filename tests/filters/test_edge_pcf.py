"""EdgePcf: equal to `Pcf` at an edge, and what it misses."""

from __future__ import annotations

import numpy as np
import pytest

import glshadow as gs

from .images import along_x, seen, vertical_edge

EPS = np.finfo(np.float64).eps


@pytest.mark.parametrize("radius", [2, 3, 4])
def test_half_plane_equals_pcf(radius: int) -> None:
    """In every direction: a line through the square has corners on both sides, or separates the centre from them."""
    y, x = np.mgrid[:40, :40]
    places = np.random.default_rng(3).uniform(12.0, 28.0, (400, 2))
    for angle in np.linspace(0.0, 6.2, 13):
        lit = (np.cos(angle) * (x - 19.6) + np.sin(angle) * (y - 20.2) > 0.0).astype(float)
        whole = seen(gs.Pcf(radius), lit, places)
        np.testing.assert_allclose(seen(gs.EdgePcf(radius), lit, places), whole, atol=64 * EPS)
    positions = along_x(np.linspace(10.0, 30.0, 401))
    whole = seen(gs.Pcf(radius), vertical_edge(), positions)
    np.testing.assert_allclose(seen(gs.EdgePcf(radius), vertical_edge(), positions), whole, atol=64 * EPS)


def test_wire_between_the_blocks_is_missed() -> None:
    lit = np.ones((40, 40))
    lit[:, 18] = 0.0
    assert seen(gs.Pcf(4), lit, [[20.2, 20.2]])[0] < 1.0
    assert seen(gs.EdgePcf(4), lit, [[20.2, 20.2]])[0] == 1.0


@pytest.mark.parametrize("given", [{"radius": 1}, {"radius": 5}])
def test_settings_are_checked(given: dict[str, int]) -> None:
    with pytest.raises(gs.SettingsError, match="EdgePcf radius must be"):
        gs.EdgePcf(**given)
