"""Frame time over the floor: the same driver's time for a Lambert pass and a depth-only pass of the same scene.

All variants take turns in one process, read-back included, with one moving directional light; compare ratios of medians only. The floor
draws the same nodes with the same matrices, culling and sizes, but without shadows.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import time
import warnings
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import click
import numpy as np

import glshadow as gs
from glshadow.renderer import Renderer
from glshadow.study.floor import Floor

SIZE = (1280, 720)
FILTERS = {"default": None, "hard": gs.Hard(), "pcf 1": gs.Pcf(1), "pcf 3": gs.Pcf(3)}
MODELS = (
    ("athlete_robot.stl", "z"), ("bicycle.glb", "y"), ("brain_cortex.ply", "z"), ("cesium_man.glb", "y"),
    ("chess_board.glb", "y"), ("demosthenes_bust.obj", "y"), ("dungeon_instances.glb", "y"),
    ("flight_helmet/flight_helmet.gltf", "y"), ("house_scene.glb", "y"), ("japanese_bridge_garden.glb", "y"),
    ("milk_truck.glb", "y"), ("terrain_jacksboro.ply", "z"),
)  # fmt: skip


def models_in(folder: Path | None) -> Path | None:
    """The folder of the 12 models: the given one, GLSHADOW_MODELS, or the one next to the checkout; None if none exists."""
    found = folder or Path(os.environ.get("GLSHADOW_MODELS", Path(__file__).resolve().parents[3] / "shared" / "models"))
    return found if found.is_dir() else None


def turned_sun(scene: gs.Scene, k: float, shadow: gs.Shadow) -> gs.DirectionalLight:
    """The scene's directional light, moved slightly every round."""
    light, angle = scene.lights[0], 0.002 * k
    x, y, z = light.direction if isinstance(light, gs.DirectionalLight) else gs.DirectionalLight().direction
    turned = (x * np.cos(angle) - z * np.sin(angle), y, x * np.sin(angle) + z * np.cos(angle))
    return gs.DirectionalLight(direction=turned, shadow=shadow)


def measure(scene: gs.Scene, repeats: int, filters: dict[str, Any]) -> dict[str, Any]:
    """Medians in ms of the floor and of each filter, in turn, with a light that moves every round."""
    with Renderer() as renderer, ExitStack() as stack:
        # one renderer per filter: caches of one are not rebuilt for the next
        renderers = {name: stack.enter_context(Renderer()) for name in filters}
        lights = {name: gs.Shadow(filter=kind) for name, kind in filters.items()}
        floor = Floor(renderer, scene, SIZE, 2048)
        times: dict[str, list[float]] = {"floor": [], **{name: [] for name in filters}}

        for k in range(-2, repeats):
            jobs: dict[str, Callable[[], Any]] = {
                name: (
                    lambda k=k, r=renderers[name], s=shadow: r.render(
                        scene, None, [turned_sun(scene, k, s)], SIZE, outputs=("image",), samples=1
                    )
                )
                for name, shadow in lights.items()
            }
            made = renderer.render(
                scene, None, [turned_sun(scene, k, gs.Shadow(filter=gs.Pcf(1)))], SIZE, outputs=("image",), samples=1
            )
            jobs = {"floor": lambda made=made: floor.draw(made), **jobs}
            for name, job in jobs.items():
                start = time.perf_counter()
                job()
                if k >= 0:
                    times[name].append(1e3 * (time.perf_counter() - start))
        floor.release()
        triangles = sum(len(node.mesh.triangles) for node in scene.nodes)
    row: dict[str, Any] = {"triangles": triangles, "nodes": len(scene.nodes)}
    for name, values in times.items():
        row[name] = {"median_ms": float(np.median(values)), "min_ms": min(values), "max_ms": max(values)}
        # the ratio inside each round: slow phases of the machine affect both alike
        row[name]["ratio"] = float(np.median(np.array(values) / np.array(times["floor"])))
    return row


def profile(scene: gs.Scene, repeats: int) -> dict[str, float]:
    """Median ms per pass of the default frame, with a moving light."""
    with Renderer() as renderer:
        passes: list[dict[str, float]] = []
        for k in range(repeats + 2):
            timings = renderer.render(
                scene, None, [turned_sun(scene, k, gs.Shadow())], SIZE, outputs=("image", "timings"), samples=1
            ).timings
            assert timings is not None
            if k > 1:
                passes.append(dict(timings))
    return {name: 1e3 * float(np.median([each[name] for each in passes])) for name in passes[0]}


