"""Budget: chooses the settings of lights that leave them to be derived, by what an image may cost or get wrong."""

from __future__ import annotations

import time
import weakref
from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from glshadow.core.setting import Settings, number, optional, setting
from glshadow.core.spaces import Bools
from glshadow.frame import Frame
from glshadow.lights import Light
from glshadow.scene.nodes import Scene
from glshadow.scoring.error import LEAST_COSINE, WRONG, smooth_pixels
from glshadow.shadows.filters import Exact, Filter, Gaussian, Hard, Pcf
from glshadow.shadows.shadow import Shadow

FILTERS: tuple[Filter, ...] = (Hard(), Pcf(0), Pcf(1), Gaussian(2))
RESOLUTIONS = (512, 1024, 2048, 4096)
FRAMES = 3  # frames per setting in each round of timing
_CLEARLY = 1.5  # a setting this many times slower than the fastest is timed in one round only

Draw = Callable[[Sequence[Light], tuple[str, ...]], Frame]
"""(lights, outputs) -> the frame with them."""


@dataclass(frozen=True)
class Budget(Settings):
    """How much of an image may be wrong, and how long it may take.

    Parameters
    ----------
    max_wrong : float, optional
        Share of the counted pixels that may be wrong, as in `gs.measure`; for every light.
    max_ms : float, optional
        Milliseconds for an image including its shadow maps, on this machine.
    """

    max_wrong: float | None = setting(optional(number(0.0, 1.0, below=True), "no limit"), None)
    max_ms: float | None = setting(optional(number(0.0, above=True), "no limit"), None)

    @property
    def given(self) -> bool:
        """Whether a limit is set."""
        return self.max_wrong is not None or self.max_ms is not None


@dataclass(frozen=True)
class Found:
    """A setting that was tried, with its measurements.

    Parameters
    ----------
    wrong : float
        Error rate of the worst light.
    ms : float
        Time of a frame that draws everything; infinite if it was not timed.
    """

    shadow: Shadow
    wrong: float
    ms: float = np.inf

    def __str__(self) -> str:
        size = f" at {self.shadow.resolution}" if self.shadow.resolution else ""
        return f"{self.shadow.filter}{size}: {self.wrong:.3%} wrong, {self.ms:.1f} ms"


def open_to_choice(light: Light) -> bool:
    """Whether a light's settings are left to be derived."""
    shadow = light.shadow
    return (
        shadow is not None and shadow.filter is None and shadow.channel is None and shadow.resolved().filter == Exact()
    )


def choose(draw: Draw, lights: Sequence[Light], budget: Budget) -> tuple[Found, str]:
    """The cheapest setting within a budget for all lights whose settings are derived, and which limit cannot be met.

    Errors are found by comparison with `Exact()`, which has no parameters and is off by a handful of pixels: no ray is traced. Each
    filter tries increasing resolutions until it is accurate enough. Those that are, and `Exact()` itself, are timed with moving lights,
    and the cheapest wins. Without `max_wrong`, the most accurate one that is fast enough wins.

    Returns
    -------
    Found, str
        The setting, and why it misses the budget; empty if it does not.
    """
    exact = Shadow(filter=Exact())
    truth = draw(with_setting(lights, exact), ("visibility", "normal", "position", "node"))
    counted = _counted(truth, lights)
    good: list[Found] = [Found(exact, 0.0)]
    allowed = budget.max_wrong if budget.max_wrong is not None else -1.0
    for kind in FILTERS:
        for resolution in RESOLUTIONS:
            shadow = Shadow(filter=kind, resolution=resolution)
            found = Found(shadow, _wrong(draw(with_setting(lights, shadow), ("visibility",)), truth, counted))
            if budget.max_wrong is None or found.wrong <= allowed:
                good.append(found)
            if found.wrong <= allowed:
                break
    timed = _time(draw, lights, good)
    if budget.max_ms is None:
        return min(timed, key=lambda each: each.ms), ""
    fast = [each for each in timed if each.ms <= budget.max_ms]
    if fast:
        return min(
            fast, key=lambda each: (each.wrong, each.ms) if budget.max_wrong is None else (each.ms, each.wrong)
        ), ""
    best = min(timed, key=lambda each: each.ms)
    return (
        best,
        f"max_ms={budget.max_ms:g} is not met by any setting that was tried: the fastest takes {best.ms:.1f} ms",
    )


def with_setting(lights: Sequence[Light], shadow: Shadow) -> tuple[Light, ...]:
    """The lights with a setting in place of derived ones; they keep their strength."""
    return tuple(
        replace(each, shadow=replace(shadow, strength=each.shadow.strength))
        if each.shadow is not None and open_to_choice(each)
        else each
        for each in lights
    )


