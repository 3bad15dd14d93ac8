"""Frame time against the floor: what the same driver needs for a Lambert pass and a depth-only pass of the same scene.

All variants run round-robin in one process, read-back included, with one moving sun; ratios of medians are what counts. The floor
draws the same nodes with the same matrices, culling and sizes, but knows no shadow.
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
from pathlib import Path
from typing import Any

import click
import moderngl
import numpy as np

import glshadow as gs
from glshadow.gl.caster import seen_by
from glshadow.gl.geometry import pack_matrices
from glshadow.renderer import Renderer

SIZE = (1280, 720)
FILTERS = {"hard": gs.Hard(), "default": gs.Pcf(1), "pcf 3": gs.Pcf(3)}
MODELS = (
    ("athlete_robot.stl", "z"), ("bicycle.glb", "y"), ("brain_cortex.ply", "z"), ("cesium_man.glb", "y"),
    ("chess_board.glb", "y"), ("demosthenes_bust.obj", "y"), ("dungeon_instances.glb", "y"),
    ("flight_helmet/flight_helmet.gltf", "y"), ("house_scene.glb", "y"), ("japanese_bridge_garden.glb", "y"),
    ("milk_truck.glb", "y"), ("terrain_jacksboro.ply", "z"),
)  # fmt: skip

LAMBERT = (
    """#version 330 core
in vec3 a_position; in vec3 a_normal; out vec3 v_normal; uniform mat4 u_clip_from_mesh; uniform mat3 u_normal;
void main() { v_normal = u_normal * a_normal; gl_Position = u_clip_from_mesh * vec4(a_position, 1.0); }""",
    """#version 330 core
in vec3 v_normal; uniform vec3 u_light; out vec4 o_color;
void main() { o_color = vec4(vec3(0.1 + 0.9 * max(dot(normalize(v_normal), u_light), 0.0)), 1.0); }""",
)
DEPTH = (
    """#version 330 core
in vec3 a_position; uniform mat4 u_clip_from_mesh;
void main() { gl_Position = u_clip_from_mesh * vec4(a_position, 1.0); }""",
    "#version 330 core\nvoid main() {}",
)


class Floor:
    """A Lambert pass and a depth-only pass in the renderer's own context."""

    def __init__(self, renderer: Renderer, scene: gs.Scene, resolution: int) -> None:
        from glshadow.core.metric import Target
        from glshadow.gl.targets import depth_texture

        self.r, self.scene, self.resolution = renderer, scene, resolution
        context = renderer._context
        with context.drawing():
            ctx = context.ctx
            self.lambert, self.depth = ctx.program(*LAMBERT), ctx.program(*DEPTH)
            self.map = ctx.framebuffer(
                depth_attachment=depth_texture(context, (resolution,) * 2, Target.DEPTH32F, "map")
            )
            self.color = ctx.texture(SIZE, 4)
            self.image = ctx.framebuffer([self.color], depth_texture(context, SIZE, Target.DEPTH32F, "image"))
            self.arrays: dict[int, tuple[Any, Any]] = {}

    def frame(self, light: gs.DirectionalLight, used: Any) -> None:
        """One frame with the matrices of a rendered one."""
        context, gpu_scene = self.r._context, self.r._scene
        assert gpu_scene is not None
        eye = self.r._sight
        assert eye is not None
        view, boxes = used.views[0], self.scene.corners
        with context.drawing():
            ctx = context.ctx
            for program, target, clip, clip_from_world, reversed_depth in (
                (self.depth, self.map, view.clip, view.clip_from_world, view.clip.reversed),
                (
                    self.lambert,
                    self.image,
                    eye.clip,
                    eye.clip_from_view @ self.scene.camera.view_from_world,
                    eye.clip.reversed,
                ),
            ):
                context.gl.clip_control(clip.zero_to_one)
                target.use()
                ctx.enable_only(moderngl.DEPTH_TEST)
                ctx.depth_func = ">=" if reversed_depth else "<="
                ctx.depth_clamp_range = (0.0, 1.0) if target is self.map else None
                target.clear(depth=clip.clear_depth)
                matrices = pack_matrices(clip_from_world @ gpu_scene.world_from_origin)
                seen = (
                    seen_by(view.clip_from_world, boxes, view)
                    if target is self.map
                    else np.ones(len(boxes), dtype=bool)
                )
                if target is self.image:
                    program["u_light"].value = tuple(-np.asarray(light.direction))
                for i in np.flatnonzero(seen):
                    gpu = gpu_scene.meshes[i]
                    if i not in self.arrays:
                        if "a_normal" not in gpu._buffers:
                            gpu._buffers["a_normal"] = ctx.buffer(gpu._averaged_normals()[gpu._order].tobytes())
                        position, normal = gpu._buffers["a_position"], gpu._buffers["a_normal"]
                        self.arrays[i] = (
                            ctx.vertex_array(self.depth, [(position, "3f", "a_position")], gpu._shared),
                            ctx.vertex_array(
                                self.lambert, [(position, "3f", "a_position"), (normal, "3f", "a_normal")], gpu._shared
                            ),
                        )
                    program["u_clip_from_mesh"].write(matrices[i])
                    if target is self.image:
                        normals = np.ascontiguousarray(gpu_scene.normal_from_mesh[i].T, dtype=np.float32)
                        program["u_normal"].write(normals.tobytes())
                    if gpu.closed:
                        ctx.enable(moderngl.CULL_FACE)
                        ctx.cull_face = "front" if gpu_scene.mirrored[i] else "back"
                    else:
                        ctx.disable(moderngl.CULL_FACE)
                    self.arrays[i][0 if target is self.map else 1].render()
            data = np.frombuffer(self.color.read(), np.uint8).reshape(SIZE[1], SIZE[0], 4)
            np.ascontiguousarray(data[::-1])
            self.r._idle.use()


