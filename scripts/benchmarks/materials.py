"""Compares materials with three.js in a headless Chromium: 30 generated ones on spheres, and the glTF models.

One directional light without shadow, no ambient light, linear light; MeshStandardMaterial by GLTFLoader, the same cameras. Prints mean and
largest difference of 255 levels away from edges. `--three` is the folder of the npm package `three`: npm install three.
"""

from __future__ import annotations

import json
import subprocess
import tempfile
import threading
import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from itertools import product
from pathlib import Path
from shutil import which
from typing import Any

import click
import numpy as np
from frame import models_in

import glshadow as gs
from glshadow.core.spaces import Array
from tests.scene.glb import Glb

SIZE = (640, 480)
DIRECTION = (-0.5, -0.75, -0.6)
PAGE = Path(__file__).with_suffix(".html")
WAIT_S = 900.0
LEVELS = 255.0


@dataclass(frozen=True)
class Case:
    """One file and how it is seen."""

    name: str
    file: Path
    camera: gs.PerspectiveCamera

    def told(self, root: str, extent: float) -> dict[str, Any]:
        """For materials.html."""
        camera = self.camera
        distance = float(np.linalg.norm(np.subtract(camera.position, camera.target)))
        return {
            "name": self.name, "file": root, "width": SIZE[0], "height": SIZE[1], "light": DIRECTION, "intensity": 1.0,
            "fov": camera.fov_y, "eye": camera.position, "target": camera.target, "up": camera.up,
            "near": 1e-3 * distance, "far": distance + 4.0 * extent,
        }  # fmt: skip


def picture(pixels: Array) -> bytes:
    """A PNG of colours (H, W, 3) in 0..1, stored as they are."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "texels.png"
        gs.image.write(path, np.rint(np.clip(pixels, 0.0, 1.0) * 255.0).astype(np.uint8))
        return path.read_bytes()


def waves() -> Array:
    """A normal map (64, 64, 3) of soft bumps that repeats."""
    y, x = (np.mgrid[0:64, 0:64] + 0.5) / 64.0 * 2.0 * np.pi
    slopes = -0.6 * np.cos(x) * np.sin(y), 0.6 * np.sin(x) * np.cos(y)
    normals = np.stack([*slopes, np.ones_like(x)], axis=-1)
    return 0.5 + 0.5 * normals / np.linalg.norm(normals, axis=-1, keepdims=True)


def generated() -> Iterator[tuple[str, dict[str, Any], list[Array]]]:
    """Name, glTF material and textures of 30 materials."""
    colors = {"white": (1, 1, 1), "copper": (0.95, 0.64, 0.54), "blue": (0.05, 0.1, 0.6)}
    for (color, rgb), metallic, roughness in product(colors.items(), (0.0, 0.5, 1.0), (0.2, 0.5, 0.9)):
        block = {"baseColorFactor": [*rgb, 1.0], "metallicFactor": metallic, "roughnessFactor": roughness}
        yield f"{color}_m{metallic:g}_r{roughness:g}", {"pbrMetallicRoughness": block}, []
    half = {"baseColorFactor": [0.6, 0.5, 0.4, 1.0], "metallicFactor": 0.5, "roughnessFactor": 0.6}
    yield "normal_map", {"pbrMetallicRoughness": half, "normalTexture": {"index": 0}}, [waves()]
    yield "occlusion", {"pbrMetallicRoughness": half, "occlusionTexture": {"index": 0}}, [waves()]
    lamp = {"pbrMetallicRoughness": half, "emissiveFactor": [0.3, 0.2, 0.1], "emissiveTexture": {"index": 0}}
    yield "emissive", lamp, [waves()]


def sphere(folder: Path, name: str, material: dict[str, Any], textures: list[Array]) -> Case:
    """The file of a sphere with texture coordinates."""
    rows, columns = 64, 128
    v, u = np.meshgrid(np.linspace(0.0, 1.0, rows + 1), np.linspace(0.0, 1.0, columns + 1), indexing="ij")
    theta, phi = np.pi * v, 2.0 * np.pi * u
    points = np.stack([np.sin(theta) * np.sin(phi), np.cos(theta), np.sin(theta) * np.cos(phi)], axis=-1)
    corner = np.arange(rows)[:, None] * (columns + 1) + np.arange(columns)
    a, b, c, d = corner, corner + columns + 1, corner + columns + 2, corner + 1
    triangles = np.concatenate(
        [np.stack([a, b, c], axis=-1).reshape(-1, 3), np.stack([a, c, d], axis=-1).reshape(-1, 3)]
    )
    glb, points = Glb(), points.reshape(-1, 3)
    uv = np.stack([8.0 * u, 4.0 * v], axis=-1).reshape(-1, 2)
    # three.js derives tangents that are not orthonormal, and so another surface, where the file has none
    along = np.stack([np.cos(phi), np.zeros_like(phi), -np.sin(phi), np.ones_like(phi)], axis=-1).reshape(-1, 4)
    attributes = {"POSITION": points, "NORMAL": points, "TEXCOORD_0": uv, "TANGENT": along}
    bounds = {"min": [-1.0] * 3, "max": [1.0] * 3}
    primitive: dict[str, Any] = {
        "attributes": {key: glb.add(each, **(bounds if key == "POSITION" else {})) for key, each in attributes.items()},
        "indices": glb.add(triangles.ravel(), "uint32"),
        "material": 0,
    }
    glb.json["materials"] = [material]
    if textures:
        views = [glb.view(np.frombuffer(picture(each), np.uint8)) for each in textures]
        glb.json["images"] = [{"bufferView": view, "mimeType": "image/png"} for view in views]
        glb.json["textures"] = [{"source": k} for k in range(len(views))]
    glb.json["nodes"] = [{"mesh": glb.mesh(primitive)}]
    camera = gs.PerspectiveCamera((0.8, 0.9, 3.2), (0.0, 0.0, 0.0), fov_y=38.0)
    return Case(name, glb.save(folder / f"{name}.glb"), camera)


def models(folder: Path) -> Iterator[Case]:
    """The glTF models, each seen by its scene's default camera."""
    for path in sorted([*folder.glob("*.glb"), *folder.glob("*/*.gltf")]):
        if path.parent.name != "hostile":
            scene = gs.load(path, look="plain")
            camera = gs.Scene(scene.nodes).camera
            assert isinstance(camera, gs.PerspectiveCamera)
            yield Case(path.stem, path, camera)