def start_up(model: Path, repeats: int) -> dict[str, Any]:
    """Seconds of `glshadow render MODEL` from process start to the PNG on disk, with a warm shader cache, by stage."""
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "glshadow", "render", str(model), "-o", f"{folder}/out.png", "--json"]
        runs, report = [], {}
        for _ in range(repeats + 1):
            start = time.perf_counter()
            done = subprocess.run(command, capture_output=True, text=True, check=True)
            runs.append(time.perf_counter() - start)
            report = json.loads(done.stdout)
    return {"median_s": float(np.median(runs[1:])), "runs_s": runs, "where": report.get("timings")}


def one_draw(scene: gs.Scene) -> gs.Scene:
    """The same triangles as one mesh of one node."""
    positions, triangles, start = [], [], 0
    for node in scene.nodes:
        mesh = node.mesh
        positions.append(mesh.positions @ node.world_from_mesh[:3, :3].T + node.world_from_mesh[:3, 3])
        triangles.append(mesh.triangles + start)
        start += len(mesh.positions)
    mesh = gs.Mesh(np.concatenate(positions), np.concatenate(triangles))
    return gs.Scene((gs.Node(mesh, np.eye(4), "all"),), scene.camera, scene.lights)


def plain(scene: gs.Scene) -> gs.Scene:
    """The scene without textures and shading normals, so that it differs from `one_draw` only by its draw calls."""
    meshes = {id(n.mesh): gs.Mesh(n.mesh.positions, n.mesh.triangles) for n in scene.nodes}
    nodes = tuple(gs.Node(meshes[id(n.mesh)], n.world_from_mesh, n.name) for n in scene.nodes)
    return gs.Scene(nodes, scene.camera, scene.lights)


@click.command(help=__doc__)
@click.option("--models", "folder", type=click.Path(exists=True, path_type=Path), help="Folder of the 12 models.")
@click.option("--repeats", default=15, show_default=True, help="Rounds per scene.")
@click.option("--profile", "profiled", is_flag=True, help="Also the time of each pass.")
@click.option("--json", "output", type=click.Path(path_type=Path), help="Write all figures there.")
@click.option("--only", help="Only scenes whose name contains this.")
def main(folder: Path | None, repeats: int, profiled: bool, output: Path | None, only: str | None) -> None:
    warnings.simplefilter("ignore", gs.GlshadowWarning)
    folder = models_in(folder)
    results: dict[str, Any] = {}
    click.echo(
        f"{'scene':34s} {'triangles':>9s} {'floor ms':>9s} " + " ".join(f"{name + ' x':>10s}" for name in FILTERS)
    )
    scenes: list[tuple[str, Callable[[], gs.Scene]]] = [("courtyard", gs.scenes.courtyard)]
    if folder:
        scenes += [(name, lambda n=name, u=up: gs.load(folder / n, up_axis=u, look="plain")) for name, up in MODELS]
    for name, make in scenes:
        if only and only not in name:
            continue
        scene = make()
        row = results[name] = measure(scene, repeats, FILTERS)
        if profiled:
            row["profile_ms"] = profile(scene, repeats)
        ratios = " ".join(f"{row[kind]['ratio']:10.2f}" for kind in FILTERS)
        click.echo(f"{name:34s} {row['triangles']:9d} {row['floor']['median_ms']:9.1f} {ratios}")
        if profiled:
            click.echo("    " + ", ".join(f"{k} {v:.1f} ms" for k, v in row["profile_ms"].items()))
    models = [row["default"]["ratio"] for name, row in results.items() if name != "courtyard"]
    if models:
        click.echo(f"median of {len(models)} models: default {np.median(models):.2f} x floor")
    if folder and not only:
        scene = plain(gs.load(folder / "dungeon_instances.glb", look="plain"))
        merged = one_draw(scene)
        many, one = (measure(each, repeats, {"default": None})["default"]["median_ms"] for each in (scene, merged))
        results["dungeon, nodes against one draw"] = {"nodes_ms": many, "one_draw_ms": one, "ratio": many / one}
        click.echo(
            f"dungeon, {len(scene.nodes)} nodes against one draw: {many:.1f} / {one:.1f} ms = {many / one:.2f} x"
        )
        start = results["glshadow render chess_board.glb"] = start_up(folder / "chess_board.glb", 5)
        click.echo(f"glshadow render chess_board.glb: {start['median_s']:.2f} s; {start['where']}")
    if output:
        output.write_text(json.dumps(results, indent=1))


if __name__ == "__main__":
    main()
