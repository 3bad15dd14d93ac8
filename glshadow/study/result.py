"""Results of a study: which settings are on the Pareto front, and how results are shown and stored."""

from __future__ import annotations

from dataclasses import dataclass, field, fields, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from glshadow.core.cameras import Camera
from glshadow.core.setting import as_floats, numbers_in, shown
from glshadow.errors import SettingsError, printable
from glshadow.lights import Light
from glshadow.scoring.score import Score
from glshadow.shadows.shadow import Shadow
from glshadow.study.grid import setting_name
from glshadow.study.pictures import Panel


@dataclass(frozen=True)
class Result:
    """Measurements of one setting for one light.

    Attributes
    ----------
    light : int
        Index of the light in the study.
    shadow : Shadow
        The setting.
    times_ms, floors_ms : tuple of float
        Wall-clock time of a frame of this light alone, including read-back, and of the floor; one per round.
    score : Score
        Its error.
    used : dict
        What was used: target, clip, bias, texel, fallbacks. `sampled`: the kinds of wrong pixels, and the grain, are estimates from a
        sample (see `remembered`); `wrong` and `mean` are not.
    """

    key: str
    light: int
    shadow: Shadow
    times_ms: tuple[float, ...]
    floors_ms: tuple[float, ...]
    score: Score
    used: dict[str, Any] = field(default_factory=dict)

    @property
    def name(self) -> str:
        """Name of the setting."""
        return setting_name(self.shadow)

    @property
    def ms(self) -> float:
        """Median frame time."""
        return float(np.median(self.times_ms))

    @property
    def spread_ms(self) -> tuple[float, float]:
        """Quartiles of the frame time."""
        low, high = np.percentile(self.times_ms, (25.0, 75.0))
        return float(low), float(high)

    @property
    def floor_ms(self) -> float:
        """Median floor of the same rounds."""
        return float(np.median(self.floors_ms))

    @property
    def cost(self) -> float:
        """Median over the rounds of frame time divided by the floor of that round."""
        return float(np.median(np.asarray(self.times_ms) / np.asarray(self.floors_ms)))

    @property
    def cost_spread(self) -> tuple[float, float]:
        """Quartiles of that ratio."""
        low, high = np.percentile(np.asarray(self.times_ms) / np.asarray(self.floors_ms), (25.0, 75.0))
        return float(low), float(high)

    @property
    def error(self) -> float:
        """The error by which settings are compared (`decisive_error`)."""
        return decisive_error(self.score)

    def as_dict(self) -> dict[str, Any]:
        """Plain data for JSON; numbers that are not finite become None."""
        return {"key": self.key, "light": self.light, "setting": self.name, "ms": self.ms, "floor_ms": self.floor_ms,
                "cost": self.cost, "error": plain_score(self.score), "used": self.used, "times_ms": list(self.times_ms),
                "floors_ms": list(self.floors_ms)}  # fmt: skip

    @classmethod
    def from_dict(cls, record: dict[str, Any], light: int, shadow: Shadow) -> Result:
        """A result from a journal's record; the key identifies the setting in the grid."""
        return cls(
            record["key"], light, shadow, tuple(record["times_ms"]), tuple(record["floors_ms"]),
            score_from(record), record["used"],
        )  # fmt: skip


