"""All techniques on five scenes: time over a hard frame against wrong pixels, a plot of all, and the best for each budget.

Courtyard, chess board, bridge garden, terrain and outdoors; one moving directional light; 960 x 540; wrong pixels against traced rays,
or grainy ones if these are more.
"""

from __future__ import annotations

import json
import time
import warnings
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import click
import numpy as np
from filters import alternated
from frame import models_in, turned_sun

import glshadow as gs
from glshadow.shadows.filters import FILTERS
from glshadow.study import pareto_front
from scripts.pages.techniques import tried

SIZE = (960, 540)
BUDGETS = (0.01, 0.003, 0.001, 0.0003)
FAMILIES = {
    "shadow map": "#3b6fb6", "prefiltered shadow map": "#c2571a", "several maps, or one with perspective": "#4c9a2a",
    "tests against triangles": "#8a2a8a",
}  # fmt: skip


def settings() -> dict[str, tuple[str, gs.Shadow]]:
    """Name -> (family, setting)."""
    found: dict[str, tuple[str, gs.Shadow]] = {}
    for kind in dict.fromkeys(each for family in FILTERS for each in tried(family)):
        family = (
            "tests against triangles"
            if not kind.has_map
            else "prefiltered shadow map"
            if kind.encoding
            else "shadow map"
        )
        found[str(kind)] = family, gs.Shadow(filter=kind)
    for resolution in (512, 1024, 4096):
        for kind in (gs.Hard(), gs.Pcf(1)):
            found[f"{kind} {resolution}"] = "shadow map", gs.Shadow(filter=kind, resolution=resolution)
    for fit in (gs.Lispsm(), gs.Cascades(2), gs.Cascades(4)):
        found[f"pcf:1 {fit.spelling}{getattr(fit, 'count', '')}"] = (
            "several maps, or one with perspective", gs.Shadow(filter=gs.Pcf(1), fit=fit),
        )  # fmt: skip
    return found


def scenes(folder: Path | None) -> dict[str, Callable[[], gs.Scene]]:
    """Scenes by name."""
    found: dict[str, Callable[[], gs.Scene]] = {"courtyard": gs.scenes.courtyard, "outdoors": gs.scenes.outdoors}
    if folder:
        found["chess board"] = lambda: gs.load(folder / "chess_board.glb", ground=True, look="plain")
        found["bridge garden"] = lambda: gs.load(folder / "japanese_bridge_garden.glb", ground=True, look="plain")
        found["terrain"] = lambda: gs.load(folder / "terrain_jacksboro.ply", up_axis="z", look="plain")
    return found


def sun_of(scene: gs.Scene, k: float, shadow: gs.Shadow) -> gs.DirectionalLight:
    """The scene's directional light at time k; low above terrain, so that it casts shadows."""
    light = turned_sun(scene, k, shadow)
    return (
        replace(light, direction=(light.direction[0], -0.25, light.direction[2])) if "terrain" in scene.name else light
    )


def measure(scene: gs.Scene, rounds: int) -> dict[str, dict[str, float]]:
    """Time over hard and error of each setting."""
    chosen = {name: shadow for name, (_, shadow) in settings().items()}
    truth = gs.trace(scene, None, [sun_of(scene, 0, gs.Shadow())], SIZE, samples=1)
    results: dict[str, dict[str, float]] = {}
    hard: list[float] = []
    for name, shadow in chosen.items():
        # each next to a hard frame, in renderers of their own: caches of one are not rebuilt for the other
        with gs.Renderer() as ours, gs.Renderer() as other:
            times = alternated(
                {
                    "hard": lambda k, r=other: r.render(
                        scene, None, [sun_of(scene, k, chosen["hard"])], SIZE, outputs=("image",), samples=1
                    ),
                    "it": lambda k, r=ours, s=shadow: r.render(
                        scene, None, [sun_of(scene, k, s)], SIZE, outputs=("image",), samples=1
                    ),
                },
                rounds,
            )
            frame = ours.render(
                scene, None, [sun_of(scene, 0, shadow)], SIZE, outputs=("visibility", "triangle"), samples=1
            )
        error = gs.measure(frame, truth)
        hard += times["hard"].tolist()
        results[name] = {"time": float(np.median(times["it"] / times["hard"])), "error": max(error.wrong, error.grain)}
    return results


