"""Lights are extensible: two that glshadow does not have work everywhere after adding their names to LIGHTS."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

import glshadow as gs
from glshadow import lights
from glshadow.batch import job
from glshadow.cli import main, values
from glshadow.lights.light import Light
from glshadow.overlay import overlay, required_outputs
from glshadow.shader import source

from .custom_lights import SNIPPET, BeamLight, TubeLight

SIZE = (96, 72)
OUTPUTS = ("visibility", "triangle", "linear", "position", "normal")
STRANGERS: dict[str, Light] = {
    "tube": TubeLight(position=(0.3, 2.6, 0.9), along=(0.5, 0.1, 0.0)),
    "beam": BeamLight(position=(1.5, 3.0, 2.0), direction=(-1.5, -2.6, -2.0), width=0.6, height=0.3),
}
each_stranger = pytest.mark.parametrize("name", list(STRANGERS))


@pytest.fixture(autouse=True)
def added(monkeypatch: pytest.MonkeyPatch) -> None:
    """Add both lights to `LIGHTS` (also in modules that have imported it), and the snippet to its folder."""
    family = (*lights.LIGHTS, TubeLight, BeamLight)
    monkeypatch.setattr(lights, "LIGHTS", family)
    monkeypatch.setattr(job, "LIGHTS", family)
    read = source.read
    monkeypatch.setattr(source, "read", lambda name: SNIPPET if name == BeamLight.snippet else read(name))


@pytest.fixture
def renderer() -> Iterator[gs.Renderer]:
    with gs.Renderer() as renderer:
        yield renderer


@pytest.fixture(scope="module")
def scene() -> gs.Scene:
    return gs.scenes.box().scene


def test_beam_shadow_matches_rays(renderer: gs.Renderer, scene: gs.Scene) -> None:
    light = STRANGERS["beam"]
    frame = renderer.render(scene, None, [light], SIZE, outputs=OUTPUTS, samples=1)
    assert frame.used[0].filter == gs.Exact()
    truth = gs.trace(scene, None, [light], SIZE, surface=frame.triangle, samples=1)
    known = truth.triangle >= 0
    wrong = frame.visibility[0][known] != truth.visibility[0][known]
    assert wrong.sum() <= 2  # rays within float32's rounding of an edge, of a triangle or of the pyramid
    assert 0.05 < truth.reached[0][known].mean() < 0.9
    assert (frame.visibility[0][known & ~truth.reached[0]] == 0.0).mean() > 0.999


def test_tube_shadow_is_the_mean_over_its_points(renderer: gs.Renderer, scene: gs.Scene) -> None:
    light = replace(STRANGERS["tube"], shadow=gs.Shadow(filter=gs.Exact(light_samples=16)))
    frame = renderer.render(scene, None, [light], SIZE, outputs=OUTPUTS, samples=1)
    points = light.hard_lights(16)
    expected = np.mean(
        [renderer.render(scene, None, [point], SIZE, samples=1).visibility[0] for point in points], axis=0
    )
    known = frame.triangle >= 0
    np.testing.assert_allclose(frame.visibility[0][known], expected[known], atol=1e-6)  # sums of 16 float32 shares
    truth = gs.trace(scene, None, [light], SIZE, light_samples=256, surface=frame.triangle, samples=1)
    # 16 points are off by 1/32 at most where one straight edge cuts the tube, 256 random ones by less
    assert np.abs(frame.visibility[0] - truth.visibility[0])[known].mean() < 0.01
    soft = (truth.visibility[0] > 0.1) & (truth.visibility[0] < 0.9)
    assert soft.mean() > 0.02


@each_stranger
def test_added_light_with_a_map(renderer: gs.Renderer, scene: gs.Scene, name: str) -> None:
    light = STRANGERS[name]
    settings = gs.Shadow(filter=gs.LightSamples(16), resolution=512) if light.has_size else gs.Shadow(filter=gs.Pcf(1))
    exact = gs.Shadow(filter=gs.Exact(light_samples=16))
    mapped, traced = (
        renderer.render(
            scene,
            None,
            [replace(light, shadow=shadow)],
            SIZE,
            outputs=("visibility", "triangle", "shadow_maps"),
            samples=1,
        )
        for shadow in (settings, exact)
    )
    assert len(mapped.used[0].views) == light.most_views if not light.has_size else mapped.used[0].views
    known = mapped.triangle >= 0
    assert np.abs(mapped.visibility[0] - traced.visibility[0])[known].mean() < 0.02  # the soft edge of a map


@each_stranger
def test_irradiance_matches_its_twin(renderer: gs.Renderer, name: str) -> None:
    light = replace(STRANGERS[name], shadow=None, color=(1.0, 0.5, 0.25), intensity=2.0, range=20.0)
    mesh = gs.Mesh(np.array([(-3, 0, 3), (3, 0, 3), (0, 0, -3)], dtype=float), np.array([(0, 1, 2)]))
    camera = gs.PerspectiveCamera(position=(0, 6, 0.1), target=(0, 0, 0))
    scene = gs.Scene((gs.Node(mesh, np.eye(4), "floor"),), camera)
    frame = renderer.render(scene, None, [light], SIZE, outputs=OUTPUTS, ambient=0.0, samples=1)
    known = frame.triangle >= 0
    points = frame.position[known].astype(np.float64)
    given = light.irradiance(points, frame.normal[known].astype(np.float64))
    expected = np.array(mesh.material.color[:3]) * given[:, None] * 2.0 * np.array([1.0, 0.5, 0.25])
    assert (
        np.abs(frame.linear[known] - expected).max(axis=1) > 1e-4
    ).mean() < 2e-3  # pixels on the border of a pyramid
    assert expected.max() > 0.1


@each_stranger
def test_added_light_on_the_command_line(name: str) -> None:
    light = STRANGERS[name]
    place = ",".join(map(str, light.place[:3]))
    other = ",".join(map(str, getattr(light, light.by_place[1])))
    text = f"{name}:{place}:{other}:intensity=2:range=9:shadow=off"
    assert values.light(text) == replace(type(light)(position=light.place[:3], **{light.by_place[1]: getattr(light, light.by_place[1])}),
                                         intensity=2.0, range=9.0, shadow=None)  # fmt: skip
    with pytest.raises(gs.SettingsError, match=f"a {name} has no setting 'angle'"):
        values.light(f"{name}:{place}:{other}:angle=3")
    with pytest.raises(gs.SettingsError, match=f"moon.*{light.usage}"):
        values.light("moon:1,2,3")


def test_command_renders_and_reports_an_added_light(tmp_path: Path) -> None:
    arguments = ["render", "--size", "64x48", "--samples", "1", "-o", str(tmp_path / "beam.png"), "--json"]
    result = CliRunner().invoke(main, [*arguments, "--light", "beam:1.5,3,2:-1.5,-2.6,-2"])
    assert result.exit_code == 0, result.output
    assert json.loads(result.stdout)["lights"][0]["kind"] == "beam"


@each_stranger
def test_added_light_in_a_batch(name: str) -> None:
    light = STRANGERS[name]
    given = {"kind": name, "position": light.place[:3], light.by_place[1]: getattr(light, light.by_place[1])}
    made = job.parse_job(json.dumps({"scene": "courtyard", "output": "a.png", "lights": [given]}), Path())
    assert made.lights is not None
    assert type(made.lights[0]) is type(light)


@each_stranger
def test_overlay_draws_the_gizmo_of_an_added_light(renderer: gs.Renderer, scene: gs.Scene, name: str) -> None:
    light = STRANGERS[name]
    camera = gs.PerspectiveCamera(position=(0.0, 4.0, 9.0), target=(0.0, 1.5, 0.0))
    frame = renderer.render(scene, camera, [light], SIZE, outputs=required_outputs(("lights", "map")), samples=1)
    assert (overlay(frame, ("lights",)) != frame.image).any()
    overlay(frame, ("map",))


@each_stranger
def test_added_light_works_everywhere_else(renderer: gs.Renderer, scene: gs.Scene, name: str) -> None:
    """Budgets, errors, multisampling, the window's controls, many lights at once."""
    from glshadow.ui.showing import Showing

    light = STRANGERS[name]
    frame = renderer.render(scene, None, [light, gs.DirectionalLight()], SIZE, outputs=OUTPUTS, samples=4)
    assert np.isfinite(frame.visibility[:, frame.triangle >= 0]).all()
    truth = gs.trace(scene, None, [light], SIZE, samples=1)
    one = renderer.render(
        scene,
        None,
        [replace(light, shadow=gs.Shadow(filter=gs.Hard(), resolution=256))],
        SIZE,
        outputs=OUTPUTS,
        samples=1,
    )
    assert 0.0 < gs.measure(one, truth).lights[0].mean < 0.2
    shown = Showing.of(scene, None, [light]).lit_from(30.0, 40.0).sized(0.01)
    assert shown.aim == pytest.approx((30.0, 40.0))
    assert shown.light_size == (0.01 if light.sized_by else 0.0)
    assert len(renderer.render(scene, None, list(STRANGERS.values()), SIZE, max_wrong=0.01, samples=1).used) == 2
