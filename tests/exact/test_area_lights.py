"""Rectangular area lights and the sky: closed forms of their irradiance, and shadows against rays."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import glshadow as gs
from glshadow.core.sample_patterns import hemisphere, square
from glshadow.reference.points import count_points
from glshadow.scenes import shapes

SIZE = (120, 90)
OUTPUTS = ("visibility", "triangle", "linear", "position", "normal")
RECT = gs.RectLight(position=(2.5, 3.0, 1.5), direction=(-2.5, -2.5, -1.5), width=1.5, height=0.8, intensity=3.0)


def floor(half: float = 2.0) -> gs.Scene:
    mesh = gs.Mesh(*shapes.rectangle((-half, 0, half), (2 * half, 0, 0), (0, 0, -2 * half)))
    return gs.Scene((gs.Node(mesh, np.eye(4), "floor"),))


@pytest.mark.parametrize(("width", "height", "away"), [(1.0, 1.0, 1.0), (2.0, 0.5, 0.3), (0.1, 4.0, 2.0)])
def test_irradiance_below_the_centre_of_a_rect_light(width: float, height: float, away: float) -> None:
    """Howell, A Catalog of Radiation Heat Transfer Configuration Factors, B-3: four times that of a quarter seen from its corner."""
    light = gs.RectLight(position=(0.0, away, 0.0), width=width, height=height)
    x, y = 0.5 * width / away, 0.5 * height / away
    a, b = np.sqrt(1.0 + x * x), np.sqrt(1.0 + y * y)
    exact = 4.0 / (2.0 * np.pi) * (x / a * np.arctan(y / a) + y / b * np.arctan(x / b))
    factor, above = light.form_factor(np.zeros((1, 3)), np.array([[0.0, 1.0, 0.0]]))
    np.testing.assert_allclose(factor, exact, rtol=1e-12)
    assert above == 1.0


def test_form_factors_equal_the_mean_over_many_points(rng: np.random.Generator) -> None:
    """Also where the horizon cuts the rectangle, and behind it."""
    points = rng.uniform(-3.0, 3.0, (40, 3))
    normals = rng.normal(size=(40, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    factor, above = RECT.form_factor(points, normals)
    forward = np.asarray(RECT.direction)
    right = np.cross(forward, RECT.up)
    right /= np.linalg.norm(right)
    up = np.cross(right, forward)
    at = square(1 << 16)
    places = np.asarray(RECT.position) + 0.75 * at[:, :1] * right + 0.4 * at[:, 1:] * up
    for k in range(len(points)):
        way = places - points[k]
        away = np.linalg.norm(way, axis=1)
        cosine, leaving = way @ normals[k] / away, -(way @ forward) / away
        lit = (cosine > 0.0) & (leaving > 0.0)
        sum_ = (cosine * leaving / away**2)[lit].sum() / len(at) * RECT.width * RECT.height / np.pi
        assert abs(factor[k] - sum_) < 2e-4  # the mean over 65,536 points of a lattice
        assert abs(above[k] - lit.mean()) < 1e-3


def test_rendered_irradiance_equals_the_form_factor(renderer: gs.Renderer) -> None:
    scene = gs.scenes.box().scene
    light = replace(RECT, shadow=None)
    frame = renderer.render(scene, None, [light], SIZE, outputs=OUTPUTS, ambient=0.0, samples=1)
    known = frame.triangle >= 0
    factor, _ = light.form_factor(frame.position[known], frame.normal[known].astype(np.float64))
    colors = np.array([node.mesh.material.color[:3] for node in scene.nodes])
    first = np.cumsum([0] + [len(node.mesh.triangles) for node in scene.nodes])
    node = np.searchsorted(first, frame.triangle[known], side="right") - 1
    expected = colors[node] * (3.0 * factor)[:, None]
    # a float32 angle between two corners that are seen near each other: error 1e-7, divided by the angle
    np.testing.assert_allclose(frame.linear[known], expected, atol=2e-4)
    assert expected.max() > 0.05


def test_rect_light_shadow_matches_rays(renderer: gs.Renderer) -> None:
    scene = gs.scenes.box().scene
    frame = renderer.render(scene, None, [RECT], SIZE, outputs=OUTPUTS, samples=1)
    expected = count_points(gs.trace(scene, None, [RECT], SIZE, surface=frame.triangle, samples=1), RECT, 64)
    known = ~np.isnan(expected)
    factor, _ = RECT.form_factor(frame.position[known], frame.normal[known].astype(np.float64))
    gap = np.abs(frame.visibility[0] * 64.0 - expected)[known]
    # an edge passes a pixel closer than float32 resolves
    assert (gap[factor > 0.0] > 1.5).sum() <= 3
    assert (gap[factor > 0.0] > 0.5).sum() <= 6
    assert (frame.visibility[0][known][factor == 0.0] == 0.0).all(), "its back, and surfaces that it does not reach"
    truth = gs.trace(scene, None, [RECT], SIZE, surface=frame.triangle, light_samples=1024, samples=1)
    assert np.abs(frame.visibility[0] - truth.visibility[0])[known].mean() < 2.5e-3


def test_half_plane_under_a_rect_light(renderer: gs.Renderer) -> None:
    """The half plane's edge is parallel to a side of the light: visibility is a linear ramp."""
    height, width = 2.0, 0.6
    roof = gs.Mesh(*shapes.rectangle((-40, 1.0, 40), (40, 0, 0), (0, 0, -80)))  # over x < 0, halfway
    scene = gs.Scene((*floor().nodes, gs.Node(roof, np.eye(4), "roof")))
    camera = gs.OrthographicCamera((0.0, 0.5, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, -1.0), height=0.05)
    for count in (64, 1024):
        shadow = gs.Shadow(filter=gs.Exact(light_samples=count))
        light = gs.RectLight(position=(0.0, height, 0.0), width=width, height=0.3, shadow=shadow)
        frame = renderer.render(scene, camera, [light], (128, 16), outputs=("visibility", "position"), samples=1)
        x = (frame.position[..., 0]) / (0.5 * width)  # past the edge: half as wide, on the other side
        exact = np.clip(0.5 + 0.5 * x, 0.0, 1.0)
        gap = np.abs(frame.visibility[0] - exact)
        assert (np.abs(x) < 1.0).mean() > 0.2
        assert gap.max() <= 1.0 / count + 1e-5, "a column of the lattice for each point"


