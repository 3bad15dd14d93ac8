"""Measures a grid of shadow settings for speed and error in one run."""

from __future__ import annotations

import os
import time
from collections.abc import Iterable
from typing import Any

from glshadow.arguments import DEFAULT_SIZE
from glshadow.core.cameras import Camera
from glshadow.gl.driver.context import Backend
from glshadow.lights import Lights
from glshadow.shadows.shadow import Shadow
from glshadow.study.grid import DEFAULT, Grid, settings_of
from glshadow.study.pictures import Panel
from glshadow.study.result import Result, Study, pareto_front
from glshadow.study.run import Progress, Run, open_run


def run_study(
    scene: Any,
    camera: Camera | None = None,
    lights: Lights = None,
    size: tuple[int, int] = DEFAULT_SIZE,
    grid: Grid | Iterable[Shadow] | None = None,
    repeats: int = 7,
    resume: str | os.PathLike[str] | None = None,
    progress: Progress | None = None,
    backend: Backend = "auto",
) -> Study:
    """Measure every setting of a grid for speed and error, for every light that casts shadows.

    Each light is studied alone: its frames contain no other. Settings that share a resolution and a target are timed round-robin with
    the floor, with the light moving slightly every round; then all are scored on the image itself.

    Parameters
    ----------
    scene : Scene, or anything that `glshadow.load` takes
    camera, lights : optional
        None: the scene's own. Their shadow settings are ignored; lights with `shadow=None` are left out.
    size : (2,) ints
        Width and height.
    grid : Grid or iterable of Shadow, optional
        None: Grid.default(scene, lights).
    repeats : int
        Number of timed rounds, at least 1.
    resume : path, optional
        JSON lines file: results are appended as they come, and those already there are not measured again.
    progress : callable, optional
        Called as progress(done, total, text). None: a bar below the cell in a notebook.
    backend : str
        As for Renderer.

    Raises
    ------
    SettingsError
        For an empty grid, no light that casts shadows, or a file that is not a journal.
    ReferenceUnavailable
        If embreex is not installed.
    """
    start = time.perf_counter()
    with open_run(scene, camera, lights, size, repeats, resume, progress, backend) as run:
        scene = run.scene
        settings = settings_of(Grid.default(scene, run.lights) if grid is None else grid)
        run.total = len(settings) * len(run.lights)
        results: list[Result] = []
        panels: dict[str, Panel] = {}
        for number in range(len(run.lights)):
            run.time(number, settings)
            run.score(number, settings)
            mine = [run.result(number, shadow) for shadow in settings]
            results += mine
            panels |= _panels(run, number, mine)
            run.forget_truth(number)
    return Study(
        scene.name, sum(len(node.mesh.triangles) for node in scene.nodes), len(scene.nodes), size, run.camera,
        run.lights, tuple(results), run.machine, repeats, time.perf_counter() - start, panels,
    )  # fmt: skip


def _panels(run: Run, number: int, results: list[Result]) -> dict[str, Panel]:
    """Images of the settings on the Pareto front, and of the default."""
    best = pareto_front([r.cost for r in results], [r.error for r in results])
    return {
        result.key: run.panel(number, result.shadow)
        for result, keep in zip(results, best, strict=True)
        if keep or result.shadow == DEFAULT
    }
