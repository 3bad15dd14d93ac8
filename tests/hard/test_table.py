"""The table is complete: no case is missing, and every named technique exists."""

from __future__ import annotations

from pathlib import Path

from .registry import TECHNIQUES, Verdict
from .table import CASES, ELSEWHERE, SHIPPED, as_json, pictures, rows


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
    for *_, why in ELSEWHERE:
        if why.startswith("test_"):
            assert (Path(__file__).parent / why.split(":")[0]).exists()


def test_report_contains_this_table() -> None:
    assert SHIPPED.read_text(encoding="utf-8") == as_json(), "regenerate it: python -m tests.hard.table"
