"""A grid of shadow settings, each measured for speed and for error in one run.

Speed is a ratio: a setting's frame time over the floor of the same round (see `floor`), since absolute times on a shared machine drift
by more than settings differ. Error is `glshadow.measure` against one trace per light.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from itertools import groupby
from typing import Any

import numpy as np

from glshadow.core.cameras import PerspectiveCamera
from glshadow.core.lights import DirectionalLight, Light
from glshadow.core.shadow import Shadow
from glshadow.errors import SettingsError
from glshadow.frame import Frame
from glshadow.measure.error import ShadowError, measure
from glshadow.reference.trace import trace
from glshadow.renderer import Renderer
from glshadow.scene.mesh import Scene
from glshadow.study.floor import Floor
from glshadow.study.grid import Grid, setting_name, settings_of
from glshadow.study.journal import Journal, fingerprint, result_key
from glshadow.study.machine import machine
from glshadow.study.pictures import Panel, panel
from glshadow.study.remembered import RememberedTruth
from glshadow.study.result import Result, Study, pareto_front, plain_score

Progress = Callable[[int, int, str], None]

WARM_UP = 2  # rounds that are not counted: the first one allocates and compiles
FLOOR_RESOLUTION = 2048  # one floor for all settings, so that their ratios compare
STEP_RAD = 2e-3  # per round a sun turns by this: nothing that was drawn for the last one serves the next


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
                facts = {
                    "light": number,
                    "setting": setting_name(shadow),
                    "times_ms": times[shadow],
                    "floors_ms": times[None],
                }
                self.journal.add({"key": keys[shadow], **facts})

    def _time(self, moved: list[Light], plain: list[Frame], chosen: list[Shadow]) -> dict[Shadow | None, list[float]]:
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
