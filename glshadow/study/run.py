"""Measures one image: settings of one light are timed and scored, with results in the journal.

Speed is a ratio, a setting's frame time over the floor of the same round (see `floor`): absolute times on a shared machine drift
by more than settings differ. Error is `glshadow.scoring` against one traced reference per light.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from itertools import groupby
from typing import Any

import numpy as np

from glshadow.arguments import DEFAULT_SIZE, as_scene, frame_arguments
from glshadow.core.cameras import Camera
from glshadow.core.setting import as_path, optional, refuse, whole
from glshadow.errors import SettingsError
from glshadow.frame import Frame
from glshadow.gl.driver.context import Backend
from glshadow.inline import notebook_bar
from glshadow.journal import Journal
from glshadow.lights import Light, Lights, traced_points
from glshadow.reference.trace import trace
from glshadow.renderer import Renderer
from glshadow.scene.nodes import Scene
from glshadow.scoring.error import Measurement, measure
from glshadow.scoring.score import Score
from glshadow.shadows.filters import Pcf
from glshadow.shadows.shadow import Shadow
from glshadow.study.fingerprint import fingerprint, result_key
from glshadow.study.floor import FLOOR_RESOLUTION, Floor
from glshadow.study.grid import setting_name
from glshadow.study.machine import machine
from glshadow.study.pictures import Panel, panel
from glshadow.study.remembered import RememberedTruth
from glshadow.study.result import Result, plain_score, score_from

Progress = Callable[[int, int, str], None]

MOST_REPEATS = 10_000
WARM_UP = 2  # rounds that are not counted: the first one allocates and compiles
STEP_RAD = 2e-3  # tilt of a directional light per round, so that nothing cached from the last round is valid


@contextmanager
def open_run(
    scene: Any,
    camera: Camera | None = None,
    lights: Lights = None,
    size: tuple[int, int] = DEFAULT_SIZE,
    repeats: int = 7,
    resume: str | os.PathLike[str] | None = None,
    progress: Progress | None = None,
    backend: Backend = "auto",
) -> Iterator[Run]:
    """A run with its own renderer; parameters and errors as for `run_study`."""
    scene = as_scene(scene, usual="plain")
    camera, lights, size = frame_arguments(scene, camera, lights, size)
    repeats, resume = (
        whole(1, MOST_REPEATS)("repeats", repeats),
        optional(as_path, "nothing is stored")("resume", resume),
    )
    if progress is not None and not callable(progress):
        raise refuse("progress", "a function of (done, total, text) or None", progress)
    casting = tuple(light for light in lights if light.shadow is not None)
    if not casting:
        raise SettingsError("there is nothing to study: no light casts a shadow (Light.shadow is None)")
    journal, bar = Journal(resume), notebook_bar() if progress is None else None
    with (
        Renderer(backend) as renderer,
        Floor(renderer, scene, size, FLOOR_RESOLUTION) as floor,
    ):
        try:
            yield Run(renderer, floor, scene, camera, casting, size, repeats, journal, bar or progress)
        finally:
            if bar is not None:
                bar.close()


class Run:
    """Measures settings of the lights of one image; results in the journal are not measured again.

    `done` and `total` count settings for the progress display; the caller sets `total`.
    """

    def __init__(
        self,
        renderer: Renderer,
        floor: Floor,
        scene: Scene,
        camera: Camera,
        lights: tuple[Light, ...],
        size: tuple[int, int],
        repeats: int,
        journal: Journal,
        progress: Progress | None,
    ) -> None:
        self.renderer, self.floor, self.scene, self.camera, self.size = renderer, floor, scene, camera, size
        self.lights, self.repeats, self.journal, self.progress = lights, repeats, journal, progress
        self.machine = machine(renderer.info)
        self._fingerprint = fingerprint(scene)
        self._truths: dict[int, RememberedTruth] = {}
        self.done = self.total = 0

    def time(self, number: int, settings: Sequence[Shadow]) -> None:
        """Measure milliseconds of a light's settings and of the floor, and add them to the journal.

        Settings that share a map are timed round-robin with the floor, the light moving a little every round.
        """
        untimed = [shadow for shadow in settings if "times_ms" not in self._record(number, shadow)]
        if not untimed:
            return
        light = self.lights[number]
        self._say(f"light {number}: timing")
        moved = [
            replace(_moved(light, k, self.scene), shadow=Shadow(filter=Pcf())) for k in range(-WARM_UP, self.repeats)
        ]
        # the floor's inputs, made before timing starts: making them would change the map's size between two settings
        plain = [replace(self._frame(each, "image"), outputs={}) for each in moved]
        for _, group in groupby(sorted(untimed, key=_map_of), key=_map_of):
            chosen = list(group)
            self._say(f"light {number}: timing {chosen[0].resolved().resolution}")
            times = self._time(moved, plain, chosen)
            for shadow in chosen:
                facts = {"light": number, "setting": setting_name(shadow), "times_ms": times[shadow]}
                self.journal.add({"key": self._key(number, shadow), **facts, "floors_ms": times[None]})

    def score(self, number: int, settings: Sequence[Shadow]) -> list[Score]:
        """Errors of a light's settings on the image itself, in order; also added to the journal."""
        unscored = [shadow for shadow in settings if "error" not in self._record(number, shadow)]
        self.done += len(settings) - len(unscored)
        for shadow in unscored:
            truth = self.truth(number)
            self._say(f"light {number}: {setting_name(shadow)}")
            frame, error = self._measured(number, shadow)
            used = {name: value for name, value in frame.used[0].as_dict().items() if name not in ("views", "draws")}
            used["texel"] = list(frame.used[0].texel or ())
            used["sampled"] = truth.sampled()
            self.journal.add({"key": self._key(number, shadow), "error": plain_score(error.lights[0]), "used": used})
            self.done += 1
        return [score_from(self._record(number, shadow)) for shadow in settings]

    def result(self, number: int, shadow: Shadow) -> Result:
        """The stored result of a setting that was timed and scored."""
        return Result.from_dict(self._record(number, shadow), number, shadow)

    def panel(self, number: int, shadow: Shadow) -> Panel:
        """Images of a setting."""
        frame, error = self._measured(number, shadow)
        return panel(self.renderer, frame, self.truth(number), error)

    def truth(self, number: int) -> RememberedTruth:
        """The reference of one light, traced on first use."""
        if number not in self._truths:
            self._say(f"light {number}: tracing the reference")
            light = self.lights[number]
            points = traced_points([light])
            truth = trace(self.scene, self.camera, [light], self.size, light_samples=points, samples=1)
            self._truths[number] = RememberedTruth.of(truth)
        return self._truths[number]

    def forget_truth(self, number: int) -> None:
        """Free the reference's memory, about 60 MB at 1280 x 720."""
        self._truths.pop(number, None)

    def _key(self, number: int, shadow: Shadow) -> str:
        bare = replace(self.lights[number], shadow=None)
        return result_key(
            self._fingerprint, self.camera, bare, self.size, shadow, repr(sorted(self.machine.items())), self.repeats
        )

    def _record(self, number: int, shadow: Shadow) -> dict[str, Any]:
        return self.journal.records.get(self._key(number, shadow), {})

    def _frame(self, light: Light, *outputs: str) -> Frame:
        return self.renderer.render(self.scene, self.camera, [light], self.size, outputs=outputs, samples=1)

    def _measured(self, number: int, shadow: Shadow) -> tuple[Frame, Measurement]:
        frame = self._frame(replace(self.lights[number], shadow=shadow), "visibility", "triangle")
        return frame, measure(frame, self.truth(number))

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

    def _say(self, text: str) -> None:
        if self.progress is not None:
            self.progress(self.done, self.total, text)


def _map_of(shadow: Shadow) -> tuple[int, str, str, str]:
    """Key of settings that are timed together: they share a map, so that it is not allocated again between them."""
    resolved = shadow.resolved()
    own = str(resolved.filter) if resolved.filter.encoding else ""  # also means
    return resolved.resolution, shadow.target.value if shadow.target else "", str(resolved.fit), own


def _moved(light: Light, k: int, scene: Scene) -> Light:
    """The light in round k."""
    low, high = scene.extent
    return light.nudged(STEP_RAD * k, 0.1 * STEP_RAD * k * float(np.linalg.norm(high - low)))