def test_sky_over_an_open_floor_and_beside_a_wall(renderer: gs.Renderer) -> None:
    """An infinite wall hides the sky on its side: half of the light arrives at its foot."""
    wall = gs.Mesh(*shapes.rectangle((0, 0, 500), (0, 500, 0), (0, 0, -1000)))
    scene = gs.Scene((*floor().nodes, gs.Node(wall, np.eye(4), "wall")))
    camera = gs.OrthographicCamera((0.0, 1.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, -1.0), height=2.0)
    sky = gs.SkyLight(intensity=0.5, shadow=gs.Shadow(filter=gs.Exact(light_samples=256)))
    frame = renderer.render(floor(), camera, [sky], (32, 16), outputs=("visibility", "linear"), ambient=0.0, samples=1)
    np.testing.assert_allclose(frame.visibility[0], 1.0, atol=1e-6)
    np.testing.assert_allclose(frame.linear, 0.5 * 0.8, rtol=0.3)  # of a nearly white material
    beside = renderer.render(scene, camera, [sky], (32, 16), outputs=("visibility", "position"), samples=1)
    # 256 directions: the share of a half plane is off by about 256^(-3/4)
    np.testing.assert_allclose(np.delete(beside.visibility[0], [15, 16], axis=1), 0.5, atol=0.02)


def test_tilted_surface_gets_its_share_of_the_sky(renderer: gs.Renderer) -> None:
    scene = gs.scenes.box().scene
    sky = gs.SkyLight(shadow=None)
    frame = renderer.render(scene, None, [sky], SIZE, outputs=OUTPUTS, ambient=0.0, samples=1)
    known = frame.triangle >= 0
    share = 0.5 + 0.5 * frame.normal[known][:, 1]
    ratio = frame.linear[known][:, 0] / share
    assert len(np.unique(np.round(ratio, 3))) <= 2, "a colour for each of two nodes"


def test_sky_shadow_matches_many_rays(renderer: gs.Renderer) -> None:
    scene = gs.scenes.courtyard()
    errors, truth = {}, None
    for count in (64, 256):
        sky = gs.SkyLight(shadow=gs.Shadow(filter=gs.Exact(light_samples=count)))
        frame = renderer.render(scene, None, [sky], SIZE, outputs=("visibility", "triangle"), samples=1)
        truth = truth or gs.trace(scene, None, [sky], SIZE, surface=frame.triangle, light_samples=576, samples=1)
        errors[count] = float(np.nanmean(np.abs(frame.visibility[0] - truth.visibility[0])))
    assert errors[256] < 0.6 * errors[64] < 0.6 * 0.025, errors