class Handler(SimpleHTTPRequestHandler):
    """Serves the page, the files and three.js; takes the pixels."""

    def __init__(self, *arguments: Any, drawn: dict[str, bytes], places: dict[str, Path], **more: Any) -> None:
        self.drawn, self.places = drawn, places
        super().__init__(*arguments, **more)

    def translate_path(self, path: str) -> str:
        """The file of a URL: `/KEY/REST` lies below the folder of the key."""
        _, key, *rest = path.split("?")[0].split("/")
        place = self.places.get(key)
        return str(place.joinpath(*rest) if place is not None else Path("/nowhere"))

    def do_POST(self) -> None:
        """Keep what the page sends."""
        body = self.rfile.read(int(self.headers["Content-Length"]))
        self.drawn[self.path.strip("/")] = body
        self.send_response(204)
        self.end_headers()

    def log_message(self, format: str, *arguments: Any) -> None:
        """Be silent."""


def drawn_by_three(cases: list[Case], three: Path, folder: Path) -> tuple[dict[str, bytes], str]:
    """Float pixels of each case, by its name, and the version."""
    program = which("chromium") or which("chromium-browser") or which("google-chrome")
    if program is None:
        raise click.UsageError("Chromium is missing")
    places = {"": PAGE, "three": three}
    told = []
    for case in cases:
        places[f"of_{case.name}"] = case.file.parent
        extent = float(np.ptp(gs.load(case.file, look="plain").extent, axis=0).max())
        told.append(case.told(f"/of_{case.name}/{case.file.name}", extent))
    (folder / "cases.json").write_text(json.dumps(told))
    places["cases.json"] = folder / "cases.json"
    drawn: dict[str, bytes] = {}
    server = ThreadingHTTPServer(("127.0.0.1", 0), partial(Handler, drawn=drawn, places=places))
    threading.Thread(target=server.serve_forever, daemon=True).start()
    command = [
        program, "--headless", "--no-sandbox", "--disable-gpu-sandbox", "--use-angle=swiftshader",
        "--enable-unsafe-swiftshader", f"--user-data-dir={folder / 'profile'}", f"http://127.0.0.1:{server.server_port}/",
    ]  # fmt: skip
    with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as browser:
        waiting = threading.Event()
        for _ in range(int(WAIT_S / 0.25)):
            if "done" in drawn or browser.poll() is not None:
                break
            waiting.wait(0.25)
        browser.terminate()
    server.shutdown()
    failed = {name: text.decode() for name, text in drawn.items() if name.startswith("failed/")}
    if failed or "done" not in drawn:
        raise click.ClickException(f"three.js: {failed or 'no answer'}")
    return {name.removeprefix("drawn/"): body for name, body in drawn.items()}, drawn["done"].decode()


