"""Renders the README's images: the courtyard as reference, rendered and error, and real models with default settings."""

from __future__ import annotations

import contextlib
import os
import runpy
import shutil
import tempfile
import warnings
from dataclasses import replace
from pathlib import Path

import click
import numpy as np
from numpy.typing import NDArray

import glshadow as gs
from glshadow import image
from glshadow.triptych import GAP, triptych

ROOT = Path(__file__).resolve().parents[1]
OUT = ROOT / "examples" / "pictures"
TWELVE = (
    ("athlete_robot.stl", "z"), ("bicycle.glb", "y"), ("brain_cortex.ply", "z"), ("cesium_man.glb", "y"),
    ("chess_board.glb", "y"), ("demosthenes_bust.obj", "y"), ("dungeon_instances.glb", "y"),
    ("flight_helmet/flight_helmet.gltf", "y"), ("house_scene.glb", "y"), ("japanese_bridge_garden.glb", "y"),
    ("milk_truck.glb", "y"), ("terrain_jacksboro.ply", "z"),
)  # fmt: skip
MODELS = Path(os.environ.get("GLSHADOW_MODELS", ROOT.parent / "shared" / "models"))


def courtyard() -> NDArray[np.uint8]:
    """Reference, rendered and error: a detail of the courtyard at 1280 x 720, three times 420 x 420, with one shadow map to show errors."""
    scene = gs.scenes.courtyard()
    truth = gs.trace(scene, samples=1)
    mapped = [replace(light, shadow=gs.Shadow(filter=gs.Pcf(1))) for light in scene.lights]
    with gs.Renderer() as renderer:
        frame = renderer.render(scene, lights=mapped, outputs=("image", "visibility", "triangle"), samples=1)
        error = gs.measure(frame, truth)
        whole = triptych(renderer, frame, truth, error)
    click.echo(error)
    width, gap = frame.size[0] + GAP, np.full((420, 10, 3), 255, dtype=np.uint8)
    parts = [whole[230:650, 300 + k * width : 720 + k * width] for k in range(3)]
    return np.hstack([parts[0], gap, parts[1], gap, parts[2]])


def sheet() -> NDArray[np.uint8]:
    """Twelve models with no setting but the ground, four in a row."""
    pictures = []
    with gs.Renderer() as renderer:
        for name, up in TWELVE:
            scene = gs.load(MODELS / name, ground=True, up_axis=up)
            pictures.append(renderer.render(scene, size=(320, 240), samples=16, outputs=("image",)).image)
    return np.vstack([np.hstack(pictures[k : k + 4]) for k in range(0, len(pictures), 4)])


def main() -> None:
    warnings.simplefilter("ignore", gs.GlshadowWarning)
    OUT.mkdir(parents=True, exist_ok=True)
    image.write(OUT / "truth_ours_error.png", courtyard())
    image.write(OUT / "twelve.jpg", sheet())
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
        runpy.run_path(str(ROOT / "examples" / "09_exact.py"))
        shutil.copy("09_exact.png", OUT / "exact.png")
    for name, target in (("flight_helmet/flight_helmet.gltf", None), ("japanese_bridge_garden.glb", (0.0, -1.0, 0.0))):
        scene = gs.load(MODELS / name, ground=True)
        camera = scene.camera
        if target is not None:  # closer than the default, which leaves space for every aspect ratio
            position = np.asarray(camera.target) + 0.72 * (np.asarray(camera.position) - np.asarray(camera.target))
            camera = gs.PerspectiveCamera(tuple(position), camera.target)
        gs.render(scene, camera, size=(640, 480), samples=16, path=OUT / f"{Path(name).stem}.png")


if __name__ == "__main__":
    main()
