"""The sky: what it refuses, and what a filter of a single map does with it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import glshadow as gs
from glshadow.ui.showing import Showing

SIZE = (96, 54)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"near": 1.0}, r"SkyLight has no near=1\.0; it takes color, intensity, shadow, photometric, direction"),
        ({"far": 9.0}, "SkyLight has no far"),
        ({"angle": 3.0}, "SkyLight has no angle"),
        ({"cookie": None}, "SkyLight has no cookie"),
        ({"position": (0, 1, 0)}, "SkyLight has no position"),
        ({"direction": (1, 0, 0)}, r"direction must be a direction from the zenith down, .* got \(1, 0, 0\)"),
        ({"direction": (0, 1, 0)}, "from the zenith down"),
        ({"direction": (0, 0, 0)}, "zero vector"),
        ({"intensity": -1.0}, "intensity must be"),
    ],
)
def test_missing_settings_are_refused(given: dict[str, object], words: str) -> None:
    with pytest.raises(gs.SettingsError, match=words):
        gs.SkyLight(**given)  # type: ignore[arg-type]


@pytest.mark.parametrize("filter", [gs.Hard(), gs.Pcf(1), gs.Vsm(), gs.Pcss()], ids=str)
def test_single_map_filter_is_applied_to_many_maps(renderer: gs.Renderer, filter: gs.Filter) -> None:
    scene = gs.scenes.courtyard()
    given, meant = (
        renderer.render(scene, None, [gs.SkyLight(shadow=gs.Shadow(filter=each, resolution=256))], SIZE, samples=1)
        for each in (filter, gs.LightSamples(64, of=filter))
    )
    np.testing.assert_array_equal(given.visibility, meant.visibility)
    assert given.used[0].filter == gs.LightSamples(64, of=filter)
    assert "SkyLight has no single map" in given.used[0].why
    assert "SkyLight" not in meant.used[0].why


def test_mapped_sky_shadow_matches_the_exact_one(renderer: gs.Renderer) -> None:
    """Not the hard shadow of a directional light in the zenith."""
    scene, sky = gs.scenes.courtyard(), gs.SkyLight(shadow=gs.Shadow(filter=gs.Exact()))
    exact = renderer.render(scene, None, [sky], SIZE, samples=1)
    mapped = renderer.render(scene, None, [replace(sky, shadow=gs.Shadow(filter=gs.Pcf(1)))], SIZE, samples=1)
    difference = mapped.visibility[0] - exact.visibility[0]
    assert abs(float(np.nanmean(difference))) < 0.005  # .08 off with that of a directional light
    assert float(np.nanmean(np.abs(difference))) < 0.02


def test_given_number_of_points_is_kept(renderer: gs.Renderer) -> None:
    settings = gs.Shadow(filter=gs.LightSamples(16), resolution=256)
    frame = renderer.render(gs.scenes.courtyard(), None, [gs.SkyLight(shadow=settings)], SIZE, samples=1)
    assert frame.used[0].filter == gs.LightSamples(16)


def test_sky_in_a_pack_is_refused() -> None:
    with pytest.raises(gs.SettingsError, match="directional or spot lights"):
        gs.PackedShadow([gs.SkyLight()])


def test_window_controls_do_not_move_the_sky() -> None:
    shown = Showing.of(gs.scenes.courtyard(), None, [gs.SkyLight()])
    assert shown.lit_from(20.0, -30.0).lights == shown.lights
    assert shown.sized(3.0).lights == shown.lights
