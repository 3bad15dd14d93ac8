"""Large scenes: CPU time of the first image of millions of triangles or many nodes, of later images, and memory.

Each part runs in a process of its own. Memory is what the image adds to the process; a driver on the CPU keeps its buffers there too.
"""

from __future__ import annotations

import json
import multiprocessing
import re
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import click
import numpy as np

import glshadow as gs
from glshadow.scenes import shapes

EXACT, MAP = gs.Shadow(filter=gs.Exact()), gs.Shadow(filter=gs.Pcf(1))
_ROUNDS = 5


def sheet(side: int, shuffled: bool) -> gs.Mesh:
    """A displaced grid of side x side vertices; shuffled: vertices and triangles in random order."""
    random = np.random.default_rng(0)
    x, z = np.meshgrid(*[np.linspace(-1.0, 1.0, side)] * 2)
    y = 0.05 * np.sin(9.0 * x) * np.cos(7.0 * z) + 1e-4 * random.standard_normal(x.shape)
    positions = np.stack([x, y, z], axis=-1).reshape(-1, 3).astype(np.float32).astype(np.float64)
    number = np.arange(side * side, dtype=np.int32).reshape(side, side)
    a, b, c, d = (each.ravel() for each in (number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]))
    triangles = np.concatenate([np.stack([a, b, c], axis=-1), np.stack([a, c, d], axis=-1)])
    if shuffled:
        to = random.permutation(len(positions)).astype(np.int32)
        positions[to] = positions.copy()
        triangles = random.permutation(to[triangles])
    return gs.Mesh(positions, triangles)


def many(count: int, meshes: int) -> gs.Scene:
    """Boxes of 12 triangles in a field, which take turns in using `meshes` meshes."""
    random = np.random.default_rng(0)
    places, triangles = shapes.box((1.0, 1.0, 1.0))
    of = [gs.Mesh(places * (1.0 + 1e-3 * (k % 97)), triangles) for k in range(meshes)]
    side = int(np.ceil(np.sqrt(count)))
    nodes = []
    for k in range(count):
        matrix = np.eye(4)
        matrix[:3, 3] = (2 * (k % side), random.random(), 2 * (k // side))
        nodes.append(gs.Node(of[k % meshes], matrix, f"box {k}"))
    return gs.Scene(tuple(nodes))


def _memory(field: str) -> int:
    """Current memory of the process in bytes (VmRSS), or its peak (VmHWM)."""
    found = re.search(rf"{field}:\s+(\d+) kB", Path("/proc/self/status").read_text())
    assert found is not None
    return 1024 * int(found[1])


def _timed(work: Callable[[], Any]) -> tuple[float, float]:
    """Seconds of CPU time and wall-clock time."""
    cpu, wall = time.process_time(), time.perf_counter()
    work()
    return time.process_time() - cpu, time.perf_counter() - wall


def mesh(side: int, shuffled: bool) -> dict[str, float]:
    """The first image of one mesh; frames with a moving camera and with a moving light, over those of a shadow map."""
    scene = gs.Scene((gs.Node(sheet(side, shuffled), np.eye(4), "sheet"),))
    count = len(scene.nodes[0].mesh.triangles)
    with gs.Renderer() as renderer, gs.Renderer() as maps:
        renderer.render(gs.scenes.courtyard(), samples=1)
        Path("/proc/self/clear_refs").write_text("5")  # resets the peak
        before = _memory("VmRSS")
        cpu, wall = _timed(lambda: renderer.render(scene, samples=1))
        row = {
            "triangles": count, "first_cpu_s": cpu, "first_wall_s": wall,
            "peak_bytes": (_memory("VmHWM") - before) / count, "kept_bytes": (_memory("VmRSS") - before) / count,
        }  # fmt: skip
        for name, camera, sun in (("camera", 1.0, 0.0), ("sun", 0.0, 1.0), ("both", 1.0, 1.0)):
            spent: list[list[float]] = [[], []]
            for k in range(-1, _ROUNDS):
                view = gs.PerspectiveCamera((1.5 + 0.01 * camera * k, 1.2, 2.2), (0.0, 0.0, 0.0))
                for each, which, shadow in zip((renderer, maps), spent, (EXACT, MAP), strict=True):
                    light = gs.DirectionalLight(direction=(0.3 + 1e-3 * sun * k, -1.0, -0.4), shadow=shadow)
                    took = _timed(lambda: each.render(scene, view, [light], outputs=("image",), samples=1))[0]  # noqa: B023
                    if k >= 0:
                        which.append(took)
            row[f"{name}_over_map"] = float(np.median(np.divide(*spent)))
    return row


def nodes(count: int, meshes: int) -> dict[str, float]:
    """The first image of many nodes, and images after one of them has moved."""
    scene = many(count, meshes)
    camera, lights = scene.camera, scene.lights
    with gs.Renderer() as renderer:
        renderer.render(gs.scenes.courtyard(), samples=1)
        again = gs.Scene(scene.nodes)  # its bounds are not computed yet
        cpu, wall = _timed(lambda: renderer.render(gs.Scene(scene.nodes), camera, lights, samples=1))
        renderer.render(again, camera, lights, samples=1)
        moved, still = [], []
        for k in range(_ROUNDS):
            matrix = np.eye(4)
            matrix[:3, 3] = (10.0 + k, 3.0, 10.0)

            def move(matrix: np.ndarray = matrix) -> None:
                nonlocal again
                again = again.moved({"box 77": matrix})
                renderer.render(again, camera, lights, samples=1)

            moved.append(_timed(move)[0])
            still.append(_timed(lambda: renderer.render(again, camera, lights, samples=1))[0])
    return {"nodes": count, "meshes": meshes, "first_cpu_s": cpu, "first_wall_s": wall,
            "moved_cpu_s": float(np.median(moved)), "still_cpu_s": float(np.median(still))}  # fmt: skip


PARTS: dict[str, tuple[Callable[..., dict[str, float]], tuple[Any, ...]]] = {
    "mesh": (mesh, (2207, False)),
    "shuffled mesh": (mesh, (2207, True)),
    "instances": (nodes, (100_000, 1)),
    "nodes": (nodes, (100_000, 16)),
    "nodes of their own meshes": (nodes, (20_000, 20_000)),
}


def _part(name: str) -> dict[str, float]:
    work, arguments = PARTS[name]
    return work(*arguments)


@click.command(help=__doc__)
@click.option("--part", "parts", multiple=True, type=click.Choice(list(PARTS)), help="Only these parts.")
@click.option("--json", "output", type=click.Path(path_type=Path), help="Write all figures there.")
def main(parts: tuple[str, ...], output: Path | None) -> None:
    results = {}
    for name in parts or PARTS:
        with multiprocessing.get_context("spawn").Pool(1) as alone:
            results[name] = alone.apply(_part, (name,))
        click.echo(f"{name}: " + ", ".join(f"{key} {value:.4g}" for key, value in results[name].items()))
    if output:
        output.write_text(json.dumps(results, indent=1))


if __name__ == "__main__":
    main()