def plot(results: dict[str, dict[str, dict[str, float]]], path: Path) -> None:
    """Draw one panel per scene."""
    import matplotlib as mpl

    mpl.use("Agg")
    import matplotlib.pyplot as plt

    families = {name: family for name, (family, _) in settings().items()}
    figure, axes = plt.subplots(1, len(results), figsize=(4.2 * len(results), 4.6), layout="constrained")
    for axis, (scene, rows) in zip(np.atleast_1d(axes), results.items(), strict=True):
        least = 3e-6
        for name, row in rows.items():
            x, y = row["time"], 100.0 * max(row["error"], least)
            axis.scatter([x], [y], s=22, color=FAMILIES[families[name]], edgecolor="white", linewidth=0.5, zorder=3)
        names = list(rows)
        front = pareto_front([rows[n]["time"] for n in names], [rows[n]["error"] for n in names])
        best = sorted(
            (rows[n]["time"], 100.0 * max(rows[n]["error"], least), n) for n, on in zip(names, front, strict=True) if on
        )
        axis.step(
            [x for x, _, _ in best] + [8.0],
            [y for _, y, _ in best] + [best[-1][1]],
            where="post",
            color="#555",
            linewidth=0.8,
        )
        for x, y, name in best:
            axis.annotate(name, (x, y), (4, 4), textcoords="offset points", fontsize=7)
        axis.set(xscale="log", yscale="log", xlim=(0.5, 8.5), title=scene, xlabel="time / hard")
        axis.set_xticks([0.5, 1, 2, 4, 8], ["0.5", "1", "2", "4", "8"])
        axis.minorticks_off()
        axis.grid(color="#e8eaed", zorder=0)
    np.atleast_1d(axes)[0].set_ylabel("wrong, or grainy if more, %")
    handles = [
        mpl.lines.Line2D([], [], marker="o", linestyle="", color=color, label=name) for name, color in FAMILIES.items()
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=4, frameon=False, fontsize=9)
    figure.savefig(path, dpi=110)


@click.command(help=__doc__)
@click.option("--models", "folder", type=click.Path(exists=True, path_type=Path), help="Folder of the 12 models.")
@click.option("--repeats", default=5, show_default=True, help="Rounds of the timing.")
@click.option("--json", "output", type=click.Path(path_type=Path), help="Write all figures there.")
@click.option("--plot", "picture", type=click.Path(path_type=Path), help="Draw them there.")
@click.option(
    "--from",
    "stored",
    type=click.Path(exists=True, path_type=Path),
    help="Measure nothing; use the figures of an earlier --json.",
)
def main(folder: Path | None, repeats: int, output: Path | None, picture: Path | None, stored: Path | None) -> None:
    warnings.simplefilter("ignore", gs.GlshadowWarning)
    results: dict[str, dict[str, dict[str, float]]] = json.loads(stored.read_text()) if stored else {}
    if not stored:
        for name, make in scenes(models_in(folder)).items():
            start = time.perf_counter()
            results[name] = measure(make(), repeats)
            click.echo(f"{name}: {time.perf_counter() - start:.0f} s", err=True)
    for name, rows in results.items():
        for budget in BUDGETS:
            meeting: dict[str, Any] = {each: row for each, row in rows.items() if row["error"] <= budget}
            if meeting:
                best = min(meeting, key=lambda each: meeting[each]["time"])
                click.echo(
                    f"{name:14s} at most {100 * budget:5.2f} % wrong: {best} ({meeting[best]['time']:.2f} x hard)"
                )
    if output:
        output.write_text(json.dumps(results, indent=1) + "\n")
    if picture:
        plot(results, picture)


if __name__ == "__main__":
    main()
