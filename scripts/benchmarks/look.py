"""The default look: how much of the image models fill, what is clipped, how bright models and ground are; studio beside plain.

Of the 12 models, six shapes as from CAD, scans and plots that are made here, and the built-in scenes. Luminance is that of the image's
sRGB values, of a display's white; percentiles 1, 50 and 99 of the model's pixels, the median of the ground's.
"""

from __future__ import annotations

import json
import time
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import click
import numpy as np
from frame import MODELS, models_in

import glshadow as gs
from glshadow.core.srgb import LUMINANCE, linear_from_srgb
from glshadow.scenes import shapes

SIZE = (640, 360)
LOOKS = ("plain", "studio")


def _lathe(profile: Any, sides: int = 96) -> gs.Mesh:
    """A body of revolution about y of a profile (N, 2) of radii and heights."""
    profile = np.asarray(profile, dtype=float)
    turns = 2 * np.pi * np.arange(sides + 1) / sides
    points = np.stack([np.outer(profile[:, 0], np.cos(turns)), np.repeat(profile[:, 1:], sides + 1, axis=1),
                       np.outer(profile[:, 0], np.sin(turns))], axis=-1).reshape(-1, 3)  # fmt: skip
    i = (np.arange(len(profile) - 1)[:, None] * (sides + 1) + np.arange(sides)).ravel()
    step = sides + 1
    return gs.Mesh(
        points, np.concatenate([np.stack([i, i + step, i + 1], 1), np.stack([i + 1, i + step, i + step + 1], 1)])
    )


def flange() -> list[gs.Mesh | gs.Node]:
    """A turned part with six bolts, millimetres."""
    outer = _lathe([(20, 0), (60, 0), (60, 12), (32, 12), (28, 16), (28, 60), (20, 60), (20, 0)])
    bolt = _lathe([(0, 20), (5, 20), (5, 12), (3, 12), (3, -6), (0, -6)], 6)
    parts: list[gs.Mesh | gs.Node] = [outer]
    for k in range(6):
        place = np.eye(4)
        place[:3, 3] = 46 * np.cos(k * np.pi / 3), 0, 46 * np.sin(k * np.pi / 3)
        parts.append(gs.Node(bolt, place))
    return parts


def plate() -> list[gs.Mesh | gs.Node]:
    """A perforated sheet lying flat: 200 x 1 x 120."""
    nodes: list[gs.Mesh | gs.Node] = []
    box = gs.Mesh(*shapes.box((1, 1, 1)))
    for x in range(11):
        nodes.append(gs.Node(box, np.diag([3.0, 1.0, 120.0, 1.0]) + _at(20.0 * x - 100.0, 0, 0)))
    for z in range(7):
        nodes.append(gs.Node(box, np.diag([203.0, 1.0, 3.0, 1.0]) + _at(0, 0, 20.0 * z - 60.0)))
    return nodes


def _at(x: float, y: float, z: float) -> Any:
    moved = np.zeros((4, 4))
    moved[:3, 3] = x, y, z
    return moved


def pole() -> list[gs.Mesh | gs.Node]:
    """A mast 50 times as high as wide, kilometres."""
    return [_lathe(np.array([(0.4, 0), (0.1, 0.3), (0.08, 10), (0.0, 10)]) * 0.001)]


def scan() -> list[gs.Mesh | gs.Node]:
    """A rough ball, as scanned, micrometres."""
    positions, triangles = shapes.icosphere(4, 1.0)
    return [gs.Mesh(1e-6 * positions * (1 + 0.05 * np.sin(9 * positions).sum(axis=1, keepdims=True)), triangles)]


def surface() -> list[gs.Mesh | gs.Node]:
    """A function of two variables, as of a plot."""
    x, z = np.meshgrid(np.linspace(-6, 6, 121), np.linspace(-6, 6, 121))
    y = 2 * np.sin(np.hypot(x, z)) / np.maximum(np.hypot(x, z), 1e-9) * 2
    i = (np.arange(120)[:, None] * 121 + np.arange(120)).ravel()
    faces = np.concatenate([np.stack([i, i + 121, i + 1], 1), np.stack([i + 1, i + 121, i + 122], 1)])
    return [gs.Mesh(np.stack([x, y, z], axis=-1).reshape(-1, 3), faces)]


def cloud() -> list[gs.Mesh | gs.Node]:
    """4,000 points on a torus knot."""
    t = np.linspace(0, 2 * np.pi, 4000)
    radius = 2 + np.cos(3 * t)
    points = np.stack([radius * np.cos(2 * t), np.sin(3 * t), radius * np.sin(2 * t)], axis=-1)
    noise = np.random.default_rng(1).normal(size=points.shape) * 0.06
    return [gs.Points(points + noise, radius=0.03)]


