"""Renders thousands of images in one process with changing scenes, sizes and settings: memory and OpenGL objects must not grow.

Only caches may grow: compiled shaders (one per combination of settings, all used in the warm-up), and the largest atlas of each
format. So the same cycle of cases is repeated, and the first cycle is not counted.
"""

from __future__ import annotations

import gc
import os
import sys
import time
import warnings
from pathlib import Path

import click
import numpy as np
import random_settings
from gl_objects import counted, resident_mib

import glshadow as gs

ROOT = Path(__file__).resolve().parents[1]
MODELS = Path(os.environ.get("GLSHADOW_MODELS", ROOT.parent / "shared" / "models"))
FILES = (
    "milk_truck.glb",
    "cesium_man.glb",
    "hostile/simple_instancing.glb",
    "hostile/fox.glb",
    "hostile/made_alpha_mask_checker.glb",
)
# Mesa's and numpy's heaps vary with the order of sizes; a leak of one 64 x 64 target per image would be 32 MiB in 2,000.
MAY_GROW_MIB = 16.0


def picture(renderer: gs.Renderer, seed: int, number: int) -> str:
    """One case of the cycle, made from scratch; returns 'refused' or 'drawn'."""
    rng = np.random.default_rng([seed, number])
    case = random_settings.case(rng)
    scene, camera, size = case.scene, case.camera, case.size
    way = number % 5
    if way == 1 and (files := [MODELS / name for name in FILES if (MODELS / name).is_file()]):
        scene, camera = gs.load(files[number // 5 % len(files)]), None
    if way == 2:
        size = (int(rng.integers(1, 641)), int(rng.integers(1, 641)))
    if way == 3:  # a moving object: the mesh stays on the GPU, the scene changes
        name = scene.nodes[0].name
        scene = scene.moved({name: scene.nodes[0].world_from_mesh @ np.diag([1.0, 1.1, 1.0, 1.0])})
    if way == 4 and number % 2:  # an error half way must leave nothing behind
        size = (size[0], 1 << 20)
    wanted = ("image", "visibility", "linear", "depth", "shadow_maps", "triangle", "depth_metric", "timings")
    outputs = tuple(wanted[i] for i in np.flatnonzero(rng.random(len(wanted)) < 0.4)) or ("image",)
    try:
        renderer.render(scene, camera, case.lights, size, outputs=outputs, samples=1)
    except gs.GlshadowError:
        return "refused"
    return "drawn"


def lifetimes(renderers: int) -> tuple[float, float]:
    """MiB before and after making, using and releasing `renderers` renderers."""
    scene = gs.scenes.courtyard()

    def one() -> None:
        with gs.Renderer() as renderer:
            renderer.render(scene, size=(64, 64), samples=1)

    for _ in range(3):
        one()
    before = resident_mib()
    for _ in range(renderers):
        one()
    gc.collect()
    return before, resident_mib()


def verdicts(rows: list[tuple[int, float, dict[str, int]]]) -> list[str]:
    """What has grown between the end of the first cycle and the end."""
    first, last = rows[0], rows[-1]
    wrong = [f"{kind}: {first[2][kind]} -> {last[2][kind]}" for kind in first[2] if last[2][kind] > first[2][kind]]
    middle = float(np.median([row[1] for row in rows[: max(len(rows) // 4, 1)]]))
    end = float(np.median([row[1] for row in rows[-max(len(rows) // 4, 1) :]]))
    if end - middle > MAY_GROW_MIB:
        wrong.append(f"resident memory: {middle:.0f} -> {end:.0f} MiB")
    return wrong


@click.command(help=__doc__)
@click.option("--renders", default=2000, show_default=True, help="Pictures.")
@click.option("--cycle", default=100, show_default=True, help="Different cases; the first cycle does not count.")
@click.option("--renderers", default=20, show_default=True, help="Renderers made and released afterwards.")
@click.option("--seed", default=0, show_default=True)
def main(renders: int, cycle: int, renderers: int, seed: int) -> None:
    from rich.console import Console
    from rich.progress import Progress
    from rich.table import Table

    warnings.simplefilter("ignore", gs.GlshadowWarning)
    console = Console(stderr=True)
    rows: list[tuple[int, float, dict[str, int]]] = []
    outcomes: dict[str, int] = {"drawn": 0, "refused": 0}
    start = time.monotonic()
    with gs.Renderer() as renderer, Progress(console=console) as progress:
        task = progress.add_task("renders", total=renders)
        for i in range(renders):
            outcomes[picture(renderer, seed, i % cycle)] += 1
            progress.advance(task)
            if (i + 1) % cycle == 0:
                gc.collect()
                # the same scene is held whenever it is counted; also sweeps what was collected
                picture(renderer, seed, 0)
                rows.append((i + 1, resident_mib(), counted(renderer)))
    table = Table("renders", "MiB", *rows[0][2]) if rows else Table()
    for number, memory, counts in rows if len(rows) < 12 else rows[:: len(rows) // 10]:
        table.add_row(str(number), f"{memory:.1f}", *map(str, counts.values()))
    out = Console(width=max(console.width, 120))
    out.print(table)
    click.echo(f"{outcomes['drawn']} drawn, {outcomes['refused']} refused, {time.monotonic() - start:.0f} s")
    wrong = verdicts(rows) if len(rows) > 1 else ["too few renders: at least two cycles are needed"]
    if renderers:
        before, after = lifetimes(renderers)
        click.echo(f"{renderers} renderers made and released: {before:.1f} -> {after:.1f} MiB")
        if after - before > MAY_GROW_MIB:
            wrong.append(f"renderers: {(after - before) / renderers:.2f} MiB each are not given back")
    click.echo("grows: " + "; ".join(wrong) if wrong else "flat")
    sys.exit(int(bool(wrong)))


if __name__ == "__main__":
    main()