@dataclass(frozen=True, eq=False, repr=False)
class Study:
    """Results of all settings of all lights, in the order of the grid.

    Attributes
    ----------
    scene : str
        Name of the scene; `triangles` and `nodes` count what it draws.
    size : (2,) ints
    camera : Camera
    lights : tuple of Light
        Those that cast shadows, each studied alone.
    results : tuple of Result
        By light, then in grid order.
    machine : dict
        Processor, driver, versions.
    repeats : int
        Rounds per setting.
    seconds : float
        Duration of this run.
    panels : dict
        Result key -> Panel, for the front of each light and the default setting.
    """

    scene: str
    triangles: int
    nodes: int
    size: tuple[int, int]
    camera: Camera
    lights: tuple[Light, ...]
    results: tuple[Result, ...]
    machine: dict[str, str]
    repeats: int
    seconds: float
    panels: dict[str, Panel] = field(default_factory=dict, repr=False)

    def of_light(self, light: int) -> tuple[Result, ...]:
        """Results of one light."""
        return tuple(result for result in self.results if result.light == light)

    def front(self, light: int = 0) -> tuple[Result, ...]:
        """The Pareto front of one light (`pareto_front` of cost and error), cheapest first."""
        results = self.of_light(light)
        best = pareto_front([r.cost for r in results], [r.error for r in results])
        chosen = [result for result, keep in zip(results, best, strict=True) if keep]
        return tuple(sorted(chosen, key=lambda result: (result.cost, result.error)))

    def as_dict(self) -> dict[str, Any]:
        """Plain data for JSON."""
        fronts = {result.key for light in range(len(self.lights)) for result in self.front(light)}
        return {
            "scene": {"name": self.scene, "triangles": self.triangles, "nodes": self.nodes},
            "size": list(self.size),
            "camera": repr(self.camera),
            "lights": [repr(replace(light, shadow=None)) for light in self.lights],
            "machine": self.machine,
            "repeats": self.repeats,
            "seconds": self.seconds,
            "results": [{**result.as_dict(), "front": result.key in fronts} for result in self.results],
        }

    def __repr__(self) -> str:
        counts = f"{len(self.results)} results of {len(self.lights)} light{'' if len(self.lights) == 1 else 's'}"
        return f"Study({shown(self.scene)}, {self.size[0]} x {self.size[1]}, {counts})"

    def __str__(self) -> str:
        lines = [
            f"{printable(self.scene)}, {self.size[0]} x {self.size[1]}: {len(self.results)} settings; not beaten by any other:"
        ]
        for light in range(len(self.lights)):
            lines += [f"  light {light}  {r.cost:5.2f} x floor {r.ms:7.1f} ms  wrong {r.score.wrong:8.4%}  {r.name}"
                      for r in self.front(light)]  # fmt: skip
        return "\n".join(lines)

    def _repr_html_(self) -> str:
        """In a notebook: the plot of each light (with the extra `study`), and the fronts as a table."""
        from glshadow.inline import table, words
        from glshadow.study.plot import plots

        head = ["light", "setting", "x floor", "ms", "wrong", "acne + leak", "grain"]
        rows = [
            [str(light), r.name, f"{r.cost:.2f}", f"{r.ms:.1f}", f"{r.score.wrong:.4%}",
             f"{r.score.acne + r.score.leak:.4%}", f"{r.score.grain:.4%}"]
            for light in range(len(self.lights))
            for r in self.front(light)
        ]  # fmt: skip
        return (
            f"<p>{words(self.scene)}, {self.size[0]} x {self.size[1]}: {len(self.results)} settings measured. "
            f"The Pareto front of speed and error:</p>{table(head, rows)}{''.join(plots(self))}"
        )


def decisive_error(score: Score) -> float:
    """The share of wrong pixels, or of grainy ones if these are more.

    A bias too small for its filter darkens everything slightly: no pixel counts as wrong, but the image is visibly bad.
    """
    return float(np.maximum(score.wrong, score.grain))


def score_from(record: dict[str, Any]) -> Score:
    """The error in a journal's record."""
    numbers = {item.name: record["error"].get(item.name) for item in fields(Score)}
    return Score(**{name: np.nan if value is None else value for name, value in numbers.items()})


def plain_score(score: Score) -> dict[str, float | None]:
    """Plain data for JSON; None where no pixel is counted."""
    values = {item.name: float(getattr(score, item.name)) for item in fields(Score)}
    return {name: value if np.isfinite(value) else None for name, value in values.items()}


_MOST_SETTINGS = 10_000  # every setting is compared with every other


def pareto_front(costs: ArrayLike, errors: ArrayLike) -> NDArray[np.bool_]:
    """Which of N settings are on the Pareto front.

    A setting is dominated if another one is at least as cheap and at least as accurate, and strictly better in one of the two.
    Settings that tie in both are treated alike; a setting whose cost or error is NaN is dominated.

    Parameters
    ----------
    costs, errors : (N,) array_like
        Lower is better.

    Raises
    ------
    SettingsError
        If they are not the same count of numbers.
    """
    given = numbers_in(costs)
    cost = None if given is None or given.size > _MOST_SETTINGS else as_floats(costs, (None,))
    error = None if cost is None else as_floats(errors, cost.shape)
    if cost is None or error is None:
        raise SettingsError(
            f"costs and errors must be the same count of numbers (N,), got {shown(costs)} and {shown(errors)}"
        )
    known = ~(np.isnan(cost) | np.isnan(error))
    as_good = (cost[:, None] <= cost) & (error[:, None] <= error)
    better = (cost[:, None] < cost) | (error[:, None] < error)
    return np.asarray(known & ~(as_good & better & known[:, None]).any(axis=0))
