"""The exact filter: wrong pixels against float64 and traced rays, and its time against maps, the floor and Embree.

Parts: `wrong` (pixels that differ from Embree at the same surface points, and which of the two is right by float64 brute force; and the
error according to `gs.measure`), `moving` (a light that moves every frame: exact frame over the default 3 x 3 frame), `still` (a fixed
light and a moving camera), `build` (list build over the depth-only pass of a 2048 map), `embree` (shadow rays), `growth`
(triangles, lights, map sizes) and `samples` (antialiasing). Ratios are medians of rounds in one process, variants taking turns.
"""

from __future__ import annotations

import json
import time
import warnings
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import click
import numpy as np
from frame import MODELS, SIZE, models_in, one_draw

import glshadow as gs
from glshadow.core.spaces import Array
from glshadow.gl.techniques import Listed
from glshadow.gl.techniques.triangles import rounding_bound
from glshadow.scoring.score import Outcome
from glshadow.study.floor import Floor
from tests.exact import brute

PARTS = ("wrong", "moving", "still", "build", "embree", "growth", "samples")
EXACT = gs.Shadow(filter=gs.Exact())
STEP = 1e-3  # change of a moving light's position or direction from round to round


def lights_of(name: str, scene: gs.Scene) -> dict[str, gs.Light]:
    """A directional, a spot and a point light."""
    if name == "courtyard":
        return {
            "sun": gs.DirectionalLight(),
            "spot": gs.SpotLight(
                position=(6.0, 7.0, 5.0), direction=(-6.0, -7.0, -5.0), inner_angle=30, outer_angle=35
            ),
            "point": gs.PointLight(position=(0.5, 2.2, 0.8)),
        }
    low, high = scene.bounds
    middle, size = 0.5 * (low + high), float(np.linalg.norm(high - low))
    above, beside = middle + size * np.array([0.45, 0.75, 0.3]), middle + size * np.array([0.3, 0.35, 0.5])
    away = tuple(float(x) for x in middle - above)
    return {
        "sun": scene.lights[0],
        "spot": gs.SpotLight(position=tuple(above), direction=away, inner_angle=30, outer_angle=35),
        "point": gs.PointLight(position=tuple(beside)),
    }


def moved(light: gs.Light, k: int) -> gs.Light:
    """The light moved slightly."""
    name = "direction" if isinstance(light, gs.DirectionalLight) else "position"
    old = np.asarray(getattr(light, name))
    return replace(light, **{name: tuple(old + STEP * k * np.abs(old).max() * np.array([1.0, 0.0, -0.5]))})


def alternate(jobs: dict[str, Callable[[int], Any]], rounds: int) -> dict[str, Array]:
    """Seconds (rounds,) of each job, taking turns; two earlier rounds are not counted."""
    times: dict[str, list[float]] = {name: [] for name in jobs}
    for k in range(-2, rounds):
        for name, job in jobs.items():
            time.sleep(0.02)  # Embree's threads keep spinning for a while
            start = time.perf_counter()
            job(k)
            if k >= 0:
                times[name].append(time.perf_counter() - start)
    return {name: np.array(values) for name, values in times.items()}


def ratio(above: Array, below: Array) -> float:
    """Median of the ratios inside each round: slow phases of the machine affect both alike."""
    return float(np.median(above / below))


