"""A grid of shadow settings, each measured for speed and for error in one run.

Speed is a ratio: a setting's frame time over the floor of the same round (see `floor`), since absolute times on a shared machine drift
by more than settings differ. Error is `glshadow.measure` against one trace per light.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, fields, replace
from itertools import groupby
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from glshadow.core.cameras import PerspectiveCamera
from glshadow.core.lights import DirectionalLight, Light
from glshadow.core.shadow import Shadow
from glshadow.errors import SettingsError
from glshadow.frame import Frame
from glshadow.measure.error import Score, ShadowError, measure
from glshadow.reference.trace import trace
from glshadow.renderer import Renderer
from glshadow.scene.mesh import Scene
from glshadow.study.floor import Floor
from glshadow.study.grid import Grid, setting_name, settings_of
from glshadow.study.journal import Journal, fingerprint, result_key
from glshadow.study.machine import machine
from glshadow.study.pictures import Panel, panel
from glshadow.study.remembered import RememberedTruth

Progress = Callable[[int, int, str], None]

WARM_UP = 2  # rounds that are not counted: the first one allocates and compiles
FLOOR_RESOLUTION = 2048  # one floor for all settings, so that their ratios compare
STEP_RAD = (
    2e-3  # a sun turns by this from round to round, and nothing that was drawn for the last round serves the next
)


@dataclass(frozen=True)
class Result:
    """One setting of one light.

    Attributes
    ----------
    light : int
        Number of the light in the study.
    shadow : Shadow
        The setting.
    times_ms, floors_ms : tuple of float
        Wall clock of a frame of this light alone, image read back, and of the floor; one per round.
    score : Score
        Its error.
    used : dict
        What was really used: target, clip, bias, texel, fallbacks; `sampled`: the kinds of its wrong pixels, and its grain, are
        estimates from a sample (see `remembered`), `wrong` and `mean` are not.
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
        """The setting in a few words."""
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
        """Median over the rounds of frame time / floor of that round."""
        return float(np.median(np.asarray(self.times_ms) / np.asarray(self.floors_ms)))

    @property
    def cost_spread(self) -> tuple[float, float]:
        """Quartiles of that ratio."""
        low, high = np.percentile(np.asarray(self.times_ms) / np.asarray(self.floors_ms), (25.0, 75.0))
        return float(low), float(high)

    def as_dict(self) -> dict[str, Any]:
        """For JSON; numbers that are not finite become None."""
        return {"key": self.key, "light": self.light, "setting": self.name, "ms": self.ms, "floor_ms": self.floor_ms,
                "cost": self.cost, "error": plain_score(self.score), "used": self.used, "times_ms": list(self.times_ms),
                "floors_ms": list(self.floors_ms)}  # fmt: skip

    @classmethod
    def from_dict(cls, record: dict[str, Any], light: int, shadow: Shadow) -> Result:
        """From a journal's record; the setting is known from the grid by its key."""
        numbers = {item.name: record["error"][item.name] for item in fields(Score)}
        score = Score(**{name: np.nan if value is None else value for name, value in numbers.items()})
        return cls(
            record["key"], light, shadow, tuple(record["times_ms"]), tuple(record["floors_ms"]), score, record["used"]
        )


@dataclass(frozen=True, eq=False)
class Study:
    """Results of all settings of all lights, in the order of the grid.

    Attributes
    ----------
    scene : str
        Its name; `triangles` and `nodes` it draws.
    size : (2,) ints
    camera : PerspectiveCamera
    lights : tuple of Light
        Those that cast, each studied alone.
    results : tuple of Result
        By light, then in the order of the grid.
    machine : dict
        Processor, driver, versions.
    repeats : int
        Rounds per setting.
    seconds : float
        What this run took.
    panels : dict
        Result key -> Panel, for the front of each light and the default setting.
    """

    scene: str
    triangles: int
    nodes: int
    size: tuple[int, int]
    camera: PerspectiveCamera
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
        """The settings of one light that no other beats (`pareto_front` of cost and wrong), cheapest first."""
        results = self.of_light(light)
        best = pareto_front([r.cost for r in results], [r.score.wrong for r in results])
        chosen = [result for result, keep in zip(results, best, strict=True) if keep]
        return tuple(sorted(chosen, key=lambda result: (result.cost, result.score.wrong)))

    def as_dict(self) -> dict[str, Any]:
        """For JSON."""
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

    def __str__(self) -> str:
        lines = [
            f"{self.scene}, {self.size[0]} x {self.size[1]}: {len(self.results)} settings; not beaten by any other:"
        ]
        for light in range(len(self.lights)):
            lines += [f"  light {light}  {r.cost:5.2f} x floor {r.ms:7.1f} ms  wrong {r.score.wrong:8.4%}  {r.name}"
                      for r in self.front(light)]  # fmt: skip
        return "\n".join(lines)

    def _repr_html_(self) -> str:
        """The fronts as a table in a notebook."""
        rows = "".join(
            f"<tr><td>{light}</td><td style='text-align:left'>{r.name}</td><td>{r.cost:.2f}</td><td>{r.ms:.1f}</td>"
            f"<td>{r.score.wrong:.4%}</td><td>{r.score.acne + r.score.leak:.4%}</td><td>{r.score.grain:.4%}</td></tr>"
            for light in range(len(self.lights))
            for r in self.front(light)
        )
        return (
            f"<p>{self.scene}, {self.size[0]} x {self.size[1]}: {len(self.results)} settings measured. "
            "Those that no other beats in both speed and error:</p><table><thead><tr><th>light</th><th>setting</th>"
            "<th>&times; floor</th><th>ms</th><th>wrong</th><th>acne + leak</th><th>grain</th></tr></thead>"
            f"<tbody>{rows}</tbody></table>"
        )


