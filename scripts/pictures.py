"""The README's pictures: the courtyard as truth, ours and error side by side, and two real models with the default camera and sun."""

from __future__ import annotations

import contextlib
import os
import runpy
import shutil
import tempfile
import warnings
from pathlib import Path

import click
import numpy as np
from numpy.typing import NDArray

import glshadow as gs
from glshadow import image

ROOT = Path(__file__).resolve().parents[1]
OUT = ROOT / "examples" / "pictures"
MODELS = Path(os.environ.get("GLSHADOW_MODELS", ROOT.parent / "shared" / "models"))
SKY = (0.80, 0.87, 0.95)


def triptych() -> NDArray[np.uint8]:
    """Truth, ours, error: a detail of the courtyard at the contract's 1280 x 720, three times 420 x 420."""
    scene = gs.scenes.courtyard()
    truth = gs.trace(scene)
    with gs.Renderer() as renderer:
        ours = renderer.render(scene, background=SKY)
        # the same shading with the traced visibility: one light of intensity 1 on white, ambient 0.1
        lit = renderer.render(scene, lights=[gs.DirectionalLight(direction=scene.lights[0].direction, shadow=None)],
                              background=SKY, outputs=("linear",))  # fmt: skip
    exact = np.where(np.isnan(truth.visibility[0])[..., None], lit.linear,
                     0.1 + (lit.linear - 0.1) * np.nan_to_num(truth.visibility[0])[..., None])  # fmt: skip
    value = np.clip(exact, 0.0, 1.0)
    shown = np.where(value <= 0.0031308, 12.92 * value, 1.055 * value ** (1 / 2.4) - 0.055)
    error = gs.measure(ours, truth)
    click.echo(error)
    window = (slice(230, 650), slice(300, 720))
    gap = np.full((420, 10, 3), 255, dtype=np.uint8)
    return np.hstack(
        [np.round(255 * shown).astype(np.uint8)[window], gap, ours.image[window], gap, error.picture()[window]]
    )


def main() -> None:
    warnings.simplefilter("ignore", gs.GlshadowWarning)
    OUT.mkdir(parents=True, exist_ok=True)
    image.write(OUT / "truth_ours_error.png", triptych())
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
        runpy.run_path(str(ROOT / "examples" / "09_exact.py"))
        shutil.copy("09_exact.png", OUT / "exact.png")
    for name, target in (("flight_helmet/flight_helmet.gltf", None), ("japanese_bridge_garden.glb", (0.0, -1.0, 0.0))):
        scene = gs.load(MODELS / name, ground=True)
        camera = scene.camera
        if target is not None:  # closer than the default, which leaves room for every shape of picture
            position = np.asarray(camera.target) + 0.72 * (np.asarray(camera.position) - np.asarray(camera.target))
            camera = gs.PerspectiveCamera(tuple(position), camera.target)
        gs.render(scene, camera, size=(640, 480), background=SKY, path=OUT / f"{Path(name).stem}.png")


if __name__ == "__main__":
    main()
