"""Every hard case that is a picture, with every technique that claims it or is predicted to fail it."""

from __future__ import annotations

import numpy as np
import pytest

from glshadow.renderer import Renderer

from .judge import judge, predict, truth_of
from .registry import LEAKS, TECHNIQUES, THOROUGH, Case, Verdict
from .table import CASES, pictures

CASE_IDS = [f"N{case.number}" for case in CASES]
ONE_IN = 5
"""Of the cells that pass, every run takes this share, of each case and of each technique; `--all` takes the others."""


def _marks(row: int, column: int) -> tuple[pytest.MarkDecorator, ...]:
    name = list(TECHNIQUES)[column]
    passes = CASES[row].expected(name).verdict is Verdict.PASS and CASES[row].number not in LEAKS.get(name, {})
    others = passes and TECHNIQUES[name] not in THOROUGH and (row + column) % ONE_IN
    return (pytest.mark.exhaustive,) if others else ()


CELLS = [
    pytest.param(case, name, id=f"N{case.number}-{name}", marks=_marks(row, column))
    for row, case in enumerate(CASES)
    for column, name in enumerate(TECHNIQUES)
    if case.expected(name).verdict is not Verdict.NOT_APPLICABLE
]

TIMES = 2.0
"""Factor within which the predicted number of failures must be."""

FEW = 10
"""Pixels by which a leak may differ besides: another driver rounds moments otherwise."""


@pytest.mark.parametrize("case", CASES, ids=CASE_IDS)
def test_reference_equals_the_closed_form(case: Case) -> None:
    for picture in pictures(case):
        truth = truth_of(picture)
        seen = ~np.isnan(truth.visibility[0])
        facing = seen & (truth.cosine[0] > 0.0) & truth.reached[0]
        assert (facing & (truth.visibility[0] == 1.0)).any() == picture.lit, picture.name
        assert (facing & (truth.visibility[0] == 0.0)).any() == picture.dark, picture.name
        if picture.exact is not None:
            # closed forms know no cone: outside of it no light arrives
            shone = picture.light.shines_on(truth.position[seen])
            exact = np.where(shone, picture.exact(truth.position[seen], truth.shading[seen]), 0.0)
            share = (exact != truth.visibility[0][seen]).mean()
            assert share <= picture.closed_form_share, f"{picture.name}: {share:.4%} of the pixels differ"


@pytest.mark.parametrize(("case", "technique"), CELLS)
def test_mismatches_are_only_the_listed_ones(renderer: Renderer, case: Case, technique: str) -> None:
    many = TECHNIQUES[technique] in THOROUGH
    chosen = pictures(case)[: None if many else case.probes]
    outcomes = [judge(renderer, picture, TECHNIQUES[technique]) for picture in chosen]
    if case.number in LEAKS.get(technique, {}):
        for outcome in outcomes:
            assert not outcome.acne.any(), f"{outcome}: a bound from above darkens nothing"
            listed = LEAKS[technique][case.number]
            assert listed / TIMES - FEW <= outcome.mismatches <= listed * TIMES + FEW, f"{outcome}; listed {listed}"
        return
    if case.expected(technique).verdict is Verdict.FAILS:
        for outcome in outcomes:
            measured, predicted = outcome.mismatches, sum(vars(predict(outcome)).values())
            assert measured > 0, f"{outcome} passes now: no longer list it"
            assert predicted / TIMES <= measured <= predicted * TIMES, f"{outcome}; predicted {predicted:.0f}"
        return
    failing = {outcome.picture.name: outcome for outcome in outcomes if outcome.mismatches}
    known = case.known(technique, [picture.name for picture in chosen])
    unlisted = [str(outcome) for name, outcome in failing.items() if name not in known]
    assert not unlisted, "; ".join(unlisted)
    passing = sorted(set(known) - set(failing))
    assert not passing, f"{passing} pass with {technique}: no longer list them as known failures"
    for name, reason in known.items():
        if reason.creases_only:
            assert failing[name].off_creases() == 0, f"{failing[name]}: not only next to surfaces that rise"
    if known:
        pytest.xfail("; ".join(f"{name}: {reason.why}" for name, reason in known.items()))
