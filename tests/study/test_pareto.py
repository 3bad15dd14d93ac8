"""The Pareto front and the grid, on known points."""

from dataclasses import replace

import numpy as np
import pytest

import glshadow as gs
from glshadow.cli import values
from glshadow.scoring.score import Outcome, Score
from glshadow.study import Grid, pareto_front
from glshadow.study.grid import setting_name
from glshadow.study.pictures import REGION_SHARE, worst_regions
from glshadow.study.report import percent
from glshadow.study.result import decisive_error


def test_front_of_known_points() -> None:
    points = {
        (1.0, 9.0): True,  # the fastest
        (2.0, 4.0): True,
        (2.0, 5.0): False,  # as fast as the last, and worse
        (3.0, 4.0): False,  # as good, and slower
        (3.0, 3.0): True,
        (4.0, 1.0): True,
        (5.0, 1.0): False,
        (6.0, 2.0): False,
    }
    cost, error = np.array(list(points)).T
    assert pareto_front(cost, error).tolist() == list(points.values())


def test_ties_are_kept_or_dropped_together_and_nan_is_dropped() -> None:
    assert pareto_front([1.0, 1.0, 2.0], [1.0, 1.0, 1.0]).tolist() == [True, True, False]
    assert pareto_front([1.0, np.nan, 0.5], [1.0, 0.0, np.nan]).tolist() == [True, False, False]
    assert pareto_front([], []).tolist() == []


def test_front_against_the_definition(rng: np.random.Generator) -> None:
    cost, error = rng.integers(0, 6, (2, 60)).astype(float)
    expected = [
        not any(
            c <= cost[i] and e <= error[i] and (c < cost[i] or e < error[i]) for c, e in zip(cost, error, strict=True)
        )
        for i in range(60)
    ]
    assert pareto_front(cost, error).tolist() == expected


def test_default_grid_scales_with_the_scene_and_contains_the_default() -> None:
    scene = gs.scenes.courtyard()
    settings = Grid.default(scene).settings()
    assert gs.Shadow().spelled_out() in settings
    assert len(settings) == len(set(settings)) == 78
    assert gs.ConstantBias(0.03) in {shadow.bias for shadow in settings}  # a thousandth of its diagonal of 34


def test_grid_omits_invalid_combinations() -> None:
    grid = Grid((512,), (gs.Hard(),), (None, gs.SlopeScaledBias()), (None, gs.Target.R32F))
    assert [setting_name(shadow) for shadow in grid.settings()] == ["512 hard", "512 hard slope", "512 hard r32f"]


def test_area_lights_get_filters_that_use_their_size(scene: gs.Scene) -> None:
    usual = {shadow.filter for shadow in Grid.default(scene).settings()}
    soft = {shadow.filter for shadow in Grid.default(scene, [gs.DirectionalLight(angle=2.0)]).settings()} - usual
    assert soft == {gs.Pcss(), gs.Pcss(32, 64), gs.LightSamples(16), gs.LightSamples(64), gs.Exact(light_samples=16),
                    gs.Exact(light_samples=256)}  # fmt: skip


def test_names() -> None:
    assert setting_name(gs.Shadow(fit=gs.SceneFit())) == "2048 pcf:1 fit scene"


@pytest.mark.parametrize("kind", [gs.Hard(), gs.Pcf(0), gs.Pcf(3)])
def test_filters_are_named_as_the_command_line_reads_them(kind: gs.Hard | gs.Pcf) -> None:
    assert values.shadow_filter(str(kind)) == kind


def test_grainy_setting_does_not_dominate_a_clean_one() -> None:
    clean = Score(0.01, 0.002, 0.002, 0.0, 0.0, 0.0, 0.0, 1.0, 0.002, 0.01, 0.0, 0.0, 0.01)
    assert decisive_error(clean) == 0.002
    assert decisive_error(replace(clean, wrong=0.001, grain=0.9)) == 0.9
    assert np.isnan(decisive_error(replace(clean, wrong=np.nan, grain=np.nan)))


@pytest.mark.parametrize(
    ("value", "text"), [(0.0, "0"), (5.35e-4, "0.0535"), (0.0104, "1.04"), (0.24, "24.0"), (2e-6, "0.0002")]
)
def test_percent(value: float, text: str) -> None:
    assert percent(value) == text


def test_worst_regions_find_the_worst_first() -> None:
    kinds = np.full((100, 200), Outcome.GOOD, dtype=np.uint8)
    kinds[10:14, 20:24] = Outcome.EDGE
    kinds[70:74, 150:154] = Outcome.ACNE
    kinds[12, 24:26] = Outcome.GRAIN
    first, second = worst_regions(kinds)
    assert (first.wrong, second.wrong) == (16, 16)
    assert (first.grainy, second.grainy) == (0, 2)
    assert first.x <= 150 <= first.x + first.width
    assert second.y <= 10 <= second.y + second.height
    assert (first.width, first.height) == (round(200 * REGION_SHARE), round(100 * REGION_SHARE))
    assert worst_regions(np.full((100, 200), Outcome.GOOD, dtype=np.uint8)) == ()