@pytest.mark.parametrize("samples", [4])
def test_area_lights_with_multisampling(renderer: gs.Renderer, samples: int) -> None:
    scene, lights = gs.scenes.box().scene, [RECT, gs.SkyLight(intensity=0.3)]
    frame = renderer.render(scene, None, lights, SIZE, outputs=("visibility",), samples=samples)
    truth = gs.trace(scene, None, lights, SIZE, samples=samples, light_samples=64)
    for number, most in enumerate((4e-3, 1.5e-2)):
        gap = np.abs(frame.visibility[number] - truth.visibility[number])
        assert np.nanmean(gap) < most


def test_sample_directions_and_points_are_evenly_distributed() -> None:
    for count in (16, 64, 256):
        sky, rect = hemisphere(count), square(count)
        np.testing.assert_allclose(np.linalg.norm(sky, axis=1), 1.0)
        np.testing.assert_allclose(sky.mean(axis=0), [0.0, 0.0, 0.5], atol=1.0 / count**0.75)
        np.testing.assert_allclose(rect.mean(axis=0), 0.0, atol=1.0 / count**0.75)
        assert (np.abs(rect) <= 1.0).all()


def test_bad_settings_are_refused() -> None:
    for wrong, said in (
        ({"radius": 1.0}, "RectLight has no radius"),
        ({"falloff": 2.0}, "RectLight has no falloff"),
        ({"up": (0.0, 2.0, 0.0)}, "up must not be parallel to direction"),
        ({"width": 0.0}, "width"),
    ):
        with pytest.raises(gs.SettingsError, match=said):
            gs.RectLight(position=(0.0, 1.0, 0.0), **wrong)  # type: ignore[arg-type]
    with pytest.raises(gs.SettingsError, match="SkyLight has no angle"):
        gs.SkyLight(angle=2.0)


@pytest.mark.parametrize("of", [gs.Pcf(1), gs.Hard(), gs.Disc(2, 16)])
def test_mapped_area_light_uses_one_map_per_sample_point(renderer: gs.Renderer, of: gs.Filter) -> None:
    """The mean over maps at the same points: with enough texels, the same shadow."""
    scene = gs.scenes.box().scene
    sun = gs.DirectionalLight(direction=(-0.55, -0.8, -0.25), angle=8.0)
    exact = renderer.render(scene, None, [sun], SIZE, outputs=OUTPUTS, samples=1)
    light = replace(sun, shadow=gs.Shadow(filter=gs.LightSamples(64, of=of)))
    frame = renderer.render(scene, None, [light], SIZE, outputs=OUTPUTS, samples=1)
    known = ~np.isnan(exact.visibility[0])
    gap = np.abs(frame.visibility[0] - exact.visibility[0])[known]
    assert gap.mean() < 0.01
    assert frame.used[0].fallbacks == ()
    assert frame.used[0].filter == gs.LightSamples(64, of=of)
    assert "64 points of the light, one after another" in frame.used[0].why


def test_mapped_area_light_next_to_other_lights(renderer: gs.Renderer) -> None:
    """Its maps are drawn one after another into an atlas of their own."""
    scene = gs.scenes.box().scene
    sun = gs.DirectionalLight(direction=(-0.55, -0.8, -0.25), angle=8.0)
    soft = replace(sun, shadow=gs.Shadow(filter=gs.LightSamples(16)))
    hard = gs.DirectionalLight(direction=(0.5, -0.8, 0.3), shadow=gs.Shadow(filter=gs.Pcf(1)))
    alone = [
        renderer.render(scene, None, [light], SIZE, outputs=OUTPUTS, samples=1).visibility[0] for light in (soft, hard)
    ]
    both = renderer.render(scene, None, [soft, hard], SIZE, outputs=OUTPUTS, samples=1).visibility
    np.testing.assert_array_equal(both, np.stack(alone))


def test_rect_light_has_no_effect_behind_its_plane() -> None:
    scene = gs.scenes.box().scene
    rect = replace(RECT, position=(0.0, 0.5, 2.0), direction=(0.0, 0.0, -1.0), up=(0.0, 1.0, 0.0))
    truth = gs.trace(scene, None, [rect], SIZE, samples=1)
    seen = truth.triangle >= 0
    before = truth.position[seen][:, 2] < 2.0
    assert before.any()
    assert not before.all()
    np.testing.assert_array_equal(truth.reached[0][seen], before)
