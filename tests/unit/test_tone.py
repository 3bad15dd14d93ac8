"""Tone map and exposure: closed forms of the formula, and what a light meter reads of simple scenes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import glshadow as gs
from glshadow.arguments import metered
from glshadow.core.tone import START, displayed, neutral
from glshadow.derive.exposure import light_level
from glshadow.derive.look import WHITE
from glshadow.scene.mesh import AlphaMode
from glshadow.scene.sampled import SAMPLES, surface_samples
from glshadow.scenes import shapes


def ground(side: float) -> gs.Scene:
    half = 0.5 * side
    return gs.Scene([gs.Mesh(*shapes.rectangle((-half, 0, half), (side, 0, 0), (0, 0, -side)))])


def test_colors_up_to_the_start_stay_to_the_bit(rng: np.random.Generator) -> None:
    colors = rng.uniform(0.0, START, (500, 3))
    colors[0] = START
    np.testing.assert_array_equal(neutral(colors), colors)


def test_greys_follow_the_hyperbola() -> None:
    """With K_s = 0.8 and no saturation to lose, a grey p becomes 1 - (1 - K_s)^2 / (p + 1 - 2 K_s): 1 becomes 0.9."""
    greys = np.array([0.8, 1.0, 1.4, 4.6, 1e6])
    shown = neutral(np.repeat(greys[:, None], 3, axis=1))
    np.testing.assert_allclose(shown[:, 0], [0.8, 0.9, 0.95, 0.99, 1.0 - 0.04 / (1e6 - 0.6)], rtol=1e-15)
    np.testing.assert_allclose(shown, shown[:, :1].repeat(3, axis=1), rtol=1e-15)


def test_a_bright_color_loses_saturation_as_published() -> None:
    """Red 1.4: its peak becomes 0.95, and K_d = 0.15 mixes in 1 - 1 / (0.15 (1.4 - 0.95) + 1) of white."""
    grey = 1.0 - 1.0 / (0.15 * 0.45 + 1.0)
    np.testing.assert_allclose(neutral([1.4, 0.0, 0.7]), [0.95, 0.95 * grey, 0.475 + 0.475 * grey], rtol=1e-14)


def test_the_map_is_increasing_smooth_and_below_one() -> None:
    greys = np.linspace(0.0, 50.0, 200_001)
    shown = neutral(np.repeat(greys[:, None], 3, axis=1))[:, 0]
    steps = np.diff(shown)
    assert (steps > 0.0).all()
    assert shown.max() < 1.0
    # the slope is 1 at the start, from both sides: no second difference is more than that of the hyperbola, 2 / 0.2 h^2
    assert np.abs(np.diff(steps)).max() <= 10.0 * (greys[1] - greys[0]) ** 2 * 1.01


def test_background_is_neither_exposed_nor_tone_mapped() -> None:
    background = np.array([1.0, 0.9, 0.1])
    alone = np.array([*background, 0.0])
    np.testing.assert_array_equal(displayed(alone, background, 8.0, "neutral"), background)
    # half a pixel of light 0.25, four times brighter, over half a pixel of background
    half = np.array([*(0.5 * 0.25 + 0.5 * background), 0.5])
    expected = 0.5 * neutral([1.0] * 3) + 0.5 * background
    np.testing.assert_allclose(displayed(half, background, 4.0, "neutral"), expected, rtol=1e-12)
    np.testing.assert_allclose(displayed([0.125] * 3 + [0.5], None, 4.0, "neutral"), [0.9] * 3, rtol=1e-12)


def test_the_default_light_needs_no_exposure() -> None:
    scene = ground(2.0)
    assert metered(scene, scene.lights, "auto") == pytest.approx(WHITE, rel=1e-15)
    assert metered(scene, scene.lights, "scene") is None


def test_level_of_a_distant_light_is_its_intensity() -> None:
    light = gs.DirectionalLight(direction=(1, -2, 3), intensity=100_000.0, photometric=True)
    assert metered(ground(2.0), (light,), "scene") == pytest.approx(100_000.0, rel=1e-12)
    assert metered(ground(2.0), (light, replace(light, direction=(0, -1, 0))), "scene") == pytest.approx(2e5, rel=1e-12)


def test_level_below_a_point_light_over_a_wide_plane() -> None:
    """With u = h / distance, the light that falls on a plane is uniform in u, and facing the light a surface receives I u^2 / h^2. The mean
    of log u^2 over 0..1 is -2; from the border of a disc on, over u0..1, it is -2 - 2 u0 log(u0) / (1 - u0)."""
    radius, height, intensity = 30.0, 1.0, 800.0
    t = (np.arange(200_000) + 0.5) / 200_000  # equal areas of a disc
    points = np.stack([radius * np.sqrt(t), 0.0 * t, 0.0 * t], axis=1)
    normals = np.broadcast_to([0.0, 1.0, 0.0], points.shape)
    light = gs.PointLight(position=(0, height, 0), intensity=intensity, falloff=2.0)
    u0 = height / np.hypot(height, radius)
    expected = intensity * np.exp(-2.0 - 2.0 * u0 * np.log(u0) / (1.0 - u0))
    assert light_level((light,), points, normals) == pytest.approx(expected, rel=1e-3)
    assert light_level((light,), points, -normals) == pytest.approx(
        expected, rel=1e-3
    )  # back faces, if there is nothing else


def test_level_is_proportional_and_ignores_order(rng: np.random.Generator) -> None:
    scene = ground(6.0)
    lights = tuple(
        gs.PointLight(position=(x, 2.0, z), intensity=10.0 * i, falloff=2.0, color=(1.0, 0.5, 0.2))
        for x, z, i in rng.uniform(0.1, 1.0, (9, 3))
    )
    level = metered(scene, lights, "auto")
    assert level == metered(scene, lights[::-1], "auto")
    strong = tuple(replace(each, intensity=each.intensity * 1e4) for each in lights)
    assert metered(scene, strong, "auto") == pytest.approx(1e4 * level, rel=1e-12)


def test_samples_are_spread_by_area() -> None:
    """Of a small dense and a large coarse square, by their areas; all on the surfaces."""
    dense = gs.Mesh(*shapes.rectangle((10, 0, 1), (1, 0, 0), (0, 0, -1)))
    many = gs.Mesh(dense.positions, np.tile(dense.triangles, (50, 1)))
    scene = gs.Scene([many, *ground(20.0).nodes])
    points, normals = surface_samples(scene)
    assert points.shape == normals.shape == (SAMPLES, 3)
    np.testing.assert_allclose(normals, np.broadcast_to([0.0, 1.0, 0.0], normals.shape), atol=1e-12)
    small = points[:, 0] > 10.0
    assert small.mean() == pytest.approx(50.0 / 450.0, abs=1e-3)
    # a low-discrepancy sequence: each quarter of the large square has its share
    quarters = np.histogram2d(points[~small, 0], points[~small, 2], bins=2)[0]
    np.testing.assert_allclose(quarters / quarters.sum(), 0.25, atol=0.01)


def test_an_added_ground_and_what_blends_or_emits_do_not_count() -> None:
    scene = ground(2.0)
    light = gs.PointLight(position=(0.5, 1.0, 0.5), intensity=100.0, falloff=2.0)
    level = metered(scene, (light,), "auto")
    near = shapes.rectangle((0, 0.9, 1), (1, 0, 0), (0, 0, -1))
    glass = gs.Mesh(*near, material=gs.Material(color=(1.0, 1.0, 1.0, 0.5), alpha_mode=AlphaMode.BLEND))
    bright = gs.Mesh(*near, material=gs.Material(emission=(1.0, 1.0, 1.0)))
    for other in (
        scene.with_ground(),
        scene.with_ground(catches=True),
        *(gs.Scene([*scene.nodes, each]) for each in (glass, bright)),
    ):
        assert metered(other, (light,), "auto") == level
    assert metered(gs.Scene([*scene.nodes, gs.Mesh(*near)]), (light,), "auto") > 2.0 * level
    assert metered(gs.Scene([bright]), (light,), "auto") > level  # if there is nothing else


def test_a_scene_of_points_is_metered_too() -> None:
    scene = gs.Scene([gs.Points(np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]), 0.1)])
    light = gs.PointLight(position=(0.5, 10, 0), intensity=100.0, falloff=2.0)
    assert metered(scene, (light,), "auto") == pytest.approx(1.0, rel=0.05)


@pytest.mark.parametrize("exposure", ["bright", True, float("nan"), 65, [1.0]])
def test_invalid_exposures_are_refused(exposure: object) -> None:
    with pytest.raises(
        gs.SettingsError, match=r'exposure must be "scene", "auto", None or a number of stops in \[-64, 64\], got'
    ):
        gs.render(ground(2.0), exposure=exposure)  # type: ignore[arg-type]


def test_invalid_tones_are_refused() -> None:
    with pytest.raises(gs.SettingsError, match="tone must be one of 'neutral', 'none', got 'aces'"):
        gs.render(ground(2.0), tone="aces")
