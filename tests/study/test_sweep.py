"""A study on a small image: what it measures, in which order, and what an interruption leaves."""

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import glshadow as gs
from glshadow.study import Grid, Result, Study, run_study
from glshadow.study.remembered import RememberedTruth
from glshadow.study.run import _moved

from .conftest import GRID, KINDS, REPEATS, SIZE, STEPS

PART = Grid(resolutions=STEPS[2:], filters=KINDS)
"""Settings of an interrupted study: half of the folder's."""


def _study(scene: gs.Scene, resume: Path | None = None, progress: Callable[..., None] | None = None) -> Study:
    return run_study(scene, size=SIZE, grid=PART, repeats=REPEATS, resume=resume, progress=progress, backend="egl")


def test_results_are_in_the_order_of_the_grid(study: Study) -> None:
    assert [result.shadow for result in study.results] == list(GRID.settings())
    names = [f"{step} {kind}" for step in STEPS for kind in ("hard", "pcf:1")]
    assert [result.name for result in study.results] == [*names, "exact"]


def test_error_equals_that_of_measure(study: Study, scene: gs.Scene) -> None:
    result = study.results[5]
    assert result.name == "32 pcf:1"
    light = replace(scene.lights[0], shadow=result.shadow)
    with gs.Renderer("egl") as renderer:
        frame = renderer.render(scene, lights=[light], size=SIZE, outputs=("visibility", "triangle"), samples=1)
    assert result.score == gs.measure(frame, gs.trace(scene, lights=[light], size=SIZE, samples=1)).lights[0]
    assert study.results[4].score.wrong > study.results[6].score.wrong > 0.0  # twice the resolution


def test_sampled_error_kinds_are_close_to_all(scene: gs.Scene, monkeypatch: pytest.MonkeyPatch) -> None:
    light = replace(scene.lights[0], shadow=gs.Shadow(resolution=256, bias=gs.NoBias()))
    with gs.Renderer("egl") as renderer:
        frame = renderer.render(scene, lights=[light], size=(64, 36), samples=1)
    truth = gs.trace(scene, lights=[light], size=(64, 36), samples=1)
    exact = gs.measure(frame, truth)
    monkeypatch.setattr("glshadow.study.remembered.SAMPLE", 200)
    careful = RememberedTruth.of(truth)
    estimate = gs.measure(frame, careful)
    assert careful.sampled()
    assert not careful.sampled()  # since the last call
    assert (estimate.wrong, estimate.mean) == pytest.approx((exact.wrong, exact.mean), rel=1e-12)
    assert exact.acne > 0.1
    # a sample of 200 estimates a share to 0.5 / sqrt(200) = 3.5 % of the wrong pixels; three times that
    assert estimate.acne == pytest.approx(exact.acne, abs=0.105 * exact.wrong)
    assert estimate.edge == pytest.approx(exact.edge, abs=0.105 * exact.wrong)
    monkeypatch.setattr("glshadow.study.remembered.SAMPLE", 10**9)
    assert gs.measure(frame, careful) == gs.measure(frame, careful) == exact  # earlier results are cached
    assert not careful.sampled()


def test_estimate_copies_the_kinds_of_neighbours(scene: gs.Scene, monkeypatch: pytest.MonkeyPatch) -> None:
    light = replace(scene.lights[0], shadow=gs.Shadow(resolution=32, filter=gs.Hard()))
    with gs.Renderer("egl") as renderer:
        frame = renderer.render(scene, lights=[light], size=SIZE, samples=1)
    truth = gs.trace(scene, lights=[light], size=SIZE, samples=1)
    exact = gs.measure(frame, truth)
    assert exact.edge == exact.wrong > 0.0  # a coarse map, but no artefact
    monkeypatch.setattr("glshadow.study.remembered.SAMPLE", 10)
    assert gs.measure(frame, RememberedTruth.of(truth)).edge == exact.edge


def test_times_are_positive_and_one_per_round(study: Study) -> None:
    for result in study.results:
        assert len(result.times_ms) == len(result.floors_ms) == REPEATS
        assert min(result.times_ms + result.floors_ms) > 0.0
        low, high = result.spread_ms
        assert low <= result.ms <= high
        assert result.cost == np.median(np.array(result.times_ms) / np.array(result.floors_ms))


