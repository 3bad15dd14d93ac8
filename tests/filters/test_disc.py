"""Disc: the spiral, its ramp at an edge, its reach, and its shader when rotated per pixel."""

from __future__ import annotations

import numpy as np
import pytest

import glshadow as gs
from glshadow.core.sample_patterns import disc
from glshadow.shadows.filters.disc import MAX_TAPS

from .images import along_x, seen, vertical_edge

EPS = np.finfo(np.float64).eps


@pytest.mark.parametrize("taps", [8, 16, 33, MAX_TAPS])
def test_spiral_fills_the_disc_evenly(taps: int) -> None:
    """Each tap represents the same area: the number of taps within any radius is right to one tap, the centroid to one tap's share."""
    places = disc(taps)
    radius = np.sort(np.hypot(*places.T))
    assert radius[-1] < 1.0
    inside = np.searchsorted(radius, np.linspace(0.0, 1.0, 50))
    np.testing.assert_allclose(inside, taps * np.linspace(0.0, 1.0, 50) ** 2, atol=1.0)
    assert np.hypot(*places.mean(axis=0)) < 1.0 / taps**0.5 / 2.0
    apart = np.hypot(*(places[:, None] - places[None]).T) + 9.0 * np.eye(taps)
    assert apart.min() > 1.0 / np.sqrt(taps), "two taps lie closer than a square packing's half"


@pytest.mark.parametrize("kind", [gs.Disc(), gs.Disc(0.5, 8), gs.Disc(4.0, 64)], ids=str)
def test_straight_edge_is_the_fraction_of_the_disc(kind: gs.Disc) -> None:
    """Fraction of the disc beyond the edge, smeared by a bilinear tap: (acos t - t sqrt(1 - t^2)) / pi; to the share of two taps."""
    x = np.linspace(10.0, 30.0, 801)
    found = seen(kind, vertical_edge(), along_x(x))
    step = np.linspace(-0.5, 0.5, 201)  # a bilinear tap is a box of one texel
    t = np.clip((20.0 - x[:, None] - step) / kind.radius_texels, -1.0, 1.0)
    expected = ((np.arccos(t) - t * np.sqrt(1.0 - t**2)) / np.pi).mean(axis=1)
    np.testing.assert_allclose(found, expected, atol=2.0 / kind.taps)
    far = np.abs(x - 20.0) >= kind.reach_texels
    np.testing.assert_allclose(found[far], x[far] > 20.0, atol=64 * EPS)


def test_reach_covers_every_texel_read() -> None:
    kind = gs.Disc(3.0, 64)
    for column in range(40):
        lit = np.zeros((40, 40))
        lit[:, column] = 1.0
        assert seen(kind, lit, [[20.3, 20.1]])[0] == 0.0 or abs(column + 0.5 - 20.3) < kind.reach_texels


@pytest.mark.parametrize(
    "given", [{"radius_texels": 0.4}, {"radius_texels": 17}, {"taps": 7}, {"taps": 65}, {"rotate": 1}]
)
def test_settings_are_checked(given: dict[str, float]) -> None:
    with pytest.raises(gs.SettingsError, match=f"Disc {next(iter(given))} must be"):
        gs.Disc(**given)  # type: ignore[arg-type]


def test_rotated_taps_keep_the_mean() -> None:
    """Only pixels at an edge change, and their mean does not: a rotated spiral covers the same disc."""
    scene = gs.scenes.courtyard()
    pictures = []
    with gs.Renderer() as renderer:
        for rotate in (False, True):
            shadow = gs.Shadow(filter=gs.Disc(4.0, 8, rotate))
            frame = renderer.render(scene, lights=[gs.DirectionalLight(shadow=shadow)], size=(640, 360), samples=1)
            pictures.append(frame.visibility[0])
    plain, turned = pictures
    surface = ~np.isnan(plain)
    assert (plain[surface] != turned[surface]).mean() < 0.1
    assert (plain[surface] != turned[surface]).sum() > 1000
    assert abs(plain[surface].mean() - turned[surface].mean()) < 1e-3
