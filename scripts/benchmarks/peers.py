"""Compares pyrender and Embree with glshadow: one scene, camera, light and size, timed in turn in one process, read-back included.

Every image is scored by `gs.measure` against the same reference. pyrender does not output visibility; it is computed as the ratio of its
images with and without shadows (ambient light off, gamma undone), with its default map size and a larger one. Programs that are missing
or fail are left out, with the reason.
"""

from __future__ import annotations

import json
import os
import time
import warnings
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass, field, replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import click
import numpy as np
from numpy.typing import NDArray

import glshadow as gs
from glshadow.core.spaces import view_axes
from glshadow.study.floor import Floor
from glshadow.study.remembered import RememberedTruth

SIZE = (1280, 720)
WARM_UP = 2
GAMMA = 2.2  # pyrender's own, its shaders/mesh.frag


@dataclass
class Row:
    """One technique: the timed frame, the same frame without shadows, and its visibility (H, W)."""

    name: str
    draw: Callable[[int], Any]
    plain: Callable[[int], Any] | None = None
    visibility: Callable[[], NDArray[np.float32]] | None = None
    shadow: gs.Shadow = field(default_factory=gs.Shadow)


def turned(light: gs.DirectionalLight, k: int) -> gs.DirectionalLight:
    """The directional light in round k: it moves, so that nothing from the last round can be reused."""
    (x, y, z), a = light.direction, 0.002 * k
    return replace(light, direction=(x * np.cos(a) - z * np.sin(a), y, x * np.sin(a) + z * np.cos(a)))


def glshadow_rows(stack: ExitStack, scene: gs.Scene, sun: gs.DirectionalLight) -> list[Row]:
    """One renderer each: a shared one would allocate its map again whenever the resolution changes."""

    def row(name: str, shadow: gs.Shadow, samples: int = 1) -> Row:
        renderer = stack.enter_context(gs.Renderer())

        def draw(k: int, shadow: gs.Shadow | None = shadow) -> Any:
            light = replace(turned(sun, k), shadow=shadow)
            return renderer.render(scene, None, [light], SIZE, outputs=("image",), samples=samples)

        def visibility() -> NDArray[np.float32]:
            frame = renderer.render(
                scene, None, [replace(sun, shadow=shadow)], SIZE, outputs=("visibility",), samples=samples
            )
            return frame.visibility[0]

        scored_one = visibility if samples == 1 else None  # the reference has one sample
        return Row(f"glshadow, {name}", draw, lambda k: draw(k, None), scored_one, shadow)

    return [
        row("Exact(), the default", gs.Shadow()),
        row("Exact(), 4 samples a pixel", gs.Shadow(), samples=4),
        row("Pcf(1), 2048", gs.Shadow(filter=gs.Pcf(1))),
        row("Pcf(1), 4096", gs.Shadow(filter=gs.Pcf(1), resolution=4096)),
    ]


def floor_row(renderer: gs.Renderer, floor: Floor, scene: gs.Scene, sun: gs.DirectionalLight, rounds: range) -> Row:
    mapped = replace(sun, shadow=gs.Shadow(filter=gs.Pcf(1)))  # the depth pass of the floor is that of a map
    frames = {
        k: replace(renderer.render(scene, None, [turned(mapped, k)], SIZE, outputs=("image",)), outputs={})
        for k in rounds
    }
    return Row("floor: Lambert + depth pass", lambda k: floor.draw(frames[k]))


def embree_row(scene: gs.Scene, sun: gs.DirectionalLight) -> Row:
    def draw(k: int) -> gs.Truth:
        return gs.trace(scene, None, [turned(sun, k)], SIZE, samples=1)

    return Row(
        "Embree, one ray a pixel (gs.trace)",
        draw,
        None,
        lambda: gs.trace(scene, None, [sun], SIZE, samples=1).visibility[0],
    )


def pyrender_module() -> Any:
    """Import pyrender 0.1.45, which supports neither numpy 2 nor our platform setting."""
    os.environ.setdefault("PYOPENGL_PLATFORM", "egl")
    for name, value in (("infty", np.inf), ("float", float), ("int", int), ("bool", bool)):
        if name not in vars(np):
            setattr(np, name, value)  # names that numpy has removed
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        import pyrender

    return pyrender