def plain_score(score: Score) -> dict[str, float | None]:
    """For JSON; None where no pixel counts."""
    values = {item.name: float(getattr(score, item.name)) for item in fields(Score)}
    return {name: value if np.isfinite(value) else None for name, value in values.items()}


def pareto_front(costs: ArrayLike, errors: ArrayLike) -> NDArray[np.bool_]:
    """Which of N settings no other beats.

    A setting is beaten if another one is at least as cheap and at least as right, and strictly better in one of the two.
    Settings that tie in both stand or fall together; one whose cost or error is NaN is beaten.

    Parameters
    ----------
    costs, errors : (N,) array_like
        Less is better.
    """
    cost, error = np.asarray(costs, dtype=np.float64), np.asarray(errors, dtype=np.float64)
    known = ~(np.isnan(cost) | np.isnan(error))
    as_good = (cost[:, None] <= cost) & (error[:, None] <= error)
    better = (cost[:, None] < cost) | (error[:, None] < error)
    return np.asarray(known & ~(as_good & better & known[:, None]).any(axis=0))


def run_study(
    scene: Any,
    camera: PerspectiveCamera | None = None,
    lights: Sequence[Light] | None = None,
    size: tuple[int, int] = (1280, 720),
    grid: Grid | Iterable[Shadow] | None = None,
    repeats: int = 7,
    resume: str | os.PathLike[str] | None = None,
    progress: Progress | None = None,
    backend: str = "auto",
) -> Study:
    """Measure every setting of a grid, for every light that casts, for speed and for error.

    Each light is studied alone: its frames have no other. Settings that share a resolution and a target are timed round-robin with
    the floor, the light moving a little every round; then all are scored on the picture itself.

    Parameters
    ----------
    scene : Scene, or whatever `glshadow.load` takes
    camera, lights : optional
        The scene's own if None. What their shadows are set to does not matter; lights with `shadow=None` are left out.
    size : (2,) ints
        Width and height.
    grid : Grid or iterable of Shadow, optional
        None: Grid.default(scene).
    repeats : int
        Rounds that count, at least 1.
    resume : path, optional
        Results are appended there as they come (JSON lines), and those already there are not measured again.
    progress : callable, optional
        Called as progress(done, total, text).
    backend : str
        As in Renderer.

    Raises
    ------
    SettingsError
        For an empty grid, no light that casts, or a file that is not a journal.
    ReferenceUnavailable
        If embreex is not installed.
    """
    if not isinstance(scene, Scene):
        from glshadow.scene.load import load

        scene = load(scene)
    if isinstance(repeats, bool) or not isinstance(repeats, int) or repeats < 1:
        raise SettingsError(f"repeats must be an integer of at least 1, got {repeats!r}")
    casting = tuple(light for light in (scene.lights if lights is None else lights) if light.shadow is not None)
    if not casting:
        raise SettingsError("there is nothing to study: no light casts a shadow (Light.shadow is None)")
    start = time.perf_counter()
    settings = settings_of(Grid.default(scene) if grid is None else grid)
    with (
        Renderer(backend) as renderer,  # type: ignore[arg-type]  # Renderer itself says what is allowed
        Floor(renderer, scene, size, FLOOR_RESOLUTION) as floor,
    ):
        run = _Run(renderer, floor, scene, camera or scene.camera, size, settings, repeats, Journal(resume), progress)
        run.total = len(settings) * len(casting)
        results = [result for number, light in enumerate(casting) for result in run.light(number, light)]
    return Study(
        scene.name, sum(len(node.mesh.triangles) for node in scene.nodes), len(scene.nodes), size, run.camera,
        casting, tuple(results), run.machine, repeats, time.perf_counter() - start, run.panels,
    )  # fmt: skip


