"""DirectionMaps: what its maps cover, which of them a pixel samples, its slack in closed form, and what it refuses."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import glshadow as gs
from glshadow.core.spaces import ClipSpace, transform
from glshadow.derive.direction_maps import MANY_SETS, MOST_SLACK, REACH, SETS, direction_views, rows_of, sets_of, slack
from glshadow.derive.resolved import resolve_shadow
from glshadow.shadows.bias import FACET_SLOPE

CLIP = ClipSpace(True, False)
BOX = np.array([[x, y, z] for x in (3.0, 5.0) for y in (-1.0, 4.0) for z in (-2.0, 2.5)])


@pytest.mark.parametrize(("corners", "count"), [(BOX, 64), (np.repeat(BOX, 200, axis=0), 20), (BOX[:1], 4)])
@pytest.mark.parametrize("resolution", [8, 128])
def test_views_cover_all_casters_inside_an_empty_border(corners: np.ndarray, count: int, resolution: int) -> None:
    found = direction_views(gs.SkyLight().hard_lights(count), corners, CLIP, resolution)
    for view in found.views:
        left, _, bottom, _ = view.window
        place = (transform(view.view_from_world, corners)[:, :2] - (left, bottom)) / view.texel
        assert place.min() > 1.0 - 1e-9
        assert place.max() < resolution - 1.0 + 1e-9
        depth = -transform(view.view_from_world, corners)[:, 2]
        assert np.abs(depth).max() < found.radius
        assert all(0 <= c <= size - resolution for c, size in zip(view.tile, found.size, strict=True))
    assert len({view.tile for view in found.views}) == count


def test_views_fit_a_box_closely() -> None:
    """Seen from the zenith, a box turned by 15 degrees has a window of its own sides."""
    turn = np.radians(15.0)
    axes = np.array([[np.cos(turn), 0.0, np.sin(turn)], [0.0, 1.0, 0.0], [-np.sin(turn), 0.0, np.cos(turn)]])
    sun = gs.DirectionalLight(direction=(0.0, -1.0, 0.0))
    view = direction_views([sun], BOX @ axes.T, CLIP, 128).views[0]
    left, right, bottom, top = view.window
    np.testing.assert_allclose(sorted((right - left, top - bottom)), np.array([2.0, 4.5]) * 128 / 126, rtol=1e-9)


@pytest.mark.parametrize(("count", "sets"), [(64, SETS), (256, SETS), (1024, MANY_SETS)])
def test_sets_divide_a_sky_evenly(count: int, sets: int) -> None:
    index, factor = sets_of(gs.SkyLight().hard_lights(count), per_channel=False, fine=True)
    assert index.shape == (sets, count // sets)
    assert sorted(index.ravel()) == list(range(count))
    assert (factor == 1.0).all()


def test_small_images_sample_all_directions_in_each_pixel() -> None:
    index, factor = sets_of(gs.SkyLight().hard_lights(256), per_channel=False, fine=False)
    np.testing.assert_array_equal(index, [np.arange(256)])
    assert (factor == 1.0).all()


def test_small_images_sample_a_part_of_more_directions_than_usual() -> None:
    index, factor = sets_of(gs.SkyLight().hard_lights(1024), per_channel=False, fine=False, most=256)
    np.testing.assert_array_equal(index, [np.arange(0, 1024, 4)])
    assert (factor == 4.0).all()


@pytest.mark.parametrize("count", [3, 16, 66])
def test_few_or_odd_directions_are_all_sampled_by_each_pixel(count: int) -> None:
    index, factor = sets_of(gs.SkyLight().hard_lights(count), per_channel=False, fine=True)
    np.testing.assert_array_equal(index, [np.arange(count)])
    assert (factor == 1.0).all()


def test_bright_direction_is_in_every_set_and_counts_once() -> None:
    image = np.full((64, 128, 3), 0.2)
    image[20, 40] = 3000.0
    lights = gs.EnvironmentLight(image).hard_lights(128)
    index, factor = sets_of(lights, per_channel=True, fine=True)
    summed = np.zeros(len(lights))
    np.add.at(summed, index, factor)
    np.testing.assert_allclose(summed, 1.0, rtol=1e-12)
    brightest = int(np.argmax([light.color[0] for light in lights]))
    assert (index == brightest).any(axis=1).all()
    rows = rows_of(direction_views(lights, BOX, CLIP, 64), lights, np.eye(3), per_channel=True, fine=True)
    np.testing.assert_allclose(rows[:, :, 3, :3].sum(axis=(0, 1)), np.sum([x.color for x in lights], axis=0), rtol=1e-5)


def test_slack_is_the_rise_of_a_facet_15_degrees_steeper() -> None:
    tilt = np.radians(np.array([0.0, 20.0, 45.0, 55.0]))
    rise = np.tan(tilt + np.radians(15.0)) - np.tan(tilt)
    np.testing.assert_allclose(slack(np.cos(tilt), np.array(0.3)), 0.3 * REACH * rise, rtol=1e-12)
    np.testing.assert_allclose(slack(np.array(1.0), np.array(1.0)), REACH * FACET_SLOPE, rtol=1e-12)
    np.testing.assert_allclose(slack(np.cos(np.radians([75.0, 89.9])), np.array(2.0)), 2.0 * MOST_SLACK)


@pytest.mark.parametrize(
    ("triangles", "count"),
    [(0, 1024), (1024, 1024), (1025, 256), (500_000, 256), (608_754, 220), (2_000_000, 64), (10_000_000, 32)],
)
def test_small_scenes_get_more_and_large_ones_fewer_directions(triangles: int, count: int) -> None:
    assert gs.DirectionMaps().of_scene(triangles) == gs.DirectionMaps(count)
    assert gs.DirectionMaps().of_scene(triangles, per_channel=True) == gs.DirectionMaps(min(count, 256))
    assert gs.DirectionMaps(100).of_scene(triangles) == gs.DirectionMaps(100)


@pytest.mark.parametrize(
    ("shadow", "filter", "resolution"),
    [
        (gs.Shadow(), gs.DirectionMaps(), 128),
        (gs.Shadow(resolution=64), gs.DirectionMaps(), 64),
        (gs.Shadow(filter=gs.DirectionMaps(64), resolution=32), gs.DirectionMaps(64), 32),
        (gs.Shadow(fit=gs.SceneFit()), gs.LightSamples(), 2048),
        (gs.Shadow(filter=gs.Exact(light_samples=16)), gs.Exact(light_samples=16), 2048),
        (gs.Shadow(filter=gs.Pcf(2)), gs.LightSamples(of=gs.Pcf(2)), 2048),
    ],
)
@pytest.mark.parametrize("light", [gs.SkyLight(), gs.EnvironmentLight(np.ones((2, 4, 3)))], ids=["sky", "environment"])
def test_filter_of_a_sky_follows_from_its_settings(
    light: gs.SkyLight, shadow: gs.Shadow, filter: gs.Filter, resolution: int
) -> None:
    resolved = resolve_shadow(replace(light, shadow=shadow))
    assert resolved is not None
    assert (resolved.filter, resolved.resolution) == (filter, resolution)


@pytest.mark.parametrize(
    "light",
    [gs.DirectionalLight(), gs.PointLight(position=(0.0, 3.0, 0.0), radius=0.1)],
)
def test_other_lights_refuse_it(light: gs.Light) -> None:
    with pytest.raises(gs.SettingsError, match=f"for another {type(light).__name__} use Exact"):
        resolve_shadow(replace(light, shadow=gs.Shadow(filter=gs.DirectionMaps())))


@pytest.mark.parametrize(
    "given", [{"bias": gs.NoBias()}, {"target": gs.Target.R32F}, {"fit": gs.SceneFit()}, {"clip": CLIP}], ids=str
)
def test_settings_that_it_derives_are_refused(given: dict[str, object]) -> None:
    with pytest.raises(gs.SettingsError, match=rf"DirectionMaps\(count=None\) derives {next(iter(given))}"):
        gs.Shadow(filter=gs.DirectionMaps(), **given)  # type: ignore[arg-type]
