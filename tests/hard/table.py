"""The table case x technique as data: `rows()`, for reports and tests.

`python -m tests.hard.table` writes it to where the report of a study reads it.
"""

from __future__ import annotations

import json
from collections import Counter
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from glshadow import DirectionalLight, EnvironmentLight, PointLight, RectLight, SkyLight, SpotLight
from glshadow.shadows.filters import (
    BabylonEsm,
    DirectionMaps,
    Disc,
    EdgePcf,
    Esm,
    Evsm,
    Exact,
    Gaussian,
    Hard,
    LightSamples,
    Msm,
    Pcf,
    Pcss,
    Poisson,
    Vsm,
)
from glshadow.shadows.fits import Cascades, Lispsm, SceneFit, ViewFit

from . import cases_contact, cases_fine, cases_views
from .registry import TECHNIQUES, Case, Picture, Verdict

SHIPPED = Path(__file__).resolve().parents[2] / "glshadow" / "study" / "hard_cases.json"

CASES: tuple[Case, ...] = tuple(
    sorted((*cases_contact.CASES, *cases_fine.CASES, *cases_views.CASES), key=lambda case: case.number)
)


@dataclass(frozen=True)
class Elsewhere:
    """What is tested in another way than by a picture with a technique.

    Parameters
    ----------
    case, title
        As of `Case`; one of a number that has pictures too may have another title.
    of : str
        What is tested, in words.
    verdict : Verdict
    where : str
        The test, and its outcome; or why there is none.
    kinds : tuple of type
        Filters, fits and lights that it tests.
    """

    case: int
    title: str
    of: str
    verdict: Verdict
    where: str
    kinds: tuple[type, ...] = ()


PASS, FAILS = Verdict.PASS, Verdict.FAILS
EDGE, RAMP, MOVING = "disc light over an edge", "ramp of a straight edge", "static receiver, moving camera"
POSTS = "posts in depth"

