"""The table is complete: no case is missing, and every named technique exists."""

from __future__ import annotations

from pathlib import Path

import pytest

import glshadow as gs
from glshadow.lights import LIGHTS
from glshadow.shadows.filters import FILTERS
from glshadow.shadows.fits import FITS

from .registry import LEAKS, MOMENTS, TECHNIQUES, Verdict
from .table import CASES, ELSEWHERE, SHIPPED, as_json, pictures, rows

CHECKOUT = Path(__file__).resolve().parents[2]


def test_all_40_cases_are_in_the_table() -> None:
    assert {row["case"] for row in rows()} == set(range(1, 41))


def test_every_cell_is_there_once() -> None:
    cells = [(row["case"], row["technique"], row["title"]) for row in rows()]
    assert len(set(cells)) == len(cells)
    for case in CASES:
        assert {row["technique"] for row in rows() if row["case"] == case.number} >= set(TECHNIQUES)


def test_every_other_verdict_has_a_reason() -> None:
    assert all(row["why"] for row in rows() if row["verdict"] != Verdict.PASS.value)


def test_listed_techniques_pictures_and_files_exist() -> None:
    for case in CASES:
        named = {*case.fails, *case.skips, *case.passes, *(name for each in case.findings for name in each.techniques)}
        assert named <= set(TECHNIQUES)
        names = [picture.name for picture in pictures(case)]
        assert len(set(names)) == len(names)
        assert {name for each in case.findings for name in each.pictures} <= set(names)
    for each in ELSEWHERE:
        file = each.where.split(":")[0]
        if file.startswith("tests/"):
            assert (CHECKOUT / file).exists(), file
        elif file.startswith("test_"):
            assert (Path(__file__).parent / file).exists(), file


@pytest.mark.parametrize("kind", [*FILTERS, *FITS, *LIGHTS], ids=lambda kind: kind.__name__)
def test_every_filter_fit_and_light_has_a_row_that_is_tested(kind: type) -> None:
    rows_of = [each for each in ELSEWHERE if kind in each.kinds]
    assert rows_of
    assert all(each.verdict in (Verdict.PASS, Verdict.FAILS) for each in rows_of)


def test_filters_that_claim_a_clean_image_have_a_column() -> None:
    columns = {type(technique.filter) for technique in TECHNIQUES.values()}
    assert columns == set(FILTERS) - {gs.Pcss, gs.DirectionMaps, gs.LightSamples}, (
        "these are made for lights that have a size"
    )


def test_nothing_that_exists_is_called_not_built() -> None:
    for path in (SHIPPED, CHECKOUT / "docs" / "hard_cases.md"):
        assert "not built" not in path.read_text(encoding="utf-8")


def test_only_moment_maps_leak_by_their_nature() -> None:
    assert set(LEAKS) == {each.name for each in MOMENTS}


def test_report_contains_this_table() -> None:
    assert SHIPPED.read_text(encoding="utf-8") == as_json(), "regenerate it: python -m tests.hard.table"
