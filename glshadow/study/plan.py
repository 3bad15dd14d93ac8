"""The cheapest settings whose measured error meets a budget."""

from __future__ import annotations

import math
import os
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from glshadow.core.area import has_size
from glshadow.core.cameras import Camera
from glshadow.core.filters import FILTERS, Filter
from glshadow.core.lights import Lights
from glshadow.core.setting import number
from glshadow.core.shadow import Shadow
from glshadow.errors import SettingsError
from glshadow.gl.context import Backend
from glshadow.study.grid import CHOSEN, SIDES, setting_name
from glshadow.study.result import Result, decisive_error
from glshadow.study.run import Progress, Run, open_run

# Everything else (bias, target, clip, fit) is derived: no other choice is cheaper for the same error (see the study).
RUNGS: tuple[Filter, ...] = tuple(each for kind in FILTERS for each in kind.rungs())
SHARE = number(0.0, 1.0, below=True, unit="(a share of the pixels)")
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
    budget : float
        Largest share of wrong pixels.
    choices : tuple of Choice
        For every filter that meets the budget its least resolution that does, cheapest first. If none meets it: the most
        accurate setting alone.
    tried : dict
        Setting -> error of its worst light, in the order in which they were scored.
    """

    budget: float
    choices: tuple[Choice, ...]
    tried: dict[Shadow, float]

    @property
    def best(self) -> Choice:
        """The cheapest setting that meets the budget, else the most accurate one."""
        return self.choices[0]

    @property
    def met(self) -> bool:
        """Whether the budget is met."""
        return self.best.error <= self.budget

    def as_dict(self) -> dict[str, Any]:
        """For JSON."""
        return {
            "budget": self.budget,
            "met": self.met,
            "best": self.best.name,
            "choices": [choice.as_dict() for choice in self.choices],
            "tried": {setting_name(shadow): error for shadow, error in self.tried.items()},
        }

    def __repr__(self) -> str:
        met = "met" if self.met else "not met"
        return f"Plan(wrong at most {self.budget:.4%}, {met} by {self.best.name!r}, {len(self.tried)} settings tried)"

    def __str__(self) -> str:
        head = f"wrong at most {self.budget:.4%}: {'' if self.met else 'not met by '}{self.best.name}"
        rows = [f"  {c.cost:5.2f} x floor {c.ms:7.1f} ms  wrong {c.error:8.4%}  {c.name}" for c in self.choices]
        return "\n".join([head, *rows])


def run_plan(
    scene: Any,
    wrong: float,
    camera: Camera | None = None,
    lights: Lights = None,
    size: tuple[int, int] = (1280, 720),
    filters: Sequence[Filter] = RUNGS,
    resolutions: Sequence[int] = RESOLUTIONS,
    repeats: int = 7,
    resume: str | os.PathLike[str] | None = None,
    progress: Progress | None = None,
    backend: Backend = "auto",
) -> Plan:
    """Find the cheapest settings with at most a share `wrong` of wrong pixels, and as few grainy ones, for every light.

    Each filter climbs the resolutions until it meets the budget: a larger map with the same filter is never cheaper. Only
    what has met it is timed, in turn with the floor, and the cheapest wins.

    Parameters
    ----------
    scene, camera, lights, size, repeats, resume, progress, backend
        As in `run_study`; `resume` may be the journal of a study of the same picture.
    wrong : float
        Share of the counted pixels, 0 to 1.
    filters, resolutions
        What is tried; where no filters are given, for lights that have a size also those that obey it.

    Raises
    ------
    SettingsError
        As `run_study`; if the budget is not in [0, 1), there is nothing to try, or no pixel counts.
    """
    wrong = SHARE("wrong", wrong)
    usual = filters is RUNGS
    filters, resolutions = CHOSEN("filters", filters), SIDES("resolutions", resolutions)
    ladders = _ladders(filters, resolutions)
    if not any(ladders):
        raise SettingsError(f"there is nothing to try: give filters and resolutions, got {filters!r}, {resolutions!r}")
    with open_run(scene, camera, lights, size, repeats, resume, progress, backend) as run:
        if usual and any(map(has_size, run.lights)):
            ladders += _ladders([each for kind in FILTERS for each in kind.soft()], resolutions)
        run.total = len(run.lights) * sum(len(ladder) for ladder in ladders)
        tried: dict[Shadow, float] = {}
        met = [shadow for ladder in ladders if (shadow := _climb(run, ladder, wrong, tried)) is not None]
        chosen = met or [min(tried, key=lambda shadow: tried[shadow])]
        run.done = run.total
        for number in range(len(run.lights)):
            run.time(number, chosen)
        lit = range(len(run.lights))
        choices = [Choice(shadow, tuple(run.result(number, shadow) for number in lit)) for shadow in chosen]
    return Plan(wrong, tuple(sorted(choices, key=lambda choice: choice.cost)), tried)


def _ladders(filters: Sequence[Filter], resolutions: Sequence[int]) -> list[list[Shadow]]:
    """Of each filter the settings that are tried, the cheapest first."""
    return [
        [Shadow(resolution=step, filter=each).spelled_out() for step in sorted(resolutions)]
        if each.has_map
        else [Shadow(filter=each).spelled_out()]
        for each in filters
    ]  # fmt: skip


def _climb(run: Run, ladder: Sequence[Shadow], wrong: float, tried: dict[Shadow, float]) -> Shadow | None:
    """The first rung that meets the budget."""
    for shadow in ladder:
        errors = [decisive_error(score) for number in range(len(run.lights)) for score in run.score(number, [shadow])]
        if any(math.isnan(error) for error in errors):
            raise SettingsError("there is nothing to plan for: a light has no pixel that counts in this picture")
        tried[shadow] = max(errors)
        if tried[shadow] <= wrong:
            return shadow
    return None
