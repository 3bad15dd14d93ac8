"""Budgets on untuned scenes: the settings that `max_wrong` chooses, against traced rays and the best setting of the whole grid.

Each model on a ground under a directional, a spot and a point light; three budgets. Accuracy: measured wrong pixels at most 1.2 x the
budget. Cost: time of an image with the chosen settings over that of the cheapest of all settings within the budget, timed in turn.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import click
import numpy as np
from sections import Scenes, command

import glshadow as gs
from glshadow.budget import FILTERS, RESOLUTIONS, times_of

SIZE = (640, 360)
BUDGETS = (0.0005, 0.002, 0.01)


def lights_of(scene: gs.Scene) -> dict[str, gs.Light]:
    """A directional, a spot and a point light above a scene."""
    low, high = scene.bounds
    middle, size = 0.5 * (low + high), float(np.linalg.norm(high - low))
    place = middle + size * np.array([0.25, 0.45, 0.2])
    there = tuple(place.tolist())
    return {
        "sun": gs.DirectionalLight(),
        "spot": gs.SpotLight(
            position=there, direction=tuple((middle - place).tolist()), outer_angle=50.0, inner_angle=45.0
        ),
        "point": gs.PointLight(position=there),
    }


def measure_budgets(scenes: Scenes, rounds: int, _folder: Path | None) -> dict[str, Any]:
    """Measure every scene, light and budget."""
    results: dict[str, Any] = {}
    grid = [gs.Shadow(filter=gs.Exact()), *(gs.Shadow(filter=f, resolution=r) for f in FILTERS for r in RESOLUTIONS)]
    kept, costs = [], []
    for name, make in scenes:
        scene = make()
        for kind, light in lights_of(scene).items():
            truth = gs.trace(scene, None, [light], SIZE, samples=1)
            with gs.Renderer() as renderer:

                def draw(lights: Any, outputs: Any, r: gs.Renderer = renderer, s: gs.Scene = scene) -> gs.Frame:
                    return r.render(s, None, lights, SIZE, outputs=outputs, samples=1)

                errors = {
                    shadow: gs.measure(
                        renderer.render(
                            scene,
                            None,
                            [replace(light, shadow=shadow)],
                            SIZE,
                            outputs=("visibility", "triangle"),
                            samples=1,
                        ),
                        truth,
                    ).wrong
                    for shadow in grid
                }
                times = dict(zip(grid, times_of(draw, [light], grid, rounds, 10_000), strict=True))
                ms = {shadow: float(np.median(taken)) for shadow, taken in times.items()}
                for wrong in BUDGETS:
                    renderer.render(scene, None, [light], SIZE, outputs=("image",), max_wrong=wrong, samples=1)
                    (chosen, _) = renderer._choices.of(scene)[-1]
                    meeting = [shadow for shadow in grid if errors[shadow] <= wrong] or [
                        min(grid, key=errors.__getitem__)
                    ]
                    best = min(meeting, key=ms.__getitem__)
                    error = errors[chosen.shadow]
                    kept.append(error <= 1.2 * wrong)
                    costs.append(ms[chosen.shadow] / ms[best])
                    results[f"{name} {kind} {wrong}"] = {"chosen": str(chosen), "error": error, "cost": costs[-1]}
                    said = f"{chosen}; by rays {100 * error:.4f} %; {costs[-1]:.2f} x the best, {best.filter} {best.resolution}"
                    click.echo(f"{name:34s} {kind:6s} {100 * wrong:5.2f} %: {said}")
    within = np.array(costs) <= 1.3
    click.echo(f"error within 1.2 x the budget: {100 * np.mean(kept):.1f} % of {len(kept)}")
    click.echo(
        f"cost over the best of the grid: median {np.median(costs):.2f}, within 1.3 x: {100 * within.mean():.1f} %"
    )
    return results


main = command(__doc__, {"budgets": measure_budgets})

if __name__ == "__main__":
    main()