def wrong(name: str, scene: gs.Scene, results: dict[str, Any]) -> None:
    with gs.Renderer() as renderer:
        for kind, light in lights_of(name, scene).items():
            lamp = replace(light, shadow=EXACT)
            frame = renderer.render(scene, None, [lamp], SIZE, outputs=("visibility", "triangle"), samples=1)
            same = gs.trace(scene, None, [lamp], SIZE, surface=frame.triangle, samples=1)
            # outside a spot's cone there is no light that could be shadowed
            disputed = np.flatnonzero(same.reached[0] & (np.abs(frame.visibility[0] - same.visibility[0]) > 0.5))
            rays = same.rays
            assert renderer._cache.scene.thing is not None
            assert renderer._cache.camera_view is not None
            source = renderer._cache.techniques[0, "Listed"]
            assert isinstance(source, Listed)
            bound = rounding_bound(renderer._cache.scene.thing, renderer._cache.camera_view[1], source.grid)
            points = same.position.reshape(-1, 3)[disputed] - rays.origin
            dark = brute.blocked(rays, lamp, same.triangle.ravel()[disputed], points, bound)
            right = (same.cosine[0].ravel()[disputed] > 0.0) & ~dark
            ours = int((np.abs(frame.visibility[0].ravel()[disputed] - right) > 0.5).sum())
            truth = gs.trace(scene, None, [lamp], SIZE, samples=1)
            error = gs.measure(frame, truth)
            row = {
                "pixels": int(same.reached[0].sum()), "ours": ours, "embree": len(disputed) - ours,
                "counted_wrong": error.wrong, "other_triangle": int((truth.triangle != frame.triangle).sum()),
            }  # fmt: skip
            results[f"{name} {kind}"] = row
            click.echo(
                f"{name:34s} {kind:6s} {row['pixels']:8d} pixels: wrong against float64: exact {ours:2d}, Embree "
                f"{row['embree']:3d}; counted wrong {error.wrong:.4%}; {row['other_triangle']} pixels show another triangle"
            )


def moving(name: str, scene: gs.Scene, rounds: int, results: dict[str, Any]) -> None:
    with gs.Renderer() as maps, gs.Renderer() as exact:

        def frame(renderer: gs.Renderer, light: gs.Light, shadow: gs.Shadow, k: int) -> gs.Frame:
            return renderer.render(
                scene, None, [replace(moved(light, k), shadow=shadow)], SIZE, outputs=("image",), samples=1
            )

        for kind, light in lights_of(name, scene).items():
            times = alternate(
                {
                    "map": lambda k, light=light: frame(maps, light, gs.Shadow(), k),
                    "exact": lambda k, light=light: frame(exact, light, EXACT, k),
                },
                rounds,
            )
            row = {f"{key}_ms": 1e3 * float(np.median(value)) for key, value in times.items()}
            row["ratio"] = ratio(times["exact"], times["map"])
            results[f"{name} {kind}"] = row
            click.echo(
                f"{name:34s} {kind:6s} default {row['map_ms']:6.1f} ms, exact {row['exact_ms']:6.1f} ms: {row['ratio']:.2f} x"
            )


def still(rounds: int, results: dict[str, Any]) -> None:
    scene = gs.scenes.courtyard()
    camera = scene.camera
    settings = {
        "exact": EXACT,
        "hard": gs.Shadow(filter=gs.Hard(), fit=gs.SceneFit()),
        "default": gs.Shadow(fit=gs.SceneFit()),
    }
    draws: list[int] = []
    with gs.Renderer() as renderer, Floor(renderer, scene, SIZE, 2048) as floor:
        made = renderer.render(scene, size=SIZE, samples=1)
        renderers = {name: gs.Renderer() for name in settings}

        def walk(name: str, k: int) -> None:
            x, y, z = camera.position
            seen = replace(camera, position=(x + 0.001 * k, y, z))
            light = gs.DirectionalLight(shadow=settings[name])
            frame = renderers[name].render(scene, seen, [light], SIZE, outputs=("image",), samples=1)
            if k >= 0:
                draws.append(frame.used[0].draws)

        jobs: dict[str, Callable[[int], Any]] = {"floor": lambda _: floor.draw(made)}
        jobs |= {name: (lambda k, name=name: walk(name, k)) for name in settings}
        times = alternate(jobs, rounds)
        for each in renderers.values():
            each.release()
    for name in settings:
        results[name] = ratio(times[name], times["floor"])
    results["draws"] = sum(draws)
    click.echo(
        "courtyard, moving camera: " + ", ".join(f"{name} {results[name]:.2f}" for name in settings)
        + f" x floor; shadow passes and list builds in {len(draws)} frames: {sum(draws)}"
    )  # fmt: skip