def pose(axes: NDArray[np.float64], position: Any) -> NDArray[np.float64]:
    """world_from_node, from rows x, y, z (backward)."""
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = axes.T, position
    return matrix


def pyrender_scene(pyrender: Any, scene: gs.Scene, sun: gs.DirectionalLight) -> tuple[Any, Any]:
    """The same triangles, white and rough, with the same camera and directional light; and the light's node."""
    import trimesh

    there = pyrender.Scene(ambient_light=(0.0, 0.0, 0.0), bg_color=(0.0, 0.0, 0.0, 1.0))
    material = pyrender.MetallicRoughnessMaterial(
        baseColorFactor=(1.0, 1.0, 1.0, 1.0), metallicFactor=0.0, roughnessFactor=1.0
    )
    for node in scene.nodes:
        mesh = trimesh.Trimesh(
            node.mesh.positions, node.mesh.triangles, vertex_normals=node.mesh.normals, process=False, validate=False
        )
        smooth = node.mesh.normals is not None
        there.add(pyrender.Mesh.from_trimesh(mesh, material=material, smooth=smooth), pose=node.world_from_mesh)
    camera = scene.camera
    eye = pyrender.PerspectiveCamera(
        yfov=float(np.radians(camera.fov_y)), aspectRatio=SIZE[0] / SIZE[1], znear=0.1, zfar=100.0
    )
    there.add(eye, pose=np.linalg.inv(camera.view_from_world))
    light = there.add(
        pyrender.DirectionalLight(intensity=2.0), pose=pose(view_axes(np.asarray(sun.direction)), (0, 0, 0))
    )
    return there, light


def pyrender_row(scene: gs.Scene, sun: gs.DirectionalLight, resolution: int) -> Row:
    """pyrender with its directional shadow; raises an error if the installation does not work."""
    pyrender = pyrender_module()
    delivered = pyrender.constants.SHADOW_TEX_SZ
    pyrender.light.SHADOW_TEX_SZ = pyrender.renderer.SHADOW_TEX_SZ = resolution
    there, light = pyrender_scene(pyrender, scene, sun)
    offscreen = pyrender.OffscreenRenderer(*SIZE)

    def draw(k: int, shadows: bool = True) -> NDArray[np.uint8]:
        pyrender.light.SHADOW_TEX_SZ = pyrender.renderer.SHADOW_TEX_SZ = resolution
        there.set_pose(light, pose(view_axes(np.asarray(turned(sun, k).direction)), (0, 0, 0)))
        flags = pyrender.RenderFlags.SHADOWS_DIRECTIONAL if shadows else pyrender.RenderFlags.NONE
        image: NDArray[np.uint8] = offscreen.render(there, flags=flags)[0]
        return image

    def visibility() -> NDArray[np.float32]:
        dark, lit = ((draw(0, shadows)[..., 0] / 255.0) ** GAMMA for shadows in (True, False))
        seen = offscreen.render(there, flags=pyrender.RenderFlags.DEPTH_ONLY) > 0.0
        share = np.where(lit > 0.0, dark / np.where(lit > 0.0, lit, 1.0), 0.0)
        return np.where(seen, np.clip(share, 0.0, 1.0), np.nan).astype(np.float32)

    draw(0)  # raises errors before timing starts
    what = "as delivered" if resolution == delivered else "map raised"
    shadow = gs.Shadow(filter=gs.Pcf(1), resolution=resolution)  # its filter too is 3 x 3 bilinear comparisons
    return Row(
        f"pyrender {pyrender.__version__}, {resolution}, {what}, 4 samples a pixel",
        draw,
        lambda k: draw(k, False),
        visibility,
        shadow,
    )


