"""The cheapest settings for a budget, against the whole grid measured exhaustively."""

from __future__ import annotations

from pathlib import Path

import pytest

import glshadow as gs
from glshadow.study import Plan, Study, run_plan
from glshadow.study.plan import RESOLUTIONS, RUNGS

from .conftest import KINDS, REPEATS, SIZE, STEPS


def plan(scene: gs.Scene, wrong: float, resume: Path | None = None) -> Plan:
    return run_plan(
        scene, wrong, size=SIZE, filters=KINDS, resolutions=STEPS, repeats=REPEATS, resume=resume, backend="egl"
    )


def test_every_filter_uses_its_lowest_sufficient_resolution(scene: gs.Scene, study: Study, journal: Path) -> None:
    errors = {(r.shadow.filter, r.shadow.resolution): r.error for r in study.results}
    budget = 1.01 * errors[gs.Hard(), 32]
    assert budget < errors[gs.Hard(), 16]  # otherwise nothing is tested
    found = plan(scene, budget, journal)
    expected = {
        kind: min(step for step in STEPS if errors[kind, step] <= budget)
        for kind in KINDS
        if any(errors[kind, step] <= budget for step in STEPS)
    }
    assert {choice.shadow.filter: choice.shadow.resolution for choice in found.choices} == expected
    assert found.met
    assert found.best == min(found.choices, key=lambda choice: choice.cost)
    assert [choice.cost for choice in found.choices] == sorted(choice.cost for choice in found.choices)
    for shadow, error in found.tried.items():
        assert error == errors[shadow.filter, shadow.resolution]
        assert shadow.resolution <= expected.get(shadow.filter, STEPS[-1])  # nothing above the sufficient resolution


def test_study_results_are_reused(scene: gs.Scene, study: Study, journal: Path) -> None:
    before = journal.read_bytes()
    found = plan(scene, study.results[2].error, journal)
    assert journal.read_bytes() == before
    assert found.best.results[0] in study.results


def test_unreachable_budget_is_reported(scene: gs.Scene, study: Study, journal: Path) -> None:
    found = plan(scene, 0.0, journal)
    assert not found.met
    assert len(found.tried) == len(STEPS) * len(KINDS)
    assert found.choices == (found.best,)
    assert found.best.error == min(found.tried.values()) > 0.0
    assert found.best.cost > 0.0
    assert "not met by" in str(found)


def test_the_worst_light_decides(scene: gs.Scene) -> None:
    lights = (scene.lights[0], gs.PointLight(position=(2.0, 4.0, 1.0)))
    both = run_plan(
        scene, 0.5, lights=lights, size=SIZE, filters=[gs.Hard()], resolutions=[64], repeats=1, backend="egl"
    )
    (choice,) = both.choices
    assert [result.light for result in choice.results] == [0, 1]
    assert choice.error == max(result.error for result in choice.results) == both.tried[choice.shadow]


def test_invalid_plans_are_refused(scene: gs.Scene) -> None:
    for wrong in (-0.1, 1.0, float("nan")):
        with pytest.raises(
            gs.SettingsError, match=r"wrong must be a finite number in \[0, 1\) \(a share of the pixels\)"
        ):
            run_plan(scene, wrong)
    with pytest.raises(gs.SettingsError, match="nothing to try"):
        run_plan(scene, 0.1, filters=())
    below = gs.DirectionalLight(direction=(0.0, 1.0, 0.0))
    with pytest.raises(gs.SettingsError, match="no counted pixel"):
        run_plan(scene, 0.1, lights=[below], size=SIZE, filters=[gs.Hard()], resolutions=[64], backend="egl")


def test_candidates_contain_the_default() -> None:
    for shadow in (gs.Shadow(), gs.Shadow(bias=gs.NoBias())):
        assert shadow.resolved().filter in RUNGS
        assert shadow.resolved().resolution in RESOLUTIONS


def test_plan_for_an_area_light() -> None:
    """One hard map is wrong along its penumbra; filters that use the light's size meet the budget, and the cheapest of them wins."""
    scene = gs.scenes.courtyard()
    sun = gs.DirectionalLight(angle=6.0)
    found = run_plan(scene, 1e-3, lights=[sun], size=(96, 54), resolutions=(1024,), repeats=1)
    assert any(isinstance(shadow.filter, gs.Pcss) for shadow in found.tried)
    best = found.choices[0].shadow.filter
    assert best is not None
    assert best.obeys_size


def test_time_budget_alone_chooses_the_most_accurate() -> None:
    """An hour allows every setting; a picosecond none, and the fastest is named."""
    common = {
        "size": (96, 54),
        "filters": [gs.Hard(), gs.Pcf(1)],
        "resolutions": (64, 256),
        "repeats": 1,
        "backend": "egl",
    }
    scene = gs.scenes.courtyard()
    slow = run_plan(scene, ms=3.6e6, **common)  # type: ignore[arg-type]
    assert slow.met
    assert len(slow.choices) == len(slow.tried) == 4
    assert slow.best.error == min(slow.tried.values())
    fast = run_plan(scene, ms=1e-9, **common)  # type: ignore[arg-type]
    assert not fast.met
    assert len(fast.choices) == 1
    both = run_plan(scene, 0.999, ms=3.6e6, **common)  # type: ignore[arg-type]
    assert [choice.cost for choice in both.choices] == sorted(choice.cost for choice in both.choices)
    assert len(both.choices) == 2, "of each filter the lowest resolution that meets the budget"


def test_plan_without_budget_is_refused() -> None:
    with pytest.raises(gs.SettingsError, match=r"give wrong.*or ms"):
        run_plan(gs.scenes.courtyard())