MADE: tuple[Callable[[], Any], ...] = (flange, plate, pole, scan, surface, cloud)


def row(renderer: gs.Renderer, scene: gs.Scene) -> dict[str, Any]:
    """The figures of one scene."""
    start = time.process_time()
    frame = renderer.render(scene, size=SIZE, outputs=("image", "node", "alpha"))
    first = time.process_time() - start
    grounds = [i for i, node in enumerate(scene.nodes) if node.ground]
    model = (frame.node >= 0) & ~np.isin(frame.node, grounds)
    light = linear_from_srgb(frame.image / 255.0) @ LUMINANCE
    rows, columns = np.nonzero(model)
    fill = max(np.ptp(columns) + 1, (np.ptp(rows) + 1) * SIZE[0] / SIZE[1]) / SIZE[0]
    ground = light[np.isin(frame.node, grounds)]
    return {
        "fill": float(fill),
        "share": float(model.mean()),
        "clipped": float((frame.image[model].max(axis=-1) == 255).mean()),
        "model": [float(x) for x in np.percentile(light[model], (1, 50, 99))],
        "ground": float(np.median(ground)) if len(ground) else None,
        "seconds": first,
    }


def again(scene: gs.Scene, others: gs.Scene, rounds: int, size: tuple[int, int]) -> float:
    """Processor time of a frame over another scene's, with a moving camera, kept scene and lights; the median of alternating rounds."""
    ratios = []
    with gs.Renderer() as ours, gs.Renderer() as theirs:
        for k in range(-1, rounds):
            taken = []
            for renderer, each in ((ours, scene), (theirs, others)):
                camera: Any = each.camera
                eye = tuple(np.asarray(camera.position) * (1 + 1e-6 * (k + 2)))
                start = time.process_time()
                renderer.render(
                    each, gs.PerspectiveCamera(eye, camera.target, fov_y=camera.fov_y), size=size, outputs="image"
                )
                taken.append(time.process_time() - start)
            if k >= 0:
                ratios.append(taken[0] / taken[1])
    return float(np.median(ratios))


@click.command(help=__doc__)
@click.option("--models", "folder", type=click.Path(exists=True, path_type=Path), help="Folder of the 12 models.")
@click.option("--only", help="Only scenes whose name contains this.")
@click.option("--times", default=0, help="Also compare the time of frames of 1280 x 720, in so many rounds.")
@click.option("--json", "output", type=click.Path(path_type=Path), help="Write all figures there.")
def main(folder: Path | None, only: str | None, times: int, output: Path | None) -> None:
    warnings.simplefilter("ignore", gs.GlshadowWarning)
    folder = models_in(folder)
    scenes: list[tuple[str, Callable[[str], gs.Scene]]] = []
    if folder:
        scenes += [
            (n, lambda look, n=n, up=up: gs.load(folder / n, up_axis=up, ground=True, look=look)) for n, up in MODELS
        ]
    scenes += [(make.__name__, lambda look, make=make: gs.load(make(), ground=True, look=look)) for make in MADE]
    for built in (gs.scenes.courtyard, gs.scenes.outdoors, gs.scenes.street):
        scenes.append((built.__name__, lambda look, built=built: gs.load(built(), look=look)))
    results: dict[str, Any] = {}
    click.echo(f"{'':30s} {'look':8s} {'fill':>5s} {'share':>6s} {'clipped':>8s}   model 1 %  50 %  99 %   ground")
    for name, make in scenes:
        if only is not None and only not in name:
            continue
        for look in LOOKS:
            scene = make(look)
            with gs.Renderer() as renderer:
                found = results.setdefault(name, {})[look] = row(renderer, scene)
            ground = "-" if found["ground"] is None else f"{found['ground']:.2f}"
            low, middle, high = found["model"]
            click.echo(
                f"{name:30s} {look:8s} {found['fill']:5.2f} {found['share']:6.3f} {found['clipped']:8.2%}   "
                f"{low:9.2f} {middle:5.2f} {high:5.2f}   {ground:>6s}"
            )
        if times:
            results[name]["time"] = again(make("studio"), make("plain"), times, (1280, 720))
            click.echo(f"{'':30s} a frame of the studio takes {results[name]['time']:.2f} x that of plain")
    if output:
        output.write_text(json.dumps(results, indent=1))


if __name__ == "__main__":
    main()