def measure(scene: gs.Scene, repeats: int, filters: dict[str, Any]) -> dict[str, Any]:
    """Medians in ms of the floor and of each filter, round-robin, with a sun that moves every round."""
    with Renderer() as renderer:
        lights = {name: gs.Shadow(filter=kind) for name, kind in filters.items()}
        floor = Floor(renderer, scene, 2048)
        times: dict[str, list[float]] = {"floor": [], **{name: [] for name in filters}}

        def sun(k: int, shadow: gs.Shadow) -> gs.DirectionalLight:
            angle = 0.002 * k
            x, y, z = (
                scene.lights[0].direction if isinstance(scene.lights[0], gs.DirectionalLight) else (-0.55, -0.8, -0.25)
            )
            turned = (x * np.cos(angle) - z * np.sin(angle), y, x * np.sin(angle) + z * np.cos(angle))
            return gs.DirectionalLight(direction=turned, shadow=shadow)

        for k in range(-2, repeats):
            jobs: dict[str, Callable[[], Any]] = {
                name: (lambda k=k, s=shadow: renderer.render(scene, None, [sun(k, s)], SIZE, outputs=("image",)))
                for name, shadow in lights.items()
            }
            used = renderer.render(scene, None, [sun(k, gs.Shadow())], SIZE, outputs=("image",)).used[0]
            jobs = {"floor": lambda k=k, u=used: floor.frame(sun(k, gs.Shadow()), u), **jobs}
            for name, job in jobs.items():
                start = time.perf_counter()
                job()
                if k >= 0:
                    times[name].append(1e3 * (time.perf_counter() - start))
        triangles = sum(len(node.mesh.triangles) for node in scene.nodes)
    row: dict[str, Any] = {"triangles": triangles, "nodes": len(scene.nodes)}
    for name, values in times.items():
        row[name] = {"median_ms": float(np.median(values)), "min_ms": min(values), "max_ms": max(values)}
        # the ratio inside each round, which slow phases of the machine hit alike
        row[name]["ratio"] = float(np.median(np.array(values) / np.array(times["floor"])))
    return row


def profile(scene: gs.Scene, repeats: int) -> dict[str, float]:
    """Median ms per pass of the default frame."""
    with Renderer() as renderer:
        passes: list[dict[str, float]] = []
        for k in range(repeats + 2):
            timings = renderer.render(scene, size=SIZE, outputs=("image", "timings")).timings
            assert timings is not None
            if k > 1:
                passes.append(dict(timings))
    return {name: 1e3 * float(np.median([each[name] for each in passes])) for name in passes[0]}


def start_up(model: Path, repeats: int) -> dict[str, Any]:
    """Seconds of `glshadow render MODEL` from process start to the PNG on disk, warm shader cache, and where they go."""
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
    return gs.Scene((gs.Node("all", mesh, np.eye(4)),), scene.camera, scene.lights)


def plain(scene: gs.Scene) -> gs.Scene:
    """The scene without textures and shading normals, so that it differs from `one_draw` by its draws alone."""
    meshes = {id(n.mesh): gs.Mesh(n.mesh.positions, n.mesh.triangles) for n in scene.nodes}
    nodes = tuple(gs.Node(n.name, meshes[id(n.mesh)], n.world_from_mesh) for n in scene.nodes)
    return gs.Scene(nodes, scene.camera, scene.lights)


@click.command(help=__doc__)
@click.option("--models", "folder", type=click.Path(exists=True, path_type=Path), help="Folder of the 12 models.")
@click.option("--repeats", default=15, show_default=True, help="Rounds per scene.")
@click.option("--profile", "profiled", is_flag=True, help="Also the time of each pass.")
@click.option("--json", "output", type=click.Path(path_type=Path), help="Write all figures there.")
@click.option("--only", help="Only scenes whose name contains this.")
def main(folder: Path | None, repeats: int, profiled: bool, output: Path | None, only: str | None) -> None:
    warnings.simplefilter("ignore", gs.GlshadowWarning)
    default = Path(os.environ.get("GLSHADOW_MODELS", Path(__file__).resolve().parents[3] / "shared" / "models"))
    folder = folder or (default if default.is_dir() else None)
    results: dict[str, Any] = {}
    click.echo(
        f"{'scene':34s} {'triangles':>9s} {'floor ms':>9s} " + " ".join(f"{name + ' x':>10s}" for name in FILTERS)
    )
    scenes: list[tuple[str, Callable[[], gs.Scene]]] = [("courtyard", gs.scenes.courtyard)]
    if folder:
        scenes += [(name, lambda n=name, u=up: gs.load(folder / n, up_axis=u)) for name, up in MODELS]
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
        scene = plain(gs.load(folder / "dungeon_instances.glb"))
        merged = one_draw(scene)
        many, one = (measure(each, repeats, {"default": gs.Pcf(1)})["default"]["median_ms"] for each in (scene, merged))
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
