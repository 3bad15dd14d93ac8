"""Optimisations for OpenGL on the CPU only (`Caps.software`): each with and without, in turn; medians, and whether values differ.

Each is measured in a scene and a stage of the frame where it is the only one: maps of fewer than 131,072 triangles are neither split
nor culled, and the camera's pass is not culled.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import click
import numpy as np
from exact import sized
from frame import SIZE, models_in

import glshadow as gs
from glshadow.gl.scene import runs

NEVER = 1 << 60


@dataclass(frozen=True)
class Shape:
    """An optimisation for drivers on the CPU, with a stage of a frame in which everything else is the same."""

    what: str
    where: str
    stage: str
    scene: Callable[[Path], gs.Scene]
    shadow: gs.Shadow
    pieces: bool = True  # whether draws are split, which makes the driver begin early
    turns: str = "light"


def _courtyard(_: Path) -> gs.Scene:
    return gs.scenes.courtyard()


def _brain(folder: Path) -> gs.Scene:
    return gs.load(folder / "brain_cortex.ply", up_axis="z", ground=True, look="plain")


def _brains(folder: Path) -> gs.Scene:
    """Four brains behind each other."""
    return list(sized(gs.load(folder / "brain_cortex.ply", up_axis="z", look="plain")))[-1][1]


HARD, WIDE = gs.Shadow(filter=gs.Hard()), gs.Shadow(filter=gs.Pcf(3))
MAPPED, RUNS, OCCLUSION = (f"glshadow/gl/{name}.py" for name in ("techniques/mapped", "scene/runs", "scene/occlusion"))
SHAPES = (
    Shape("compares raw depths in the shader, one tap", MAPPED, "resolve", _courtyard, HARD),
    Shape("the same, 49 comparisons", MAPPED, "resolve", _courtyard, WIDE),
    Shape("tells the driver to begin after 65,536 triangles", RUNS, "surface", _brain, HARD, turns="camera"),
    Shape("reads a map's depth for what is hidden", OCCLUSION, "shadow", _brains, HARD, pieces=False),
)


def measure(shape: Shape, folder: Path, rounds: int) -> dict[str, object]:
    """Medians in ms with and without, and whether images differ."""
    scene = shape.scene(folder)
    sun = gs.DirectionalLight(direction=(-0.5, -0.8, 0.3), shadow=shape.shadow)
    times: dict[bool, list[float]] = {True: [], False: []}
    seen: dict[bool, np.ndarray] = {}
    differing = 0
    runs.AT_ONCE = 1 << 16 if shape.pieces else NEVER
    with gs.Renderer() as one, gs.Renderer() as other:
        renderers = {True: one, False: other}
        for software, renderer in renderers.items():
            renderer._context.caps = replace(renderer._context.caps, software=software)
        cameras = gs.orbit(scene.camera, 360)
        for k in range(rounds + 6):
            light = replace(sun, direction=(-0.5, -0.8, 0.3 + 0.002 * k)) if shape.turns == "light" else sun
            camera = cameras[k] if shape.turns == "camera" else scene.camera
            for software, renderer in renderers.items():
                frame = renderer.render(scene, camera, [light], SIZE, outputs=("visibility", "timings"), samples=1)
                seen[software] = frame.visibility
                if k >= 6:  # clusters exist, and hidden ones are known
                    times[software].append(1e3 * frame.timings[shape.stage])
            differing += int((np.nan_to_num(seen[True]) != np.nan_to_num(seen[False])).sum())
    runs.AT_ONCE = 1 << 16
    shaped, plain = (float(np.median(times[way])) for way in (True, False))
    return {
        "what": shape.what,
        "where": shape.where,
        "stage": shape.stage,
        "with_ms": shaped,
        "without_ms": plain,
        "ratio": shaped / plain,
        "differing": differing,
    }


@click.command()
@click.option("--models", type=click.Path(path_type=Path), default=None, help="Folder of the shared models.")
@click.option("--rounds", type=int, default=15, show_default=True)
@click.option("--json", "json_path", type=click.Path(path_type=Path), default=None)
def main(models: Path | None, rounds: int, json_path: Path | None) -> None:
    """Time each with and without."""
    folder = models_in(models)
    if folder is None:
        raise click.UsageError("no models: name their folder with --models, or in GLSHADOW_MODELS")
    rows = []
    for shape in SHAPES:
        row = measure(shape, folder, rounds)
        rows.append(row)
        click.echo(f"{row['what']:50s} {row['stage']:8s} {row['with_ms']:7.1f} ms, without {row['without_ms']:7.1f}: "
                   f"{row['ratio']:.2f}; {row['differing']} values differ")  # fmt: skip
    if json_path is not None:
        json_path.write_text(json.dumps(rows, indent=1))


if __name__ == "__main__":
    main()
