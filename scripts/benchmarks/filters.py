"""Every filter against a hard comparison: time of a frame with a cached map, of one with a moving light, and error against traced rays.

Also the cost of prefiltering (filling a moment map, blurring it), and the composed shaders against hand-written ones in a
single file (by_hand.frag). Medians of alternating rounds in one process; ratios inside each round.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import click
import numpy as np
from frame import SIZE, plain, turned_sun
from sections import Scenes, command

import glshadow as gs
from glshadow.gl.driver.program import Program
from glshadow.shader.compose import Text, compose
from glshadow.shadows.filters import FILTERS
from scripts.pages.techniques import tried

HAND = Path(__file__).with_name("by_hand.frag")
KERNELS: dict[str, tuple[gs.Filter, dict[str, str]]] = {
    "hard": (gs.Hard(), {"KERNEL": "0", "SLACK": "0.5"}),
    "pcf:1": (gs.Pcf(1), {"KERNEL": "1", "R": "1", "SUM": "9.0", "SLACK": "1.0"}),
    "pcf:4": (gs.Pcf(4), {"KERNEL": "1", "R": "4", "SUM": "81.0", "SLACK": "1.0"}),
    "gaussian:2": (gs.Gaussian(2), {"KERNEL": "2", "R": "2", "SUM": "144.0", "SLACK": "1.0"}),
    "disc:2,16": (gs.Disc(), {"KERNEL": "3", "SLACK": "1.0"}),
    "vsm:1": (gs.Vsm(), {"KERNEL": "4", "SLACK": "0.0"}),
}


def alternated(jobs: dict[str, Callable[[float], Any]], rounds: int) -> dict[str, np.ndarray]:
    """Seconds of each job in each round."""
    times: dict[str, list[float]] = {name: [] for name in jobs}
    for k in range(-2, rounds):
        for number, (name, job) in enumerate(jobs.items()):
            start = time.perf_counter()
            job(k + number / len(jobs))  # a different light each: nothing of one job is cached for the next
            if k >= 0:
                times[name].append(time.perf_counter() - start)
    return {name: np.array(values) for name, values in times.items()}


def settings() -> dict[str, gs.Shadow]:
    """The settings to compare: every technique, with and without a shadow map."""
    kinds = [each for kind in FILTERS for each in tried(kind)]
    return {str(each): gs.Shadow(filter=each) for each in dict.fromkeys(kinds)}


def moved(scene: gs.Scene, shadows: dict[str, gs.Shadow], rounds: int) -> dict[str, np.ndarray]:
    """Seconds of frames with a moving light; each setting has its own renderer, so that its maps stay allocated."""
    with ExitStack() as stack:
        renderers = {name: stack.enter_context(gs.Renderer()) for name in shadows}
        jobs: dict[str, Callable[[float], Any]] = {
            name: lambda k, n=name: renderers[n].render(
                scene, None, [turned_sun(scene, k, shadows[n])], SIZE, outputs=("image",), samples=1
            )
            for name in shadows
        }
        return alternated(jobs, rounds)


def measure_filters(scenes: Scenes, rounds: int, _folder: Path | None) -> dict[str, Any]:
    """Time over the hard filter, and error."""
    results: dict[str, Any] = {}
    for name, make in [each for each in scenes if each[0] == "courtyard"]:
        scene = make()
        shadows = settings()
        truth = gs.trace(scene, None, [turned_sun(scene, 0, gs.Shadow())], SIZE, samples=1)
        row = results[name] = {}
        with gs.Renderer() as renderer:
            for text, shadow in shadows.items():
                light = turned_sun(scene, 0, shadow)
                renderer.render(scene, None, [light], SIZE, outputs=("image",), samples=1)  # fills the caches
                taken = []
                for _ in range(rounds):
                    start = time.perf_counter()
                    renderer.render(scene, None, [light], SIZE, outputs=("image",), samples=1)
                    taken.append(time.perf_counter() - start)
                error = gs.measure(renderer.render(scene, None, [light], SIZE, samples=1), truth)
                kinds = ("wrong", "acne", "leak", "grain")
                row[text] = {"kept": float(np.median(taken)), **{kind: getattr(error, kind) for kind in kinds}}
        moving = moved(scene, shadows, rounds)
        hard = row["hard"]["kept"]
        click.echo(f"{name:24s} kept / hard  moving / hard   wrong %   acne %   leak %  grain %")
        for text, each in row.items():
            each["moving"] = float(np.median(moving[text] / moving["hard"]))
            each["kept"] /= hard
            errors = " ".join(f"{100 * each[kind]:8.4f}" for kind in ("wrong", "acne", "leak", "grain"))
            click.echo(f"{text:24s} {each['kept']:11.2f} {each['moving']:14.2f}  {errors}", nl=True)
    return results


def measure_means(scenes: Scenes, rounds: int, _folder: Path | None) -> dict[str, Any]:
    """Time to fill and blur a prefiltered map of 2048, over a hard frame with a moving light."""
    scene, kinds = scenes[0][1](), (gs.Esm, gs.Vsm, gs.Evsm, gs.Msm)
    shadows = {"hard": gs.Shadow(filter=gs.Hard())}
    shadows |= {f"{kind.__name__} {radius}": gs.Shadow(filter=kind(radius)) for kind in kinds for radius in (0, 1, 4)}
    times = moved(scene, shadows, rounds)
    hard = times["hard"]
    found = {name: float(np.median(each / hard)) for name, each in times.items()}
    click.echo("over a hard frame: filling the map and sampling it; blurring it over 3 x 3, over 9 x 9")
    for kind in kinds:
        name = kind.__name__
        fill, narrow, wide = (found[f"{name} {radius}"] for radius in (0, 1, 4))
        click.echo(f"{name:8s} fill and sample {fill - 1.0:5.2f}  blur {narrow - fill:5.2f}  {wide - fill:5.2f}")
    return found


def write_by_hand(renderer: gs.Renderer, defines: dict[str, str]) -> None:
    """Replace a renderer's resolve pass by one whose fragment stage is by_hand.frag."""
    programs = renderer._programs
    composed, made = programs.get, []

    def get(vertex: str, fragment: str, *given: Any, **named: Any) -> Program:
        if fragment != "pass/resolve.frag":
            return composed(vertex, fragment, *given, **named)
        if not made:
            lines = HAND.read_text(encoding="utf-8").split("\n")
            depth = "vec3" if defines["KERNEL"] == "4" else "float"
            values = [f"#define {key} {value}" for key, value in {**defines, "DEPTH": depth}.items()]
            code = "\n".join([*lines[:2], *values, *lines[2:]])
            text = Text(code, ((HAND.name, 1),), (HAND.name, HAND.name), frozenset())
            made.append(Program(renderer._context, compose(vertex, "core330", {}, {}), text))
        return made[0]

    programs.get = get  # type: ignore[method-assign]