def timed(rows: list[Row], repeats: int, clock: Callable[[], float]) -> dict[str, dict[str, float]]:
    """Median milliseconds with and without shadows, and the ratio to the floor of the same round."""
    jobs = {(row.name, "ms"): row.draw for row in rows}
    jobs |= {(row.name, "without_ms"): row.plain for row in rows if row.plain is not None}
    times: dict[tuple[str, str], list[float]] = {key: [] for key in jobs}
    for k in range(-WARM_UP, repeats):
        for key, job in jobs.items():
            start = clock()
            job(k)
            if k >= 0:
                times[key].append(1e3 * (clock() - start))
    floor = np.array(times[rows[0].name, "ms"])
    results: dict[str, dict[str, float]] = {row.name: {} for row in rows}
    for (name, what), values in times.items():
        results[name][what] = float(np.median(values))
        if what == "ms":
            results[name]["cost"] = float(np.median(np.array(values) / floor))
    return results


def scored(row: Row, truth: gs.Truth, sun: gs.DirectionalLight) -> dict[str, float]:
    """The error of a row's visibility; empty for a row without shadows."""
    if row.visibility is None:
        return {}
    frame = SimpleNamespace(visibility=row.visibility()[None], scene=truth.scene, camera=truth.camera,
                            lights=(replace(sun, shadow=row.shadow),))  # fmt: skip
    score = gs.measure(frame, truth)
    return {
        name: float(getattr(score, name)) for name in ("wrong", "edge", "acne", "leak", "grain", "mean", "all_wrong")
    }


def build_ms(scene: gs.Scene) -> float:
    """Time to build Embree's tree: a new scene, one pixel."""
    fresh = replace(scene, name="fresh")
    start = time.perf_counter()
    gs.trace(fresh, size=(1, 1))
    return 1e3 * (time.perf_counter() - start)


@click.command(help=__doc__)
@click.option("--repeats", default=9, show_default=True, type=click.IntRange(1), help="Rounds.")
@click.option(
    "--processor-time",
    is_flag=True,
    help="Of all threads of this process: where OpenGL runs on a CPU that others use too.",
)
@click.option("--json", "output", type=click.Path(path_type=Path), help="Write all figures there.")
def main(repeats: int, processor_time: bool, output: Path | None) -> None:
    warnings.simplefilter("ignore", gs.GlshadowWarning)
    scene = gs.scenes.courtyard()
    sun = scene.lights[0]
    assert isinstance(sun, gs.DirectionalLight)
    truth = RememberedTruth.of(gs.trace(scene, None, [sun], SIZE, samples=1))
    missing: dict[str, str] = {}
    with ExitStack() as stack:
        renderer = stack.enter_context(gs.Renderer())
        floor = stack.enter_context(Floor(renderer, scene, SIZE))
        rows = [floor_row(renderer, floor, scene, sun, range(-WARM_UP, repeats)), *glshadow_rows(stack, scene, sun)]
        for resolution in (2048, 4096):
            try:
                rows.append(pyrender_row(scene, sun, resolution))
            except Exception as error:  # an import, a driver, a version: the table shows any error
                missing[f"pyrender, {resolution}"] = f"{type(error).__name__}: {error}"
        rows.append(embree_row(scene, sun))
        results = timed(rows, repeats, time.process_time if processor_time else time.perf_counter)
        for row in rows:
            results[row.name] |= scored(row, truth, sun)
    results[rows[-1].name]["build_ms"] = build_ms(scene)
    click.echo(f"courtyard, {SIZE[0]} x {SIZE[1]}, {renderer.info['renderer']}, {repeats} rounds")
    click.echo(f"{'':36s} {'wrong %':>9s} {'mean':>8s} {'ms':>8s} {'without':>8s} {'x floor':>8s}")
    for name, row_result in results.items():
        cells = [
            f"{100 * row_result['wrong']:9.4f} {row_result['mean']:8.5f}" if "wrong" in row_result else f"{'':18s}",
            f"{row_result['ms']:8.1f}",
            f"{row_result['without_ms']:8.1f}" if "without_ms" in row_result else f"{'':8s}",
            f"{row_result['cost']:8.2f}",
        ]
        build = f"   tree: {row_result['build_ms']:.0f} ms more" if "build_ms" in row_result else ""
        click.echo(f"{name:36s} {' '.join(cells)}{build}")
    for name, reason in missing.items():
        click.echo(f"{name}: left out, {reason}")
    if output:
        output.write_text(json.dumps({"results": results, "missing": missing}, indent=1) + "\n")


if __name__ == "__main__":
    main()