class _Run:
    """A study at work."""

    def __init__(
        self,
        renderer: Renderer,
        floor: Floor,
        scene: Scene,
        camera: PerspectiveCamera,
        size: tuple[int, int],
        settings: tuple[Shadow, ...],
        repeats: int,
        journal: Journal,
        progress: Progress | None,
    ) -> None:
        self.renderer, self.floor, self.scene, self.camera, self.size = renderer, floor, scene, camera, size
        self.settings, self.repeats, self.journal, self.progress = settings, repeats, journal, progress
        self.machine = machine(renderer.info)
        self.fingerprint = fingerprint(scene)
        self.panels: dict[str, Panel] = {}
        self.done = self.total = 0

    def light(self, number: int, light: Light) -> list[Result]:
        """Results of one light, in the order of the grid."""
        keys = {shadow: self._key(light, shadow) for shadow in self.settings}
        records = self.journal.records
        untimed = [shadow for shadow in self.settings if "times_ms" not in records.get(keys[shadow], {})]
        unscored = [shadow for shadow in self.settings if "error" not in records.get(keys[shadow], {})]
        self._say(f"light {number}: timing")
        self._time_all(number, light, untimed, keys)
        self.done += len(self.settings) - len(unscored)
        self._say(f"light {number}: tracing the truth")
        truth = RememberedTruth.of(trace(self.scene, self.camera, [light], self.size))
        for shadow in unscored:
            self._say(f"light {number}: {setting_name(shadow)}")
            frame, error = self._score(light, shadow, truth)
            used = {name: value for name, value in frame.used[0].as_dict().items() if name not in ("views", "draws")}
            used["texel"] = list(frame.used[0].texel or ())
            used["sampled"] = truth.sampled()
            self.journal.add({"key": keys[shadow], "error": plain_score(error.lights[0]), "used": used})
            self.done += 1
        self._say(f"light {number}: pictures")
        results = [Result.from_dict(records[keys[shadow]], number, shadow) for shadow in self.settings]
        self._picture(light, truth, results)
        return results

    def _key(self, light: Light, shadow: Shadow) -> str:
        bare = replace(light, shadow=None)
        return result_key(
            self.fingerprint, self.camera, bare, self.size, shadow, repr(sorted(self.machine.items())), self.repeats
        )

    def _frame(self, light: Light, *outputs: str) -> Frame:
        return self.renderer.render(self.scene, self.camera, [light], self.size, outputs=outputs)

    def _score(self, light: Light, shadow: Shadow, truth: RememberedTruth) -> tuple[Frame, ShadowError]:
        frame = self._frame(replace(light, shadow=shadow), "visibility")
        return frame, measure(frame, truth)  # type: ignore[arg-type]  # visibility was asked for

    def _time_all(self, number: int, light: Light, untimed: list[Shadow], keys: dict[Shadow, str]) -> None:
        """Milliseconds of settings and floors, into the journal."""
        moved = [replace(_moved(light, k, self.scene), shadow=Shadow()) for k in range(-WARM_UP, self.repeats)]
        # what the floor needs of a frame, made before the clock runs: it would change the map's size between two settings
        plain = [replace(self._frame(each, "image"), image=None) for each in moved] if untimed else []
        for _, group in groupby(sorted(untimed, key=_map_of), key=_map_of):
            chosen = list(group)
            self._say(f"light {number}: timing {chosen[0].resolution}")
            times = self._time(moved, plain, chosen)
            for shadow in chosen:
                facts = {"light": number, "setting": setting_name(shadow), "times_ms": times[shadow], "floors_ms": times[None]}
                self.journal.add({"key": keys[shadow], **facts})

    def _time(
        self, moved: list[Light], plain: list[Frame], chosen: list[Shadow]
    ) -> dict[Shadow | None, list[float]]:
        """Milliseconds of each setting and, as None, of the floor, round-robin."""
        times: dict[Shadow | None, list[float]] = {None: [], **{shadow: [] for shadow in chosen}}
        for k, (light, frame) in enumerate(zip(moved, plain, strict=True)):
            for shadow in times:
                start = time.perf_counter()
                if shadow is None:
                    self.floor.draw(frame)
                else:
                    self._frame(replace(light, shadow=shadow), "image")
                if k >= WARM_UP:
                    times[shadow].append(1e3 * (time.perf_counter() - start))
        return times

    def _picture(self, light: Light, truth: RememberedTruth, results: list[Result]) -> None:
        best = pareto_front([r.cost for r in results], [r.score.wrong for r in results])
        for result, keep in zip(results, best, strict=True):
            if keep or result.shadow == Shadow():
                frame, error = self._score(light, result.shadow, truth)
                self.panels[result.key] = panel(self.renderer, frame, truth, error)

    def _say(self, text: str) -> None:
        if self.progress is not None:
            self.progress(self.done, self.total, text)


def _map_of(shadow: Shadow) -> tuple[int, str]:
    """Settings that are timed together: those that share a map, which is not allocated anew between them."""
    return shadow.resolution, shadow.target.value if shadow.target else ""


def _moved(light: Light, k: int, scene: Scene) -> Light:
    """The light at round k."""
    if isinstance(light, DirectionalLight):
        (x, y, z), (cosine, sine) = light.direction, (np.cos(STEP_RAD * k), np.sin(STEP_RAD * k))
        return replace(light, direction=(x * cosine - z * sine, y, x * sine + z * cosine))
    low, high = scene.bounds
    step = 0.1 * STEP_RAD * k * float(np.linalg.norm(high - low))
    return replace(light, position=(light.position[0], light.position[1] + step, light.position[2]))
