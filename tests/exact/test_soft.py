"""Lights that have a size: exact shares, as closed forms and rays give them, the same every time, and only where they are asked for."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

import glshadow as gs
from glshadow.core.area import hard_lights
from glshadow.scene import shapes

SIZE = (160, 120)
OUTPUTS = ("visibility", "triangle", "image")
LIGHTS: dict[str, gs.Light] = {
    "sun": gs.DirectionalLight(direction=(-0.55, -0.8, -0.25), angle=8.0),
    "spot": gs.SpotLight(position=(4.0, 6.0, 4.0), direction=(-4.0, -6.0, -4.0), outer_angle=40.0, radius=0.3),
    "point": gs.PointLight(position=(1.5, 3.0, 1.0), radius=0.2),
}


@pytest.fixture(scope="module")
def renderer() -> Iterator[gs.Renderer]:
    with gs.Renderer() as renderer:
        yield renderer


@pytest.fixture(scope="module")
def scene() -> gs.Scene:
    return gs.scenes.box().scene


@pytest.mark.parametrize("name", list(LIGHTS))
def test_it_is_the_mean_of_its_own_hard_frames(renderer: gs.Renderer, scene: gs.Scene, name: str) -> None:
    light = LIGHTS[name]
    soft = renderer.render(scene, None, [light], SIZE, outputs=OUTPUTS)
    points = hard_lights(light, 64)
    frames = [renderer.render(scene, None, [point], SIZE, outputs=("visibility",)).visibility[0] for point in points]
    mean = np.mean(frames, axis=0, dtype=np.float64)
    # where the middle of the light is below the receiver's horizon nothing is seen of it, by definition
    middle = gs.trace(scene, None, [replace(light, shadow=None)], SIZE, surface=soft.triangle).cosine[0] > 1e-4
    np.testing.assert_allclose(soft.visibility[0][middle], mean[middle], atol=1e-6)
    share = soft.visibility[0][~np.isnan(soft.visibility[0])] * 64
    np.testing.assert_allclose(share, np.round(share), atol=1e-4)
    assert ((share > 0.5) & (share < 63.5)).sum() > 100
    assert "64 points of the light" in soft.used[0].why
    assert soft.used[0].fallbacks == ()


@pytest.mark.parametrize("name", list(LIGHTS))
def test_more_points_are_nearer_to_many_rays(renderer: gs.Renderer, scene: gs.Scene, name: str) -> None:
    errors = {}
    for count in (16, 64, 256):
        light = replace(LIGHTS[name], shadow=gs.Shadow(filter=gs.Exact(light_samples=count)))
        frame = renderer.render(scene, None, [light], SIZE, outputs=OUTPUTS)
        truth = gs.trace(scene, None, [light], SIZE, light_samples=1024, surface=frame.triangle)
        asked = truth.reached[0] & (truth.cosine[0] > 0.05)
        errors[count] = float(np.abs(frame.visibility[0] - truth.visibility[0])[asked].mean())
    assert errors[64] < 0.7 * errors[16], errors
    assert errors[256] < 0.7 * errors[64], errors
    assert errors[256] < 3e-3, errors


def test_a_half_planes_edge_under_a_sun(renderer: gs.Renderer) -> None:
    """The share of a disc beyond a straight edge: (acos x - x sqrt(1 - x^2)) / pi."""
    height, angle = 2.0, 6.0
    floor = gs.Mesh(*shapes.rectangle((-2, 0, 2), (4, 0, 0), (0, 0, -4)))
    roof = gs.Mesh(*shapes.rectangle((-40, height, 40), (40, 0, 0), (0, 0, -80)))  # over x < 0
    scene = gs.Scene((gs.Node("floor", floor, np.eye(4)), gs.Node("roof", roof, np.eye(4))))
    camera = gs.OrthographicCamera((0.0, 1.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, -1.0), height=0.05)
    for count in (64, 1024):
        sun = gs.DirectionalLight(
            direction=(0, -1, 0), angle=angle, shadow=gs.Shadow(filter=gs.Exact(light_samples=count))
        )
        frame = renderer.render(scene, camera, [sun], (128, 16), outputs=("visibility", "position"))
        x = (frame.position[..., 0] + frame.origin[0]) / (height * np.tan(np.radians(angle / 2.0)))
        inside = np.clip(-x, -1.0, 1.0)
        exact = (np.arccos(inside) - inside * np.sqrt(1.0 - inside**2)) / np.pi
        gap = np.abs(frame.visibility[0] - exact)
        assert (np.abs(x) < 1.0).mean() > 0.2
        assert gap.max() < 1.3 * count**-0.75
        assert gap.mean() < 0.4 * count**-0.75


@pytest.mark.parametrize("samples", [4, 16])
def test_samples_of_pixels_and_points_of_lights_go_together(
    renderer: gs.Renderer, scene: gs.Scene, samples: int
) -> None:
    lights = [LIGHTS["sun"], gs.DirectionalLight(direction=(0.5, -1.0, 0.3))]
    frame = renderer.render(scene, None, lights, SIZE, outputs=OUTPUTS, samples=samples)
    truth = gs.trace(scene, None, lights, SIZE, samples=samples, light_samples=256)
    known = ~np.isnan(frame.visibility[0]) & ~np.isnan(truth.visibility[0]) & (truth.cosine[0] > 0.05)
    assert np.abs(frame.visibility[0] - truth.visibility[0])[known].mean() < 4e-3
    assert np.abs(frame.visibility[1] - truth.visibility[1])[known].mean() < 2e-3


def test_still_pictures_count_once(renderer: gs.Renderer, scene: gs.Scene, monkeypatch: pytest.MonkeyPatch) -> None:
    from glshadow.gl.sources import accumulated

    times, original = [], accumulated.count_seen

    def counted(*arguments: object) -> None:
        times.append(1)
        original(*arguments)  # type: ignore[arg-type]

    monkeypatch.setattr(accumulated, "count_seen", counted)
    with gs.Renderer() as fresh:
        for _ in range(3):
            fresh.render(scene, None, [LIGHTS["sun"]], SIZE)
        assert len(times) == 64
        fresh.render(scene, None, [replace(LIGHTS["sun"], angle=4.0)], SIZE)
        assert len(times) == 128


def test_maps_know_only_points(renderer: gs.Renderer, scene: gs.Scene) -> None:
    light = replace(LIGHTS["sun"], shadow=gs.Shadow(filter=gs.Pcf()))
    frame = renderer.render(scene, None, [light], SIZE)
    assert any("size is ignored" in said for said in frame.used[0].fallbacks)


def test_measure_wants_a_soft_truth(renderer: gs.Renderer, scene: gs.Scene) -> None:
    light = LIGHTS["sun"]
    frame = renderer.render(scene, None, [light], SIZE, outputs=OUTPUTS)
    with pytest.raises(gs.SettingsError, match=r"light 0 has a size.*light_samples=256"):
        gs.measure(frame, gs.trace(scene, None, [light], SIZE))
    error = gs.measure(frame, gs.trace(scene, None, [light], SIZE, light_samples=256))
    assert error.acne == error.leak == 0.0
    assert error.mean < 2e-3
    hard = renderer.render(scene, None, [replace(light, shadow=gs.Shadow(filter=gs.Hard()))], SIZE, outputs=OUTPUTS)
    gs.measure(hard, gs.trace(scene, None, [light], SIZE))  # a hard shadow may be compared with a hard truth