def measure_hand(scenes: Scenes, rounds: int, _folder: Path | None) -> dict[str, Any]:
    """The composed resolve pass over the hand-written one, both with a cached map."""
    scene, results = plain(scenes[0][1]()), {}  # flat surfaces, as in by_hand.frag
    for name, (kind, defines) in KERNELS.items():
        light = turned_sun(scene, 0, gs.Shadow(filter=kind, fit=gs.SceneFit()))
        with gs.Renderer() as ours, gs.Renderer() as hand:
            write_by_hand(hand, defines)
            frames: dict[str, gs.Frame] = {}
            times: dict[str, list[float]] = {"ours": [], "hand": []}
            for k in range(-2, rounds):
                for which, renderer in (("ours", ours), ("hand", hand)):
                    frame = frames[which] = renderer.render(
                        scene, None, [light], SIZE, outputs=("image", "timings"), samples=1
                    )
                    if k >= 0:
                        times[which].append(frame.timings["resolve"])
        gap = np.abs(frames["ours"].image.astype(int) - frames["hand"].image).max(axis=-1)
        ratio = float(np.median(np.array(times["ours"]) / np.array(times["hand"])))
        results[name] = {"ratio": ratio, "differing": float((gap > 2).mean())}
        click.echo(
            f"{name:12s} composed over hand-written {ratio:5.2f}; {100 * (gap > 2).mean():.3f} % of the pixels differ"
        )
    return results


main = command(__doc__, {"filters": measure_filters, "means": measure_means, "hand": measure_hand})

if __name__ == "__main__":
    main()
