"""Renders the README's images: the courtyard as reference, rendered and error, and real models with default settings."""

from __future__ import annotations

import contextlib
import os
import runpy
import shutil
import tempfile
import warnings
from dataclasses import dataclass, replace
from pathlib import Path

import click
import numpy as np
from numpy.typing import NDArray

import glshadow as gs
from glshadow import image
from glshadow.triptych import GAP, triptych
from scripts.pages.markdown import table

ROOT = Path(__file__).resolve().parents[1]
OUT = ROOT / "examples" / "pictures"
SAMPLES = 16
PCSS, POINTS, RAYS, SOFT_ANGLE = "Pcss(32, 64)", 64, 1024, 4


@dataclass(frozen=True)
class Model:
    """A model of the sheet: its file, the axis that is up in it, what it shows, who made it, its licence."""

    file: str
    up: str
    shows: str
    maker: str
    licence: str


TWELVE = (
    Model("athlete_robot.stl", "z", "ATHLETE rover", "Caltech/JPL", "Apache-2.0"),
    Model("bicycle.glb", "y", "bicycle", "hugodutra", "CC0"),
    Model("brain_cortex.ply", "z", "cortex", "pycortex", "BSD-2-Clause"),
    Model("cesium_man.glb", "y", "Cesium Man", "Cesium", "CC-BY 4.0"),
    Model("chess_board.glb", "y", "chess board", "Idmental", "CC-BY 4.0"),
    Model("demosthenes_bust.obj", "y", "Demosthenes", "ryanfb", "CC-BY 4.0"),
    Model("dungeon_instances.glb", "y", "dungeon", "Kay Lousberg", "CC0"),
    Model("flight_helmet/flight_helmet.gltf", "y", "Flight Helmet", "Microsoft", "CC0"),
    Model("house_scene.glb", "y", "house", "Sketchfab via PlayCanvas", "CC-BY 4.0"),
    Model("japanese_bridge_garden.glb", "y", "bridge garden", "kristenlee", "CC-BY 4.0"),
    Model("milk_truck.glb", "y", "Milk Truck", "Cesium", "CC-BY 4.0"),
    Model("terrain_jacksboro.ply", "z", "Jacksboro fault", "USGS/NASA", "public domain"),
)
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
    """Twelve models with nothing set but the ground and, for some, the axis that is up; four in a row."""
    images = []
    with gs.Renderer() as renderer:
        for model in TWELVE:
            scene = gs.load(MODELS / model.file, ground=True, up_axis=model.up)
            images.append(renderer.render(scene, size=(320, 240), samples=SAMPLES, outputs=("image",)).image)
    return np.vstack([np.hstack(images[k : k + 4]) for k in range(0, len(images), 4)])


def soft() -> NDArray[np.uint8]:
    """What examples/12_soft.py draws, against more rays."""
    source = (ROOT / "examples" / "12_soft.py").read_text(encoding="utf-8")
    changed = source.replace("light_samples=144", f"light_samples={RAYS}").replace("(300, 200)", "(360, 240)")
    if (
        f"light_samples={RAYS}" not in changed
        or "(360, 240)" not in changed
        or PCSS.replace("Pcss", "gs.Pcss") not in source
    ):
        raise ValueError("examples/12_soft.py has changed: so must this function and the captions")
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
        exec(compile(changed, "12_soft.py", "exec"), {})
        return image.read("12_soft.png")[..., :3]


def captions() -> dict[str, str]:
    """What was run for each image, as the README, docs/soft.md and docs/credits.md say it."""
    turned = ", ".join(model.shows for model in TWELVE if model.up != "y")
    soft = f"""\
a directional light without size, and one of {SOFT_ANGLE} degrees by `{PCSS}` and by `Exact()` with {POINTS} samples of the light.
Below: the reference, {RAYS:,d} rays a pixel, and ten times the errors of the two. `examples/12_soft.py` draws it with 144 rays.*"""
    return {
        "caption courtyard": """\
*Reference by ray tracing | glshadow, one 2048 map with `Pcf(1)` | error: grey agrees, yellow is an edge off by a texel,
red would be acne, blue a leak, green is not valid.*""",
        "caption twelve": f"""\
*`gs.load(model, ground=True)`, {SAMPLES} samples, all else derived; with `up_axis="z"` for {turned}.
[Models and their makers](docs/credits.md).*""",
        "caption soft": f"*Above: the courtyard under {soft}",
        "credits": table(
            ("model", "made by", "licence", "`up_axis`"),
            [(each.shows, each.maker, each.licence, f"`{each.up}`") for each in TWELVE],
        ),
    }


def main() -> None:
    warnings.simplefilter("ignore", gs.GlshadowWarning)
    OUT.mkdir(parents=True, exist_ok=True)
    image.write(OUT / "truth_ours_error.png", courtyard())
    image.write(OUT / "twelve.jpg", sheet())
    image.write(OUT / "soft.jpg", soft())
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
        runpy.run_path(str(ROOT / "examples" / "09_exact.py"))
        shutil.copy("09_exact.png", OUT / "exact.png")
    for name in ("flight_helmet/flight_helmet.gltf", "japanese_bridge_garden.glb"):
        gs.render(
            gs.load(MODELS / name, ground=True), size=(640, 480), samples=SAMPLES, path=OUT / f"{Path(name).stem}.png"
        )


if __name__ == "__main__":
    main()
