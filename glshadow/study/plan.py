"""The cheapest settings whose measured error meets a budget."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from operator import attrgetter
from typing import Any

import numpy as np

from glshadow.arguments import USUAL_SIZE
from glshadow.core.cameras import Camera
from glshadow.core.setting import number, optional
from glshadow.errors import SettingsError
from glshadow.gl.driver.context import Backend
from glshadow.lights import Lights
from glshadow.shadows.filters import FILTERS, Filter
from glshadow.shadows.shadow import Shadow
from glshadow.study.grid import CHOSEN, SIDES, setting_name
from glshadow.study.result import Result, decisive_error
from glshadow.study.run import Progress, Run, open_run

# Everything else (bias, target, clip, fit) is derived: no other choice is cheaper for the same error (see the study).
RUNGS: tuple[Filter, ...] = tuple(each for kind in FILTERS for each in kind.rungs())
SHARE = number(0.0, 1.0, below=True, unit="(a share of the pixels)")
MILLISECONDS = number(0.0, above=True, unit="ms")
RESOLUTIONS = (256, 512, 1024, 2048, 4096)


@dataclass(frozen=True)
class Choice:
    """A setting that was scored and timed, on every light alone.

    Attributes
    ----------
    results : tuple of Result
        One per light that casts.
    """

    shadow: Shadow
    results: tuple[Result, ...]

    @property
    def name(self) -> str:
        """The setting in a few words."""
        return setting_name(self.shadow)

    @property
    def error(self) -> float:
        """That of the worst light: the share of wrong pixels, or of grainy ones where these are more."""
        return max(result.error for result in self.results)

    @property
    def cost(self) -> float:
        """Frame time over the floor, mean over the lights."""
        return float(np.mean([result.cost for result in self.results]))

    @property
    def ms(self) -> float:
        """Frame time with one light, mean over the lights."""
        return float(np.mean([result.ms for result in self.results]))

    def as_dict(self) -> dict[str, Any]:
        """For JSON."""
        return {"setting": self.name, "error": self.error, "cost": self.cost, "ms": self.ms,
                "lights": [result.as_dict() for result in self.results]}  # fmt: skip


@dataclass(frozen=True, repr=False)
class Plan:
    """What a budget costs.

    Attributes
    ----------
    budget : float or None
        Largest share of wrong pixels.
    ms : float or None
        Longest frame.
    choices : tuple of Choice
        What meets the budget, the best first. With a share of wrong pixels: of every filter its least resolution that does, the cheapest
        first; else of every filter all resolutions, the most accurate first. If nothing meets it: what comes nearest, alone.
    tried : dict
        Setting -> error of its worst light, in the order in which they were scored.
    """

    budget: float | None
    ms: float | None
    choices: tuple[Choice, ...]
    tried: dict[Shadow, float]

    @property
    def best(self) -> Choice:
        """The first of them."""
        return self.choices[0]

    @property
    def met(self) -> bool:
        """Whether the budget is met."""
        return _within(self.best.error, self.budget) and _within(self.best.ms, self.ms)

    @property
    def asked(self) -> str:
        """The budget in words."""
        asked = [] if self.budget is None else [f"wrong at most {self.budget:.4%}"]
        return ", ".join(asked if self.ms is None else [*asked, f"at most {self.ms:g} ms"])

    def as_dict(self) -> dict[str, Any]:
        """For JSON."""
        return {
            "budget": self.budget,
            "ms": self.ms,
            "met": self.met,
            "best": self.best.name,
            "choices": [choice.as_dict() for choice in self.choices],
            "tried": {setting_name(shadow): error for shadow, error in self.tried.items()},
        }

    def __repr__(self) -> str:
        met = "met" if self.met else "not met"
        return f"Plan({self.asked}, {met} by {self.best.name!r}, {len(self.tried)} settings tried)"

    def __str__(self) -> str:
        head = f"{self.asked}: {'' if self.met else 'not met by '}{self.best.name}"
        rows = [f"  {c.cost:5.2f} x floor {c.ms:7.1f} ms  wrong {c.error:8.4%}  {c.name}" for c in self.choices]
        return "\n".join([head, *rows])

    def _repr_html_(self) -> str:
        """In a notebook: what meets the budget, the best first."""
        from glshadow.inline import table, words

        rows = [[c.name, f"{c.cost:.2f}", f"{c.ms:.1f}", f"{c.error:.4%}"] for c in self.choices]
        said = f"{self.asked}, {len(self.tried)} settings tried: {'met by' if self.met else 'not met; nearest is'}"
        return f"<p>{words(said)}</p>{table(['setting', 'x floor', 'ms', 'wrong'], rows)}"


def run_plan(
    scene: Any,
    wrong: float | None = None,
    camera: Camera | None = None,
    lights: Lights = None,
    size: tuple[int, int] = USUAL_SIZE,
    filters: Sequence[Filter] = RUNGS,
    resolutions: Sequence[int] = RESOLUTIONS,
    repeats: int = 7,
    resume: str | os.PathLike[str] | None = None,
    progress: Progress | None = None,
    backend: Backend = "auto",
    ms: float | None = None,
) -> Plan:
    """Find the cheapest settings with at most a share `wrong` of wrong pixels, and as few grainy ones, for every light.

    Each filter climbs the resolutions until it meets the budget: a larger map with the same filter is never cheaper. Only
    what has met it is timed, in turn with the floor, and the cheapest wins. Without `wrong` everything is scored and timed, and the most
    accurate of what is fast enough wins.

    Parameters
    ----------
    scene, camera, lights, size, repeats, resume, progress, backend
        As in `run_study`; `resume` may be the journal of a study of the same picture.
    wrong, ms : float, optional
        Share of the counted pixels, 0 to 1; milliseconds of a frame with one light, mean over the lights. At least one of them.
    filters, resolutions
        What is tried; where no filters are given, for lights that have a size also those that obey it.

    Raises
    ------
    SettingsError
        As `run_study`; if there is no budget, it is not in [0, 1), not above 0, there is nothing to try, or no pixel counts.
    """
    wrong, ms = optional(SHARE, "the most accurate")("wrong", wrong), optional(MILLISECONDS, "any")("ms", ms)
    if wrong is None and ms is None:
        raise SettingsError("a plan needs a budget: give wrong, a share of the pixels, or ms, milliseconds of a frame")
    usual = filters is RUNGS
    filters, resolutions = CHOSEN("filters", filters), SIDES("resolutions", resolutions)
    ladders = _ladders(filters, resolutions)
    if not any(ladders):
        raise SettingsError(f"there is nothing to try: give filters and resolutions, got {filters!r}, {resolutions!r}")
    with open_run(scene, camera, lights, size, repeats, resume, progress, backend) as run:
        if usual and any(each.has_size for each in run.lights):
            ladders += _ladders([each for kind in FILTERS for each in kind.soft()], resolutions)
        run.total = len(run.lights) * sum(len(ladder) for ladder in ladders)
        tried: dict[Shadow, float] = {}
        climbed = [_climb(run, ladder, wrong, tried) for ladder in ladders]
        chosen = [shadow for met in climbed for shadow in met] or [min(tried, key=tried.__getitem__)]
        run.done = run.total
        for number in range(len(run.lights)):
            run.time(number, chosen)
        lit = range(len(run.lights))
        choices = [Choice(shadow, tuple(run.result(number, shadow) for number in lit)) for shadow in chosen]
    fast = [choice for choice in choices if _within(choice.ms, ms)]
    if not fast:
        return Plan(wrong, ms, (min(choices, key=lambda choice: choice.ms),), tried)
    key: Callable[[Choice], Any] = attrgetter("error", "cost") if wrong is None else attrgetter("cost")
    return Plan(wrong, ms, tuple(sorted(fast, key=key)), tried)


def _within(value: float, most: float | None) -> bool:
    return most is None or value <= most


def _ladders(filters: Sequence[Filter], resolutions: Sequence[int]) -> list[list[Shadow]]:
    """Of each filter the settings that are tried, the cheapest first."""
    return [
        [Shadow(resolution=step, filter=each).spelled_out() for step in sorted(resolutions)]
        if each.has_map
        else [Shadow(filter=each).spelled_out()]
        for each in filters
    ]  # fmt: skip


def _climb(run: Run, ladder: Sequence[Shadow], wrong: float | None, tried: dict[Shadow, float]) -> Sequence[Shadow]:
    """The first rung that meets the budget, if one does; without one, every rung."""
    for shadow in ladder:
        errors = [decisive_error(score) for number in range(len(run.lights)) for score in run.score(number, [shadow])]
        if any(math.isnan(error) for error in errors):
            raise SettingsError("there is nothing to plan for: a light has no pixel that counts in this picture")
        tried[shadow] = max(errors)
        if wrong is not None and tried[shadow] <= wrong:
            return [shadow]
    return ladder if wrong is None else []
