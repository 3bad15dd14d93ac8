"""Settings chosen by a budget: the cheapest that suffices, found without tracing, cached, and never overriding a light's own settings."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

import glshadow as gs
from glshadow import budget as module
from glshadow.budget import Budget, Found, choose, open_to_choice
from glshadow.lights import Light

SIZE = (320, 180)


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> None:
    """Times by a rule: a map costs by its texels and its filter's reach, Exact() 40 ms."""

    def times(draw: module.Draw, lights: Sequence[Light], found: Sequence[Found]) -> list[Found]:
        def ms(each: Found) -> float:
            if each.shadow.resolution is None or each.shadow.filter is None:
                return 40.0
            return each.shadow.resolution / 256.0 + each.shadow.filter.reach_texels

        return [replace(each, ms=ms(each)) for each in found]

    monkeypatch.setattr(module, "_time", times)


@pytest.mark.usefixtures("clock")
@pytest.mark.parametrize("wrong", [0.02, 0.004, 0.001])
def test_cheapest_sufficient_setting_is_chosen(wrong: float) -> None:
    scene = gs.scenes.courtyard()
    with gs.Renderer() as renderer:
        frame = renderer.render(scene, size=SIZE, max_wrong=wrong, outputs=("visibility", "triangle"), samples=1)
        ((found, missed),) = renderer._choices.of(scene)
    truth = gs.trace(scene, size=SIZE, samples=1)
    measured = gs.measure(frame, truth).wrong
    assert missed == ""
    assert measured <= 1.2 * wrong
    assert found.wrong == pytest.approx(measured, abs=2e-4), "determined by comparison with Exact(), not with rays"
    assert frame.used[0].filter == found.shadow.filter
    assert "the cheapest within" in frame.used[0].why
    assert str(found.shadow.resolution) in frame.used[0].why or found.shadow.filter == gs.Exact()


@pytest.mark.usefixtures("clock")
def test_budget_below_every_map_chooses_exact() -> None:
    with gs.Renderer() as renderer:
        frame = renderer.render(gs.scenes.courtyard(), size=SIZE, max_wrong=1e-6, samples=1)
    assert frame.used[0].filter == gs.Exact()


@pytest.mark.usefixtures("clock")
def test_most_accurate_setting_in_the_time_is_chosen() -> None:
    scene = gs.scenes.courtyard()
    with gs.Renderer() as renderer:
        slow = renderer.render(scene, size=SIZE, max_ms=100.0, samples=1)
        fast = renderer.render(scene, size=SIZE, max_ms=9.0, samples=1)
        none = renderer.render(scene, size=SIZE, max_ms=0.5, samples=1)
    assert slow.used[0].filter == gs.Exact()
    assert fast.used[0].filter != gs.Exact()
    assert fast.used[0].views[0].resolution == 2048
    assert none.used[0].views[0].resolution == 512
    assert any("max_ms=0.5 is not met" in said for said in none.used[0].fallbacks)


@pytest.mark.usefixtures("clock")
def test_choice_is_cached(monkeypatch: pytest.MonkeyPatch) -> None:
    made = []
    monkeypatch.setattr("glshadow.budget.choose", lambda *given: made.append(1) or choose(*given))
    scene = gs.scenes.box().scene
    with gs.Renderer() as renderer:
        first = renderer.render(scene, size=SIZE, max_wrong=0.01, samples=1)
        for k in range(3):
            moved = gs.DirectionalLight(direction=(-0.5, -0.8, 0.1 * k))
            again = renderer.render(scene, None, [moved], size=SIZE, max_wrong=0.01, samples=1)
            assert again.used[0].filter == first.used[0].filter
        assert sum(made) == 1
        frames = list(
            renderer.sequence(scene, 2 * [scene.camera or gs.PerspectiveCamera()], size=SIZE, max_wrong=0.01, samples=1)
        )
        assert len(frames) == 2
        assert sum(made) == 1
        renderer.render(scene, size=SIZE, max_wrong=0.02, samples=1)
        assert sum(made) == 2


@pytest.mark.usefixtures("clock")
def test_settings_of_a_light_are_kept() -> None:
    lights = (
        gs.DirectionalLight(shadow=gs.Shadow(filter=gs.Pcf(2))),
        gs.DirectionalLight(direction=(0.3, -1.0, 0.2), shadow=gs.Shadow(strength=0.4)),
        gs.PointLight(position=(0.0, 3.0, 0.0), shadow=None),
    )
    assert [open_to_choice(each) for each in lights] == [False, True, False]
    with gs.Renderer() as renderer:
        frame = renderer.render(gs.scenes.box().scene, None, lights, SIZE, max_wrong=0.01, samples=1)
    assert frame.used[0].filter == gs.Pcf(2)
    assert frame.used[0].why == "requested"
    assert frame.lights[1].shadow is not None
    assert frame.lights[1].shadow.strength == 0.4
    assert frame.used[2].filter is None


def test_scene_without_lights_needs_no_choice(monkeypatch: pytest.MonkeyPatch) -> None:
    with gs.Renderer() as renderer:
        frame = renderer.render(gs.scenes.box().scene, None, [], SIZE, max_wrong=0.01, samples=1)
    assert not np.isnan(frame.image).any()


@pytest.mark.parametrize("given", [{"max_wrong": 1.0}, {"max_wrong": -0.1}, {"max_ms": 0.0}, {"max_wrong": "few"}])
def test_invalid_budgets_are_refused(given: dict[str, float]) -> None:
    with gs.Renderer() as renderer, pytest.raises(gs.SettingsError, match=f"Budget {next(iter(given))} must be"):
        renderer.render(gs.scenes.box().scene, size=SIZE, **given)  # type: ignore[arg-type]
    assert not Budget().given


def test_choice_for_point_lights_is_not_reused_for_area_lights(monkeypatch: pytest.MonkeyPatch) -> None:
    chosen: list[Sequence[Light]] = []

    def choose(_: module.Draw, lights: Sequence[Light], __: Budget) -> tuple[Found, str]:
        chosen.append(lights)
        return Found(gs.Shadow(filter=gs.Hard()), 0.0), ""

    monkeypatch.setattr(module, "choose", choose)
    scene = gs.scenes.box().scene
    point, disc = [gs.DirectionalLight()], [gs.DirectionalLight(angle=5.0)]
    with gs.Renderer() as renderer:
        for lights in (point, disc, point, disc):
            renderer.render(scene, None, lights, (64, 48), max_wrong=0.01, samples=1)
    assert [list(each) for each in chosen] == [point, disc]