def build(name: str, scene: gs.Scene, rounds: int, results: dict[str, Any]) -> None:
    for kind, light in lights_of(name, scene).items():
        with gs.Renderer() as maps, gs.Renderer() as exact:
            spent: dict[str, list[float]] = {"map": [], "exact": []}
            links = 0
            for k in range(-2, rounds):
                for key, renderer, shadow in (("map", maps, gs.Shadow()), ("exact", exact, EXACT)):
                    lamp = replace(moved(light, k), shadow=shadow)
                    frame = renderer.render(scene, None, [lamp], SIZE, outputs=("image", "timings"), samples=1)
                    links = frame.used[0].links
                    if k >= 0:
                        spent[key].append(frame.timings["shadow"])
        row = {"ratio": ratio(np.array(spent["exact"]), np.array(spent["map"])), "links": links}
        results[f"{name} {kind}"] = row
        click.echo(f"{name:34s} {kind:6s} list build over depth pass {row['ratio']:.2f} x, {links} links")


def embree(name: str, scene: gs.Scene, rounds: int, results: dict[str, Any]) -> None:
    """Against Embree: raw 32-bit rays prepared beforehand, and through trimesh (64-bit rays, offsets, one call each)."""
    from trimesh import Trimesh
    from trimesh.ray.ray_pyembree import RayMeshIntersector

    light = lights_of(name, scene)["sun"]
    truth = gs.trace(scene, None, [light], SIZE, samples=1)
    rays = truth.rays
    tree = rays._casting
    assert tree is not None
    assert isinstance(light, gs.DirectionalLight)
    lit = truth.cosine[0] > 0.0
    starts = truth.position[lit] - rays.origin + 1e-4 * rays.size * truth.normal[lit]
    towards = np.broadcast_to(-np.asarray(light.direction), starts.shape).copy()
    eye = np.broadcast_to(np.asarray(scene.camera.position) - rays.origin, (SIZE[0] * SIZE[1], 3)).copy()
    seen = gs.core.cameras.pixel_rays(scene.camera, SIZE).reshape(-1, 3)
    raw = [(each * tree.scale).astype(np.float32) for each in (eye, starts)] + [
        (each / np.linalg.norm(each, axis=1, keepdims=True)).astype(np.float32) for each in (seen, towards)
    ]
    corners = rays.corners[rays.casts]
    mesh = Trimesh(corners.reshape(-1, 3), np.arange(3 * len(corners)).reshape(-1, 3), process=False)
    handed = RayMeshIntersector(mesh)
    jobs: dict[str, Callable[[int], Any]] = {
        "frame": lambda k: renderer.render(
            scene, None, [replace(moved(light, k), shadow=EXACT)], SIZE, outputs=("image",), samples=1
        ),
        "primary": lambda _: tree.scene.run(raw[0], raw[2], query="INTERSECT"),
        "shadow": lambda _: tree.scene.run(raw[1], raw[3], query="OCCLUDED"),
        "tree": lambda _: type(tree)(rays.corners, np.flatnonzero(rays.casts), rays.size).scene.run(
            raw[1][:1], raw[3][:1]
        ),
        "trimesh": lambda _: (handed.intersects_first(eye, seen), handed.intersects_any(starts, towards)),
    }
    spent: dict[str, list[float]] = {"build": [], "resolve": [], "shading": []}
    with gs.Renderer() as renderer, gs.Renderer() as plain:

        def timed(k: int) -> None:
            lamp = replace(moved(light, 2 * k + 1), shadow=EXACT)
            for each, shadow in ((renderer, EXACT), (plain, None)):
                frame = each.render(
                    scene, None, [replace(lamp, shadow=shadow)], SIZE, outputs=("image", "timings"), samples=1
                )
                if k >= 0 and shadow is None:
                    spent["shading"].append(frame.timings["resolve"])
                elif k >= 0:
                    spent["build"].append(frame.timings["shadow"])
                    spent["resolve"].append(frame.timings["resolve"])

        times = alternate(jobs | {"timed": timed}, rounds)
    build, resolve, shading = (np.array(each) for each in spent.values())
    row = {
        "build_and_resolve": ratio(build + resolve, times["shadow"]),
        "without_shading": ratio(build + resolve - shading, times["shadow"]),
        "frame": ratio(times["frame"], times["primary"] + times["shadow"]),
        "frame_with_tree": ratio(times["frame"], times["primary"] + times["shadow"] + times["tree"]),
        "frame_trimesh": ratio(times["frame"], times["trimesh"]),
        "frame_trimesh_with_tree": ratio(times["frame"], times["trimesh"] + times["tree"]),
        **{f"{key}_ms": 1e3 * float(np.median(times[key])) for key in ("frame", "primary", "shadow", "tree", "trimesh")},
    }  # fmt: skip
    results[name] = row
    click.echo(
        f"{name:34s} build + resolve {row['build_and_resolve']:.2f} x Embree's raw shadow rays ({row['without_shading']:.2f} without "
        f"shading); frame {row['frame']:.2f} x raw primary + shadow rays, {row['frame_with_tree']:.2f} with the tree; "
        f"{row['frame_trimesh']:.2f} and {row['frame_trimesh_with_tree']:.2f} x by trimesh (ms: frame {row['frame_ms']:.0f}, primary "
        f"{row['primary_ms']:.0f}, shadow {row['shadow_ms']:.0f}, tree {row['tree_ms']:.0f}, by trimesh {row['trimesh_ms']:.0f})"
    )


