"""Finds the cheapest settings whose measured error is within a budget."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from operator import attrgetter
from typing import Any

import numpy as np

from glshadow.arguments import DEFAULT_SIZE
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

# Everything else (bias, target, clip, fit) is derived: studies find no choice that is cheaper for the same error.
RUNGS: tuple[Filter, ...] = tuple(each for kind in FILTERS for each in kind.rungs())
SHARE = number(0.0, 1.0, below=True, unit="(a share of the pixels)")
MILLISECONDS = number(0.0, above=True, unit="ms")
RESOLUTIONS = (256, 512, 1024, 2048, 4096)


@dataclass(frozen=True)
class Choice:
    """A setting that was measured, on every light alone.

    Attributes
    ----------
    results : tuple of Result
        One per light that casts shadows.
    """

    shadow: Shadow
    results: tuple[Result, ...]

    @property
    def name(self) -> str:
        """Name of the setting."""
        return setting_name(self.shadow)

    @property
    def error(self) -> float:
        """Error of the worst light: the share of wrong pixels, or of grainy ones if these are more."""
        return max(result.error for result in self.results)

    @property
    def cost(self) -> float:
        """Frame time divided by floor, mean over the lights."""
        return float(np.mean([result.cost for result in self.results]))

    @property
    def ms(self) -> float:
        """Frame time with one light, mean over the lights."""
        return float(np.mean([result.ms for result in self.results]))

    def as_dict(self) -> dict[str, Any]:
        """Plain data for JSON."""
        return {"setting": self.name, "error": self.error, "cost": self.cost, "ms": self.ms,
                "lights": [result.as_dict() for result in self.results]}  # fmt: skip


@dataclass(frozen=True, repr=False)
class Plan:
    """Result of a search for the cheapest settings within a budget.

    Attributes
    ----------
    budget : float or None
        Largest allowed share of wrong pixels.
    ms : float or None
        Longest allowed frame time.
    choices : tuple of Choice
        Settings within the budget, best first. With an error budget: for every filter its lowest resolution within it, the cheapest first;
        otherwise all resolutions of every filter, the most accurate first. If nothing meets the budget: only the nearest.
    tried : dict
        Setting -> error of its worst light, in the order of measurement.
    """

    budget: float | None
    ms: float | None
    choices: tuple[Choice, ...]
    tried: dict[Shadow, float]

    @property
    def best(self) -> Choice:
        """The best choice."""
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
        """Plain data for JSON."""
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
        """In a notebook: a table of the choices, best first."""
        from glshadow.inline import table, words

        rows = [[c.name, f"{c.cost:.2f}", f"{c.ms:.1f}", f"{c.error:.4%}"] for c in self.choices]
        said = f"{self.asked}, {len(self.tried)} settings tried: {'met by' if self.met else 'not met; nearest is'}"
        return f"<p>{words(said)}</p>{table(['setting', 'x floor', 'ms', 'wrong'], rows)}"


def run_plan(
    scene: Any,
    wrong: float | None = None,
    camera: Camera | None = None,
    lights: Lights = None,
    size: tuple[int, int] = DEFAULT_SIZE,
    filters: Sequence[Filter] = RUNGS,
    resolutions: Sequence[int] = RESOLUTIONS,
    repeats: int = 7,
    resume: str | os.PathLike[str] | None = None,
    progress: Progress | None = None,
    backend: Backend = "auto",
    ms: float | None = None,
) -> Plan:
    """Find the cheapest settings with at most a share `wrong` of wrong pixels, and of grainy ones, for every light.

    Each filter tries increasing resolutions until it meets the budget: a larger map with the same filter is never cheaper. Only settings
    that meet it are timed, in turn with the floor, and the cheapest wins. Without `wrong`, all settings are measured and timed, and the
    most accurate of those that are fast enough wins.

    Parameters
    ----------
    scene, camera, lights, size, repeats, resume, progress, backend
        As for `run_study`; `resume` may be the journal of a study of the same image.
    wrong, ms : float, optional
        Largest share of the counted pixels, 0 to 1; milliseconds of a frame with one light, mean over the lights. At least one of them.
    filters, resolutions
        Filters and resolutions to try. Default filters include those for lights that have a size, if there are such lights.

    Raises
    ------
    SettingsError
        As for `run_study`; also if the budget is missing or out of range, if there is nothing to try, or if no pixel is counted.
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
    """For each filter the settings to try, cheapest first."""
    return [
        [Shadow(resolution=step, filter=each).spelled_out() for step in sorted(resolutions)]
        if each.has_map
        else [Shadow(filter=each).spelled_out()]
        for each in filters
    ]  # fmt: skip


def _climb(run: Run, ladder: Sequence[Shadow], wrong: float | None, tried: dict[Shadow, float]) -> Sequence[Shadow]:
    """The first setting that meets the budget; all of them if there is no error budget, or if none does."""
    for shadow in ladder:
        errors = [decisive_error(score) for number in range(len(run.lights)) for score in run.score(number, [shadow])]
        if any(math.isnan(error) for error in errors):
            raise SettingsError("there is nothing to plan for: a light has no counted pixel in this image")
        tried[shadow] = max(errors)
        if wrong is not None and tried[shadow] <= wrong:
            return [shadow]
    return ladder if wrong is None else []
