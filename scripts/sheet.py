"""Draws 18 models by glshadow and, each with its own default view and light, by F3D, PyVista and pyrender: one sheet.

Each program runs in a process of its own; --f3d, --pyvista and --pyrender name the Pythons that have them. What one cannot read or draw is
left grey. F3D: ambient occlusion, SSAA, tone map. PyVista: shadows, SSAO, SSAA. pyrender: glshadow's camera and key light, with shadows.
"""

from __future__ import annotations

import importlib.metadata
import json
import subprocess
import sys
import tempfile
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import click

ROOT = Path(__file__).resolve().parents[1]
SIZE = (192, 144)
SAMPLES = 16
UP = {"x": (1, 0, 0), "y": (0, 1, 0), "z": (0, 0, 1)}


def glshadow(path: str, up: str, out: str) -> None:
    import glshadow as gs

    warnings.simplefilter("ignore", gs.GlshadowWarning)
    gs.render(gs.load(path, up_axis=up, ground=None), size=SIZE, samples=SAMPLES, path=out)


def f3d(path: str, up: str, out: str) -> None:
    import f3d as library

    engine = library.Engine.create_egl()
    engine.options.update(
        {"render.effect.ambient_occlusion": True, "render.effect.antialiasing.mode": "ssaa", "render.effect.tone_mapping": True,
         "scene.up_direction": [float(x) for x in UP[up]]}
    )  # fmt: skip
    engine.window.size = SIZE
    engine.scene.add(path)
    engine.window.render_to_image().save(out)


def pyvista(path: str, up: str, out: str) -> None:
    import pyvista as library

    plotter = library.Plotter(off_screen=True, window_size=list(SIZE))
    if path.endswith((".glb", ".gltf")):
        plotter.import_gltf(path)
        plotter.camera_position = "xy"
        plotter.camera.azimuth, plotter.camera.elevation = 35, 20
    else:
        plotter.add_mesh(library.read(path))
        plotter.view_isometric() if up == "z" else plotter.view_vector((0.6, 0.4, 0.75), UP[up])
    plotter.reset_camera()
    plotter.enable_shadows()
    plotter.enable_ssao(kernel_size=64)
    plotter.enable_anti_aliasing("ssaa")
    plotter.screenshot(out)


def pyrender(path: str, up: str, out: str) -> None:
    import numpy as np

    setattr(np, "infty", np.inf)  # noqa: B010  # which pyrender 0.1.45 uses, and numpy 2 does not have
    import pyrender as library
    import trimesh
    from PIL import Image

    import glshadow as gs

    seen = gs.load(path, up_axis=up)
    scene = library.Scene.from_trimesh_scene(
        trimesh.load(path, force="scene"), bg_color=(1, 1, 1, 1), ambient_light=(0.25,) * 3
    )
    turn = np.eye(4)
    turn[:3, :3] = {"y": np.eye(3), "z": [[1, 0, 0], [0, 0, 1], [0, -1, 0]], "x": [[0, -1, 0], [1, 0, 0], [0, 0, 1]]}[
        up
    ]
    camera, key = seen.camera, seen.lights[0]
    light = gs.PerspectiveCamera(tuple(-10 * np.asarray(key.direction)), (0, 0, 0))
    for pose, what in (
        (camera.view_from_world, library.PerspectiveCamera(2 * np.arctan(camera.window(SIZE)[3]))),
        (light.view_from_world, library.DirectionalLight(intensity=3.0)),
    ):
        scene.add(what, pose=np.linalg.inv(turn) @ np.linalg.inv(pose))
    renderer = library.OffscreenRenderer(*SIZE)
    Image.fromarray(renderer.render(scene, flags=library.RenderFlags.SHADOWS_DIRECTIONAL)[0]).save(out)


PROGRAMS: dict[str, Callable[[str, str, str], None]] = {
    each.__name__: each for each in (glshadow, f3d, pyvista, pyrender)
}


def made(folder: Path) -> list[tuple[Path, str]]:
    """The six CAD-like and scanned shapes of `scripts/bench look`, as files."""
    import numpy as np
    import trimesh

    sys.path.insert(0, str(ROOT / "scripts" / "benchmarks"))
    from look import MADE

    import glshadow as gs

    files = []
    for make in MADE:
        nodes = gs.load(make()).nodes
        meshes = []
        for node in nodes:
            places = node.mesh.positions @ node.world_from_mesh[:3, :3].T + node.world_from_mesh[:3, 3]
            if isinstance(node.mesh, gs.Points):
                ball = trimesh.creation.icosphere(1, float(node.mesh.radius[0]))
                meshes += [trimesh.Trimesh(ball.vertices + place, ball.faces, process=False) for place in places[::4]]
            else:
                meshes.append(trimesh.Trimesh(places, node.mesh.triangles, process=False))
        path = folder / f"{make.__name__}.ply"
        trimesh.util.concatenate(meshes).export(path)
        files.append((path, "y"))
    assert np.isfinite([trimesh.load(path).bounds for path, _ in files]).all()
    return files


def draw(python: str, program: str, path: Path, up: str, out: Path) -> str:
    """Draw in another process; what went wrong, in a line."""
    call = [python, "-m", "scripts.sheet", "--draw", json.dumps([program, str(path), up, str(out)])]
    try:
        done = subprocess.run(call, cwd=ROOT, capture_output=True, text=True, timeout=240)
    except subprocess.TimeoutExpired:
        return "it took more than 240 s"
    return "" if out.is_file() else (done.stderr.strip().splitlines() or ["no image"])[-1]


@click.command(help=__doc__)
@click.option("--f3d", default=sys.executable)
@click.option("--pyvista", default=sys.executable)
@click.option("--pyrender", default=sys.executable)
@click.option("--only", help="Only models whose name contains this.")
@click.option(
    "-o", "--output", type=click.Path(path_type=Path), default=ROOT / "examples" / "pictures" / "beside_others.jpg"
)
@click.option("--draw", "one", hidden=True)
def main(one: str | None, only: str | None, output: Path, **pythons: Any) -> None:
    if one is not None:
        program, *rest = json.loads(one)
        PROGRAMS[program](*rest)
        return
    from PIL import Image

    from scripts.pictures import MODELS, TWELVE

    with tempfile.TemporaryDirectory() as folder:
        files = [(MODELS / each.file, each.up) for each in TWELVE] + made(Path(folder))
        files = [each for each in files if only is None or only in each[0].name]
        rows = -(-len(files) // 2)
        sheet = Image.new("RGB", (SIZE[0] * 2 * len(PROGRAMS), SIZE[1] * rows), (128, 128, 128))
        for number, (path, up) in enumerate(files):
            for column, program in enumerate(PROGRAMS):
                out = Path(folder) / f"{number}_{program}.png"
                wrong = draw(pythons.get(program, sys.executable), program, path, up, out)
                if wrong:
                    click.echo(f"{program} {path.name}: {wrong}")
                    continue
                x, y = (number // rows * len(PROGRAMS) + column) * SIZE[0], number % rows * SIZE[1]
                sheet.paste(Image.open(out).convert("RGB"), (x, y))
        sheet.save(output, quality=88)
    for name in ("pyvista", "pyrender"):
        click.echo(f"{name} {importlib.metadata.version(name)}")


if __name__ == "__main__":
    main()