ELSEWHERE: tuple[Elsewhere, ...] = (
    Elsewhere(
        5,
        "convex sphere alone",
        "BabylonEsm",
        FAILS,
        "tests/filters/test_moments.py: 1 - exp(0), dark where it is its own caster",
        (BabylonEsm,),
    ),
    Elsewhere(
        12,
        "wires of 2 to 1/10 texels",
        "EdgePcf",
        FAILS,
        "tests/filters/test_edge_pcf.py: a wire between the five blocks is lost",
        (EdgePcf,),
    ),
    Elsewhere(
        25,
        "far from the origin",
        "default, exact",
        PASS,
        "test_metamorphic.py: sun, point light, spot; 6e6 to 1e9",
        (DirectionalLight, PointLight, SpotLight),
    ),
    Elsewhere(26, "scales of 1e-6 to 1e7", "default, exact", PASS, "test_metamorphic.py: sun, point light, spot"),
    Elsewhere(
        28, "directions at the pole and of any length", "default, hard, exact", PASS, "test_settings.py", (Hard,)
    ),
    Elsewhere(29, "flat and empty scenes", "default, hard, exact", PASS, "test_settings.py"),
    Elsewhere(31, EDGE, "ray-traced reference", PASS, "test_sizes.py: penumbra in closed form"),
    Elsewhere(
        31,
        EDGE,
        "Pcss",
        PASS,
        "tests/filters/test_pcss.py: one edge to 0.08; layers of blockers are off by up to 0.5",
        (Pcss,),
    ),
    Elsewhere(
        31,
        EDGE,
        "LightSamples",
        PASS,
        "tests/exact/test_area_lights.py: mean error below 0.01 of as many points by exact",
        (LightSamples,),
    ),
    Elsewhere(31, EDGE, "exact", PASS, "tests/exact/test_soft_closed_forms.py: edge, strip, corner, ball", (Exact,)),
    Elsewhere(
        31,
        "rectangle over an edge, and alone",
        "exact, rectangular area light",
        PASS,
        "tests/exact/test_area_lights.py: form factors in closed form",
        (RectLight,),
    ),
    Elsewhere(
        31,
        "sky over a floor and beside a wall",
        "exact, sky light",
        PASS,
        "tests/exact/test_area_lights.py: 1, and 1/2 beside a wall",
        (SkyLight,),
    ),
    Elsewhere(
        31,
        "sky over a floor and in a corner",
        "DirectionMaps",
        PASS,
        "tests/gl/test_directions.py: the twin, and mean error below 0.006 of rays; no steps of a direction",
        (DirectionMaps,),
    ),
    Elsewhere(
        31,
        "image of the surroundings: a dome, a sun, two suns of two colours",
        "exact, environment light",
        PASS,
        "tests/lights/test_environment.py: as the sky, as the sun, each alone in the other's shadow",
        (EnvironmentLight,),
    ),
    Elsewhere(32, RAMP, "Pcf of 0, 1, 2, 4", PASS, "test_sizes.py: width, plateaus, centre", (Pcf,)),
    Elsewhere(32, RAMP, "Poisson", PASS, "tests/filters/test_poisson.py: five levels, place by place", (Poisson,)),
    Elsewhere(
        32,
        RAMP,
        "EdgePcf of 2, 3, 4",
        PASS,
        "tests/filters/test_edge_pcf.py: equal to pcf in every direction",
        (EdgePcf,),
    ),
    Elsewhere(
        32, RAMP, "Gaussian of 1, 2, 3", PASS, "tests/filters/test_gaussian.py: the sum of its weights", (Gaussian,)
    ),
    Elsewhere(32, RAMP, "Disc", PASS, "tests/filters/test_disc.py: the disc's width along the edge", (Disc,)),
    Elsewhere(
        33,
        "two layers before the receiver",
        "Vsm",
        FAILS,
        "tests/filters/test_moments.py: Chebyshev's bound 0.38 for a receiver that sees nothing; 0.11 with bleeding=0.3",
        (Vsm,),
    ),
    Elsewhere(
        33,
        "two layers before the receiver",
        "Evsm, Msm",
        FAILS,
        "tests/filters/test_moments.py: below 0.01 and 0.2",
        (Evsm, Msm),
    ),
    Elsewhere(
        34,
        "exponential leak",
        "Esm",
        FAILS,
        "tests/filters/test_moments.py: exp(-80 x 0.1) / 2 = 0.0002; leaks near contacts: N1, N9",
        (Esm,),
    ),
    Elsewhere(
        34,
        "exponential leak",
        "BabylonEsm(close=True)",
        FAILS,
        "tests/filters/test_moments.py: exp(-5) at 0.1 of the range behind the caster",
        (BabylonEsm,),
    ),
    Elsewhere(
        35,
        POSTS,
        "Cascades, Lispsm",
        PASS,
        "tests/gl/test_cascades.py: every length, no seam, no acne",
        (Cascades, Lispsm),
    ),
    Elsewhere(35, MOVING, "scene fit", PASS, "test_settings.py: the map is equal bit for bit", (SceneFit,)),
    Elsewhere(
        35,
        MOVING,
        "Cascades(stable=True)",
        PASS,
        "tests/gl/test_cascades.py: equal bit for bit while they stay, moved by whole texels else",
        (Cascades,),
    ),
    Elsewhere(35, POSTS, "ViewFit", PASS, "every column but that of the scene fit is drawn with it", (ViewFit,)),
    Elsewhere(36, "brain cortex, dungeon of instances", "default, exact", PASS, "test_models.py"),
    Elsewhere(37, "not a number", "settings", PASS, "test_settings.py"),
    Elsewhere(38, "maps and images of any size", "default", PASS, "test_settings.py"),
    Elsewhere(38, "maps that are not square", "3 x 5", Verdict.NOT_APPLICABLE, "a map has one resolution"),
    Elsewhere(39, "the same scene told differently", "default, exact", PASS, "test_metamorphic.py"),
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
    for each in ELSEWHERE:
        result.append({"case": each.case, "title": each.title, "answer": "", "technique": each.of, "verdict": each.verdict.value,
                       "why": each.where})  # fmt: skip
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