def growth(folder: Path, rounds: int, results: dict[str, Any]) -> None:
    brain = gs.load(folder / "brain_cortex.ply", up_axis="z", look="plain")
    for count, scene in sized(brain):
        grown(f"{count} triangles", scene, 1, 2048, rounds, results)
    court = gs.scenes.courtyard()
    for lights in (1, 2, 4, 8):
        grown(f"courtyard, {lights} lights", court, lights, 2048, rounds, results)
    for resolution in (512, 1024, 2048, 4096, 8192):
        grown(f"courtyard, map {resolution}", court, 1, resolution, rounds, results)


def sized(brain: gs.Scene) -> Iterator[tuple[int, gs.Scene]]:
    """About 10 k, 100 k, 600 k and 2.4 M triangles of the same shape: decimated, whole, and four copies."""
    mesh = one_draw(brain).nodes[0].mesh
    for part in (61, 6):
        few = gs.Mesh(mesh.positions, mesh.triangles[::part])
        yield len(few.triangles), gs.Scene((gs.Node(few, np.eye(4), "part"),), brain.camera, brain.lights)
    yield len(mesh.triangles), gs.Scene((gs.Node(mesh, np.eye(4), "whole"),), brain.camera, brain.lights)
    size = np.ptp(mesh.bounds, axis=0)
    nodes = []
    for i in range(4):
        matrix = np.eye(4)
        matrix[:3, 3] = size * np.array([1.05 * (i % 2), 0.0, 1.05 * (i // 2)])
        nodes.append(gs.Node(mesh, matrix, f"brain {i}"))
    yield 4 * len(mesh.triangles), gs.Scene(tuple(nodes))


def grown(name: str, scene: gs.Scene, lights: int, resolution: int, rounds: int, results: dict[str, Any]) -> None:
    """One line of the growth table: default, exact, and the floor for the same load (one map per light)."""
    base = np.asarray(gs.DirectionalLight().direction)

    def suns(k: int, shadow: gs.Shadow) -> list[gs.Light]:
        turns = [1e-3 * k + 0.4 * i for i in range(lights)]
        return [
            gs.DirectionalLight(
                direction=(
                    base[0] * np.cos(a) - base[2] * np.sin(a), base[1], base[0] * np.sin(a) + base[2] * np.cos(a),
                ),
                shadow=shadow, intensity=1.0 / lights,
            )
            for a in turns
        ]  # fmt: skip

    with gs.Renderer() as maps, gs.Renderer() as exact, Floor(maps, scene, SIZE, resolution) as floor:
        made = maps.render(scene, None, suns(0, gs.Shadow(resolution=resolution)), SIZE, outputs=("image",), samples=1)

        def draw_floor(_: int) -> None:
            for i in range(lights):
                floor.draw(made, i)

        times = alternate(
            {
                "floor": draw_floor,
                "map": lambda k: maps.render(
                    scene, None, suns(k, gs.Shadow(resolution=resolution)), SIZE, outputs=("image",), samples=1
                ),
                "exact": lambda k: exact.render(scene, None, suns(k, EXACT), SIZE, outputs=("image",), samples=1),
            },
            rounds,
        )
    row = {f"{key}_ms": 1e3 * float(np.median(value)) for key, value in times.items()}
    row |= {key: ratio(times[key], times["floor"]) for key in ("map", "exact")}
    results[name] = row
    click.echo(
        f"{name:34s} floor {row['floor_ms']:7.1f} ms, default {row['map_ms']:7.1f} ({row['map']:.2f} x), exact "
        f"{row['exact_ms']:7.1f} ({row['exact']:.2f} x)"
    )


def samples(rounds: int, results: dict[str, Any]) -> None:
    scene = gs.scenes.courtyard()
    with gs.Renderer() as renderer:
        kinds = gs.measure(renderer.render(scene, size=SIZE, samples=1), gs.trace(scene, size=SIZE, samples=1)).kinds[0]
    truth = gs.trace(scene, size=SIZE, samples=16).visibility[0]
    counted = kinds >= Outcome.GOOD
    renderers = {count: gs.Renderer() for count in (1, 4, 8, 16)}

    def frame(count: int, k: int) -> gs.Frame:
        light = moved(gs.DirectionalLight(shadow=EXACT), k)
        return renderers[count].render(scene, None, [light], SIZE, outputs=("image", "visibility"), samples=count)

    times = alternate({str(count): (lambda k, count=count: frame(count, k)) for count in renderers}, rounds)
    for count in renderers:
        visibility = frame(count, 0).visibility
        mean = float(np.abs(visibility[0] - truth)[counted].mean())
        results[str(count)] = {"mean": mean, "ratio": ratio(times[str(count)], times["1"])}
        click.echo(
            f"courtyard, {count:2d} samples: mean error against 4 x 4 rays {mean:.5f}, {results[str(count)]['ratio']:.2f} x one sample"
        )
    for renderer in renderers.values():
        renderer.release()


@click.command(help=__doc__)
@click.option("--models", "folder", type=click.Path(exists=True, path_type=Path), help="Folder of the 12 models.")
@click.option("--part", "parts", multiple=True, type=click.Choice(PARTS), help="Only these parts.")
@click.option("--only", help="Only scenes whose name contains this.")
@click.option("--rounds", default=9, show_default=True, help="Rounds of each timing.")
@click.option("--json", "output", type=click.Path(path_type=Path), help="Write all figures there.")
def main(folder: Path | None, parts: tuple[str, ...], only: str | None, rounds: int, output: Path | None) -> None:
    warnings.simplefilter("ignore", gs.GlshadowWarning)
    folder = models_in(folder)
    parts = parts or PARTS
    results: dict[str, dict[str, Any]] = {part: {} for part in parts}
    scenes = [("courtyard", None), *MODELS] if folder else [("courtyard", None)]
    for part, work in (("wrong", wrong), ("moving", moving), ("embree", embree)):
        if part not in parts:
            continue
        click.echo(f"-- {part}")
        for name, up in scenes:
            if only and only not in name:
                continue
            scene = gs.scenes.courtyard() if up is None else gs.load(folder / name, up_axis=up, look="plain")
            work(name, scene, *(() if part == "wrong" else (rounds,)), results[part])
        if part == "moving":
            suns = [
                row["ratio"] for name, row in results[part].items() if name.endswith("sun") and "courtyard" not in name
            ]
            if suns:
                click.echo(f"models, sun: median {np.median(suns):.2f} x, worst {max(suns):.2f} x")
    if "build" in parts and folder:
        click.echo("-- build")
        brain = gs.load(folder / "brain_cortex.ply", up_axis="z", look="plain")
        build("brain_cortex.ply", brain, rounds, results["build"])
        build("four of it", list(sized(brain))[-1][1], rounds, results["build"])
    if "still" in parts:
        click.echo("-- still")
        still(rounds, results["still"])
    if "growth" in parts and folder:
        click.echo("-- growth")
        growth(folder, rounds, results["growth"])
    if "samples" in parts:
        click.echo("-- samples")
        samples(rounds, results["samples"])
    if output:
        output.write_text(json.dumps(results, indent=1))


if __name__ == "__main__":
    main()