def test_front_is_not_dominated_and_has_images(study: Study) -> None:
    front = study.front()
    assert front
    assert list(front) == sorted(front, key=lambda result: result.cost)
    assert [r.score.wrong for r in front] == sorted((r.score.wrong for r in front), reverse=True)
    for result in front:
        assert study.panels[result.key].truth.shape == (SIZE[1], SIZE[0], 3)
        assert any(region.wrong for region in study.panels[result.key].regions) == (result.score.wrong > 0.0)


def test_interrupted_study_resumes(study: Study, scene: gs.Scene, tmp_path: Path) -> None:
    journal = tmp_path / "study.jsonl"

    def interrupt(done: int, total: int, text: str) -> None:
        assert total == 4
        if done == 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        _study(scene, journal, interrupt)
    before = journal.read_bytes()
    assert sum("error" in json.loads(line) for line in before.splitlines()) == 2
    journal.write_bytes(before + b'{"key": "cut off in the mid')  # as a power cut leaves it

    seen: list[str] = []
    resumed = _study(scene, journal, lambda done, total, text: seen.append(f"{done} {text}"))
    after = journal.read_bytes()
    assert after.startswith(before)
    assert b"cut off" not in after
    assert not any("timing 32" in text or "timing 64" in text for text in seen)  # they had all been timed
    assert not any(" 32 " in text for text in seen)  # and these two scored
    scores = {result.shadow: result.score for result in study.results}
    assert {result.shadow: result.score for result in resumed.results} == {
        shadow: scores[shadow] for shadow in PART.settings()
    }

    assert _study(scene, journal).results == resumed.results
    assert journal.read_bytes() == after  # nothing left to measure


def test_results_of_another_scene_are_not_reused(scene: gs.Scene, tmp_path: Path) -> None:
    journal = tmp_path / "study.jsonl"
    grid = [gs.Shadow(resolution=128)]
    first = run_study(scene, size=SIZE, grid=grid, repeats=1, resume=journal, backend="egl")
    lines = len(journal.read_text().splitlines())
    matrix = np.eye(4)
    matrix[0, 3] = 0.25
    moved = run_study(scene.moved({"box": matrix}), size=SIZE, grid=grid, repeats=1, resume=journal, backend="egl")
    assert len(journal.read_text().splitlines()) == 2 * lines
    assert first.results[0].key != moved.results[0].key


def test_lights_are_studied_separately(scene: gs.Scene) -> None:
    point_light = gs.PointLight(position=(2.0, 4.0, 1.0))
    lights = (scene.lights[0], gs.DirectionalLight(shadow=None), point_light)
    both = run_study(scene, lights=lights, size=SIZE, grid=[gs.Shadow(resolution=128)], repeats=1, backend="egl")
    assert both.lights == (scene.lights[0], point_light)
    assert [result.light for result in both.results] == [0, 1]
    assert len(both.front(0)) == len(both.front(1)) == 1


@pytest.mark.parametrize("direction", [(0.0, -1.0, 0.0), (1.0, -2.0, 0.5)])
def test_every_round_moves_the_light(scene: gs.Scene, direction: tuple[float, float, float]) -> None:
    rounds = {_moved(gs.DirectionalLight(direction=direction), k, scene) for k in range(5)}
    assert len(rounds) == 5  # a light that does not move would reuse the last map
    assert gs.DirectionalLight(direction=direction) in rounds


def test_invalid_studies_are_refused(scene: gs.Scene, tmp_path: Path) -> None:
    with pytest.raises(gs.SettingsError, match="no light casts a shadow"):
        run_study(scene, lights=[gs.DirectionalLight(shadow=None)])
    with pytest.raises(gs.SettingsError, match="got nothing"):
        run_study(scene, grid=[])
    with pytest.raises(gs.SettingsError, match="the grid is empty"):
        Grid(filters=())
    with pytest.raises(gs.SettingsError, match="repeats must be"):
        run_study(scene, repeats=0)
    other = tmp_path / "shopping.txt"
    other.write_text("milk\n")
    with pytest.raises(gs.SettingsError, match=r"shopping\.txt, line 1, is not a journal record"):
        _study(scene, other)
    assert other.read_text() == "milk\n"


def test_result_round_trips_through_json(study: Study) -> None:
    for result in study.results:
        record = json.loads(json.dumps(result.as_dict()))
        assert Result.from_dict(record, result.light, result.shadow).score == result.score


def test_study_has_a_notebook_representation(study: Study) -> None:
    html = study._repr_html_()
    assert html.count("<tr>") == 1 + len(study.front())
    assert study.front()[0].name in html
