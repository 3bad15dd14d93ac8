"""Maps of a moving light with and without cluster culling, and without telling the driver to begin early; also compares the values.

The three take turns in one process; medians. `cpu` is the time of all threads, which is meaningful on a busy machine.
"""

from __future__ import annotations

import time
import warnings
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import click
import numpy as np
from exact import lights_of, moved, sized
from frame import MODELS, SIZE, models_in

import glshadow as gs
from glshadow.gl.scene import occlusion, runs

NEVER = 1 << 60
WAYS = {
    "before": (NEVER, NEVER),
    "begun early": (NEVER, runs.AT_ONCE),
    "spared": (occlusion.LEAST_TRIANGLES, runs.AT_ONCE),
}


def subdivided(scene: gs.Scene, times: int) -> gs.Scene:
    """The same surfaces with 4^times as many triangles, in the original order."""
    nodes = []
    for node in scene.nodes:
        positions, triangles = node.mesh.positions, node.mesh.triangles
        for _ in range(times):
            sides = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
            unique, place = np.unique(sides, axis=0, return_inverse=True)
            middle = place.reshape(-1, 3) + len(positions)
            positions = np.concatenate([positions, positions[unique].mean(axis=1)])
            (a, b, c), (ab, bc, ca) = triangles.T, middle.T
            parts = [np.stack(part, axis=-1) for part in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))]
            triangles = np.stack(parts, axis=1).reshape(-1, 3)
        nodes.append(replace(node, mesh=gs.Mesh(positions, triangles)))
    return replace(scene, nodes=tuple(nodes))


def scenes(folder: Path | None, only: str | None) -> Iterator[tuple[str, gs.Scene]]:
    """Courtyard, the same with 16 times as many triangles, the 12 models, four brains."""
    for name, times in (("courtyard", 0), ("courtyard x 16", 2)):
        if not only or only in name:
            yield name, subdivided(gs.scenes.courtyard(), times)
    for name, up in MODELS if folder else ():
        if not only or only in name:
            yield name, gs.load(folder / name, up_axis=up, look="plain")
    if folder and (not only or only in "four brains"):
        yield "four brains", list(sized(gs.load(folder / "brain_cortex.ply", up_axis="z", look="plain")))[-1][1]


def compare(name: str, kind: str, scene: gs.Scene, light: gs.Light, rounds: int) -> None:
    """Measure and print one line."""
    renderers = {way: gs.Renderer() for way in WAYS}
    spent: dict[str, list[list[float]]] = {way: [] for way in WAYS}
    differing = 0
    for k in range(-8, rounds):
        frames = {}
        for way, renderer in renderers.items():
            occlusion.LEAST_TRIANGLES, runs.AT_ONCE = WAYS[way]
            start, cpu = time.perf_counter(), time.process_time()
            caster = replace(moved(light, k), shadow=gs.Shadow())
            outputs = ("image", "timings", "triangle", "shadow_maps") if k < 0 else ("image", "timings")
            frame = frames[way] = renderer.render(scene, None, [caster], SIZE, outputs=outputs, samples=1)
            times = [time.perf_counter() - start, time.process_time() - cpu]
            if k >= 0:
                spent[way].append([frame.timings["surface"], frame.timings["shadow"], *times])
        for way in ("begun early", "spared"):
            pairs = [(frames["before"].image, frames[way].image)]
            if k < 0:
                pairs.append((frames["before"].triangle, frames[way].triangle))
                pairs.append((frames["before"].shadow_maps[0], frames[way].shadow_maps[0]))
            differing += sum(int((a != b).sum()) for a, b in pairs)
    for renderer in renderers.values():
        renderer.release()
    table = {way: 1e3 * np.median(rows, axis=0) for way, rows in spent.items()}
    columns = ("surface", "shadow", "frame", "cpu")
    shown = "; ".join(
        f"{column} " + " ".join(f"{table[way][i]:6.1f}" for way in WAYS) for i, column in enumerate(columns)
    )
    click.echo(f"{name:34s} {kind:5s} {shown}; {differing} values differ")


@click.command(help=__doc__)
@click.option("--models", "folder", type=click.Path(exists=True, path_type=Path), help="Folder of the 12 models.")
@click.option("--only", help="Only scenes whose name contains this.")
@click.option("--light", "lights", multiple=True, default=("sun", "spot", "point"), help="Only these lights.")
@click.option("--rounds", default=9, show_default=True, help="Rounds of each timing.")
def main(folder: Path | None, only: str | None, lights: tuple[str, ...], rounds: int) -> None:
    warnings.simplefilter("ignore", gs.GlshadowWarning)
    click.echo("ms: " + ", ".join(WAYS))
    for name, scene in scenes(models_in(folder), only):
        for kind, light in lights_of(name, scene).items():
            if kind in lights:
                compare(name, kind, scene, light, rounds)


if __name__ == "__main__":
    main()