def inner(frame: gs.Frame, seen: Array) -> Array:
    """Pixels (H, W) away from edges: both show a surface in the 5 by 5 pixels around, of one node, whose depth changes evenly."""
    height, width = frame.node.shape
    kept = np.zeros((height, width), dtype=bool)
    core = slice(2, -2)
    kept[core, core] = True
    with np.errstate(invalid="ignore", divide="ignore"):
        inverse = np.where(np.isfinite(frame.depth), 1.0 / frame.depth.astype(np.float64), 0.0)
    for dy, dx in product(range(-2, 3), range(-2, 3)):
        here = slice(2 + dy, height - 2 + dy), slice(2 + dx, width - 2 + dx)
        there = slice(2 - dy, height - 2 - dy), slice(2 - dx, width - 2 - dx)
        kept[core, core] &= (frame.node[here] == frame.node[core, core]) & (frame.node[here] >= 0) & seen[here]
        bend = np.abs(inverse[here] + inverse[there] - 2.0 * inverse[core, core])
        kept[core, core] &= bend < 2e-3 * inverse[core, core]
    return kept


@click.command(help=__doc__)
@click.option(
    "--three",
    type=click.Path(exists=True, file_okay=False, path_type=Path),
    required=True,
    help="Folder of the package.",
)
@click.option("--models", "folder", type=click.Path(exists=True, path_type=Path), help="Folder of the models.")
@click.option("--json", "result", type=click.Path(path_type=Path), help="Write the numbers there.")
@click.option(
    "--pictures", type=click.Path(file_okay=False, path_type=Path), help="Write both pictures, side by side, there."
)
def main(three: Path, folder: Path | None, result: Path | None, pictures: Path | None) -> None:
    warnings.simplefilter("ignore", gs.GlshadowWarning)
    found = models_in(folder)
    rows: dict[str, dict[str, float]] = {}
    light = gs.DirectionalLight(direction=DIRECTION, shadow=None)
    with tempfile.TemporaryDirectory() as name, gs.Renderer() as renderer:
        work = Path(name)
        cases = [sphere(work, *each) for each in generated()] + (list(models(found)) if found else [])
        theirs, version = drawn_by_three(cases, three.resolve(), work)
        for case in cases:
            pixels = np.frombuffer(theirs[case.name], np.float32).reshape(SIZE[1], SIZE[0], 4)[::-1]
            frame = renderer.render(
                gs.load(case.file, look="plain"), case.camera, [light], SIZE, ambient=0.0, background=(0, 0, 0), samples=1,
                outputs=("linear", "node", "depth"),
            )  # fmt: skip
            both = [np.clip(each[..., :3], 0.0, 1.0).astype(np.float64) for each in (frame.linear, pixels)]
            kept = inner(frame, pixels[..., 3] > 0.0)
            gap = np.abs(both[0] - both[1])[kept] * LEVELS
            rows[case.name] = {
                "mean": float(gap.mean()),
                "p99": float(np.percentile(gap, 99.0)),
                "pixels": int(kept.sum()),
            }
            click.echo(
                f"{case.name:28} mean {rows[case.name]['mean']:6.3f}  99 % {rows[case.name]['p99']:7.2f}  {kept.sum():7} pixels"
            )
            if pictures is not None:
                pictures.mkdir(parents=True, exist_ok=True)
                shown = np.concatenate([*both, 4.0 * np.abs(both[0] - both[1])], axis=1)
                gs.image.write(
                    pictures / f"{case.name}.png", np.rint(np.clip(shown, 0, 1) ** (1 / 2.2) * 255.0).astype(np.uint8)
                )
    worst = max(rows, key=lambda each: rows[each]["mean"])
    click.echo(
        f"three.js r{version}: {len(rows)} cases, largest mean difference {rows[worst]['mean']:.3f} of 255 ({worst})"
    )
    if result is not None:
        result.write_text(json.dumps({"three": version, "cases": rows}, indent=1))


if __name__ == "__main__":
    main()