class Choices:
    """Chosen settings by scene, size and the lights' kinds and settings: found for the first such image, and cached."""

    def __init__(self) -> None:
        self._found: weakref.WeakKeyDictionary[Scene, dict[Hashable, tuple[Found, str]]] = weakref.WeakKeyDictionary()

    def of(self, scene: Scene) -> tuple[tuple[Found, str], ...]:
        """The choices for a scene, oldest first."""
        return tuple(self._found.get(scene, {}).values())

    def render(
        self,
        draw: Draw,
        last: Draw,
        scene: Scene,
        lights: tuple[Light, ...],
        size: tuple[int, int],
        budget: Budget,
        outputs: tuple[str, ...],
    ) -> Frame:
        """The frame with the chosen settings, drawn by `last`; `used` has the reason. `draw` draws the candidates."""
        if not any(map(open_to_choice, lights)):
            return last(lights, outputs)
        kept = self._found.setdefault(scene, {})
        key = (budget, size, tuple((type(light), light.has_size, light.shadow) for light in lights))
        if key not in kept:
            kept[key] = choose(draw, lights, budget)
        found, missed = kept[key]
        frame = last(with_setting(lights, found.shadow), outputs)
        why = f"the cheapest within {budget}: {found}"
        used = tuple(
            replace(each, why=why, fallbacks=each.fallbacks + ((missed,) if missed else ()))
            if open_to_choice(light)
            else each
            for light, each in zip(lights, frame.used, strict=True)
        )
        return replace(frame, used=used)


def _counted(frame: Frame, lights: Sequence[Light]) -> list[Bools]:
    """For each light the valid-pixel mask (H, W), as in `measure`."""
    smooth = smooth_pixels(frame.node, np.nan_to_num(frame.normal.astype(np.float64)))
    seen = frame.node >= 0
    points = np.nan_to_num(frame.position)
    masks = []
    for light in lights:
        towards, _ = light.to_light(points)
        mask = smooth & seen & (np.einsum("ijk,ijk->ij", np.nan_to_num(frame.normal), towards) > LEAST_COSINE)
        mask &= light.reaches(points)
        masks.append(mask if open_to_choice(light) else np.zeros_like(mask))
    return masks


def _wrong(frame: Frame, truth: Frame, counted: Sequence[Bools]) -> float:
    """Error rate of the worst light."""
    shares = [
        float((np.abs(ours - exact)[mask] > WRONG).mean())
        for ours, exact, mask in zip(frame.visibility, truth.visibility, counted, strict=True)
        if mask.any()
    ]
    return max(shares, default=0.0)


def times_of(
    draw: Draw, lights: Sequence[Light], shadows: Sequence[Shadow], rounds: int, first: int = 0
) -> list[list[float]]:
    """Seconds of frames with each setting. The lights move, so that everything is drawn.

    Settings take turns with several frames each. The first frame of a turn allocates what the last setting did not need; it is not timed.

    Parameters
    ----------
    rounds : int
        Number of turns, of `FRAMES` frames each.
    first : int
        How many times the lights have moved before.
    """
    times: list[list[float]] = [[] for _ in shadows]
    for _ in range(rounds):
        for number_, shadow in enumerate(shadows):
            for k in range(1 + FRAMES):
                first += 1
                moved = [_moved(light, first) for light in lights]
                start = time.perf_counter()
                draw(with_setting(moved, shadow), ("image",))
                if k > 0:
                    times[number_].append(time.perf_counter() - start)
    return times


def _time(draw: Draw, lights: Sequence[Light], found: Sequence[Found]) -> list[Found]:
    """The same settings with their median times. A setting much slower than another is timed once, the others again."""
    times = times_of(draw, lights, [each.shadow for each in found], 1)
    best = min(map(np.median, times))
    again = [i for i, taken in enumerate(times) if np.median(taken) <= _CLEARLY * best]
    more = times_of(draw, lights, [found[i].shadow for i in again], 2, len(found) * (1 + FRAMES))
    for i, taken in zip(again, more, strict=True):
        times[i] += taken
    return [replace(each, ms=1e3 * float(np.median(taken))) for each, taken in zip(found, times, strict=True)]


def _moved(light: Light, step: int) -> Light:
    """The light moved by `step` millionths."""
    size = float(np.linalg.norm(light.place[:3])) or 1.0
    return light.nudged(1e-6 * step, 1e-6 * step * size)
