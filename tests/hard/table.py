"""The table case x technique as data: `rows()`, for reports and tests.

`python -m tests.hard.table` writes it to where the report of a study reads it.
"""

from __future__ import annotations

import json
from collections import Counter
from functools import cache
from pathlib import Path

from . import cases_contact, cases_fine, cases_views
from .registry import TECHNIQUES, Case, Picture, Verdict

SHIPPED = Path(__file__).resolve().parents[2] / "glshadow" / "study" / "hard_cases.json"

CASES: tuple[Case, ...] = tuple(
    sorted((*cases_contact.CASES, *cases_fine.CASES, *cases_views.CASES), key=lambda case: case.number)
)

# Cases that are not one picture per technique: number, title, which part, verdict, where it is tested or why not.
ELSEWHERE: tuple[tuple[int, str, str, Verdict, str], ...] = (
    (
        25,
        "far from the origin",
        "default, exact",
        Verdict.PASS,
        "test_metamorphic.py: sun, point light, spot; 6e6 to 1e9",
    ),
    (26, "scales of 1e-6 to 1e7", "default, exact", Verdict.PASS, "test_metamorphic.py: sun, point light, spot"),
    (28, "directions at the pole and of any length", "default, hard, exact", Verdict.PASS, "test_settings.py"),
    (29, "flat and empty scenes", "default, hard, exact", Verdict.PASS, "test_settings.py"),
    (31, "disc light over an edge", "traced truth", Verdict.PASS, "test_sizes.py: penumbra in closed form"),
    (
        31,
        "disc light over an edge",
        "percentage closer soft shadows",
        Verdict.PASS,
        "tests/filters/test_pcss.py: one edge to 0.08; layers of blockers are off by up to 0.5",
    ),
    (
        31,
        "disc light over an edge",
        "exact",
        Verdict.PASS,
        "tests/exact/test_soft_closed_forms.py: edge, strip, corner, ball",
    ),
    (32, "ramp of a straight edge", "pcf 0, 1, 2, 4", Verdict.PASS, "test_sizes.py: width, plateaus, centre"),
    (33, "two layers before the receiver", "variance shadow map", Verdict.NOT_BUILT, "no moments: V would be 0.41"),
    (34, "exponential leak", "exponential shadow map", Verdict.NOT_BUILT, "no filter reads it"),
    (35, "static receiver, moving camera", "scene fit", Verdict.PASS, "test_settings.py: the map is equal bit for bit"),
    (35, "static receiver, moving camera", "cascades", Verdict.NOT_BUILT, "no cascades, nothing to snap"),
    (36, "brain cortex, dungeon of instances", "default, exact", Verdict.PASS, "test_models.py"),
    (37, "not a number", "settings", Verdict.PASS, "test_settings.py"),
    (38, "maps and images of any size", "default", Verdict.PASS, "test_settings.py"),
    (38, "maps that are not square", "3 x 5", Verdict.NOT_APPLICABLE, "a map has one resolution"),
    (39, "the same scene told differently", "default, exact", Verdict.PASS, "test_metamorphic.py"),
)


@cache
def pictures(case: Case) -> tuple[Picture, ...]:
    """A case's pictures, built once."""
    return tuple(case.build())


def rows() -> list[dict[str, str | int]]:
    """One dict per case and technique: case, title, answer, technique, verdict, why."""
    result: list[dict[str, str | int]] = []
    for case in CASES:
        for technique in TECHNIQUES:
            expected = case.expected(technique)
            result.append({"case": case.number, "title": case.title, "answer": case.answer, "technique": technique,
                           "verdict": expected.verdict.value, "why": expected.why})  # fmt: skip
    for number, title, technique, verdict, why in ELSEWHERE:
        result.append({"case": number, "title": title, "answer": "", "technique": technique, "verdict": verdict.value,
                       "why": why})  # fmt: skip
    return sorted(result, key=lambda row: row["case"])


def summary() -> dict[str, int]:
    """Number of cells per verdict."""
    return dict(Counter(str(row["verdict"]) for row in rows()))


def as_json() -> str:
    """Input of `glshadow.study.cases`; a technique that does not apply to a case is omitted."""
    void = Verdict.NOT_APPLICABLE.value
    kept = [row for row in rows() if row["technique"] not in TECHNIQUES or row["verdict"] != void]
    cells = ",\n".join("  " + json.dumps(row) for row in kept)
    return f'{{\n "techniques": {json.dumps(list(TECHNIQUES))},\n "cells": [\n{cells}\n ]\n}}\n'


if __name__ == "__main__":
    SHIPPED.write_text(as_json(), encoding="utf-8")
