"""Lights that have a size: wrong points and error against traced rays, and time against one hard frame, many hard frames, and Embree with
the same rays.

Times are medians of alternating rounds in one process, read-back included, with one moving directional light; compare ratios only.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import click
import numpy as np
from frame import SIZE, turned_sun
from sections import Scenes, command

import glshadow as gs
from glshadow.gl.techniques.area import Area
from glshadow.reference.points import count_points

SMALL = (640, 360)  # size for wrong points
TRUTH = (320, 180)  # size for errors
RAYS = {"courtyard": 4096}
FEW_RAYS = 1024  # for the models: enough for a tenth of the measured errors
ANGLES = (0.53, 2.0, 5.0)
COUNTS = (64, 256, 1024)
LIMITS = {64: 0.0035, 256: 0.0015, 1024: 0.0006}


def lights_of(scene: gs.Scene) -> dict[str, gs.Light]:
    """Three directional lights with a size, a sphere light and a rectangular area light."""
    sun = scene.lights[0] if isinstance(scene.lights[0], gs.DirectionalLight) else gs.DirectionalLight()
    suns: dict[str, gs.Light] = {f"sun {angle:g}": replace(sun, angle=angle, shadow=gs.Shadow()) for angle in ANGLES}
    low, high = scene.bounds
    middle, size = 0.5 * (low + high), float(np.linalg.norm(high - low))
    place = tuple((middle - 0.9 * size * np.asarray(sun.direction)).tolist())
    panel = gs.RectLight(
        position=place, direction=sun.direction, up=_across(sun.direction), width=0.06 * size, height=0.03 * size
    )
    return {**suns, "sphere": gs.PointLight(position=place, radius=0.02 * size), "panel": panel}


def _across(direction: Any) -> tuple[float, float, float]:
    return (0.0, 0.0, 1.0) if abs(direction[2]) < 0.9 * np.linalg.norm(direction) else (1.0, 0.0, 0.0)


def measure_wrong(scenes: Scenes, _rounds: int, _folder: Path | None) -> dict[str, Any]:
    """Pixels whose count differs from that of float64 rays."""
    results: dict[str, Any] = {}
    click.echo(f"{'scene':30s} {'light':10s} pixels, off by more than one point, by one; penumbra")
    with gs.Renderer() as renderer:
        for name, make in scenes:
            scene = make()
            for kind, light in lights_of(scene).items():
                frame = renderer.render(scene, None, [light], SMALL, outputs=("visibility", "triangle"), samples=1)
                expected = count_points(
                    gs.trace(scene, None, [light], SMALL, surface=frame.triangle, samples=1), light, 64
                )
                gap = np.abs(frame.visibility[0] * 64.0 - expected)[~np.isnan(expected)]
                row = {
                    "pixels": len(gap),
                    "wrong": int((gap > 1.5).sum()),
                    "by_one": int(((gap > 0.5) & (gap <= 1.5)).sum()),
                    "penumbra": int(((expected > 0.5) & (expected < 63.5)).sum()),
                    "why": frame.used[0].why,
                }
                results[f"{name}, {kind}"] = row
                click.echo(f"{name:30s} {kind:10s} {row['pixels']:7d} {row['wrong']:5d} {row['by_one']:5d} {row['penumbra']:7d}"
                           f"{'  one after another' if 'one after' in row['why'] else ''}")  # fmt: skip
    return results


def measure_error(scenes: Scenes, _rounds: int, _folder: Path | None) -> dict[str, Any]:
    """Mean error against 4,096 rays (for models 1,024), over pixels that face the light."""
    results: dict[str, Any] = {}
    click.echo(
        f"{'scene':30s} {'light':10s} mean error of {', '.join(map(str, COUNTS))} points; 95th percentile of 64; limit"
    )
    with gs.Renderer() as renderer:
        for name, make in scenes:
            scene = make()
            lights = lights_of(scene)
            for kind in ("sun 2", "sphere") if name == "courtyard" else ("sun 2",):
                row: dict[str, Any] = {}
                truth = None
                for count in COUNTS:
                    light = replace(lights[kind], shadow=gs.Shadow(filter=gs.Exact(light_samples=count)))
                    frame = renderer.render(scene, None, [light], TRUTH, outputs=("visibility", "triangle"), samples=1)
                    if truth is None:
                        truth = gs.trace(
                            scene,
                            None,
                            [light],
                            TRUTH,
                            surface=frame.triangle,
                            light_samples=RAYS.get(name, FEW_RAYS),
                            samples=1,
                        )
                    asked = truth.reached[0] & (truth.cosine[0] > 0.0)
                    gap = np.abs(frame.visibility[0] - truth.visibility[0])[asked]
                    soft = (truth.visibility[0][asked] > 0.0) & (truth.visibility[0][asked] < 1.0)
                    row[str(count)] = {"mean": float(gap.mean()), "p95": float(np.percentile(gap, 95)),
                                       "penumbra": float(gap[soft].mean()) if soft.any() else 0.0}  # fmt: skip
                results[f"{name}, {kind}"] = row
                cells = " ".join(f"{row[str(count)]['mean']:.5f}" for count in COUNTS)
                click.echo(f"{name:30s} {kind:10s} {cells}   {row['64']['p95']:.4f}")
    return results


def measure_time(scenes: Scenes, rounds: int, _folder: Path | None) -> dict[str, Any]:
    """Time of soft frames over the hard frame of the same round."""
    results: dict[str, Any] = {}
    click.echo(f"{'scene':30s} hard ms; times over it: sun {', '.join(f'{angle:g}' for angle in ANGLES)} degrees")
    for name, make in scenes:
        scene = make()
        taken: dict[float, list[float]] = {0.0: [], **{angle: [] for angle in ANGLES}}
        renderers = {angle: gs.Renderer() for angle in taken}
        for k in range(-2, rounds):
            for angle, renderer in renderers.items():
                sun = replace(turned_sun(scene, k, gs.Shadow()), angle=angle)
                start = time.perf_counter()
                renderer.render(scene, None, [sun], SIZE, outputs=("image",), samples=1)
                if k >= 0:
                    taken[angle].append(time.perf_counter() - start)
        for renderer in renderers.values():
            renderer.release()
        hard = np.array(taken[0.0])
        row = {str(angle): float(np.median(np.array(taken[angle]) / hard)) for angle in ANGLES}
        results[name] = {"hard_ms": 1e3 * float(np.median(hard)), **row}
        click.echo(
            f"{name:30s} {1e3 * np.median(hard):6.0f}   " + " ".join(f"{row[str(angle)]:6.2f}" for angle in ANGLES)
        )
    for angle in ANGLES:
        models = [row[str(angle)] for name, row in results.items() if name != "courtyard"]
        if models:
            click.echo(f"median of the models, {angle:g} degrees: {np.median(models):.2f} x")
    return results


def measure_others(scenes: Scenes, rounds: int, _folder: Path | None) -> dict[str, Any]:
    """Other filters under a directional light of 2 degrees and a sphere light: mean error, penumbra error, time over the hard frame."""
    results: dict[str, Any] = {}
    filters = (
        gs.Pcf(1),
        gs.Pcss(),
        gs.Pcss(32, 64),
        gs.LightSamples(64),
        gs.LightSamples(64, of=gs.Hard()),
        gs.Exact(),
    )
    for _, make in [each for each in scenes if each[0] == "courtyard"]:
        scene = make()
        for kind in ("sun 2", "sphere"):
            light = lights_of(scene)[kind]
            truth = None
            for filter in filters:
                with gs.Renderer() as renderer, gs.Renderer() as hard:
                    asked = replace(light, shadow=gs.Shadow(filter=filter))
                    frame = renderer.render(scene, None, [asked], SMALL, outputs=("visibility", "triangle"), samples=1)
                    truth = truth or gs.trace(
                        scene, None, [asked], SMALL, surface=frame.triangle, light_samples=FEW_RAYS, samples=1
                    )
                    faces = truth.reached[0] & (truth.cosine[0] > 0.0)
                    gap = np.abs(frame.visibility[0] - truth.visibility[0])
                    soft = faces & (truth.visibility[0] > 0.0) & (truth.visibility[0] < 1.0)
                    taken = []
                    for k in range(-1, rounds if filter.points_of_light == 0 else 3):
                        times = []
                        for drawer, drawn in ((hard, _moved(light, k, 0.0)), (renderer, _moved(asked, k, 1.0))):
                            start = time.perf_counter()
                            drawer.render(scene, None, [drawn], SIZE, outputs=("image",), samples=1)
                            times.append(time.perf_counter() - start)
                        if k >= 0:
                            taken.append(times[1] / times[0])
                row = {
                    "mean": float(gap[faces].mean()),
                    "penumbra": float(gap[soft].mean()),
                    "time": float(np.median(taken)),
                }
                results[f"{kind}, {filter}"] = row
                click.echo(
                    f"{kind:8s} {filter!s:24s} mean {row['mean']:.5f}  penumbra {row['penumbra']:.4f}  time {row['time']:.2f}"
                )
    return results


def _moved(light: gs.Light, k: int, size: float) -> gs.Light:
    """The light moved slightly, with its size or as a point; hard ones with the default filter."""
    shadow = light.shadow if size else gs.Shadow()
    if isinstance(light, gs.DirectionalLight):
        x, y, z = light.direction
        return replace(light, direction=(x + 2e-3 * k, y, z), angle=size * light.angle, shadow=shadow)
    assert isinstance(light, gs.PointLight)
    x, y, z = light.position
    return replace(light, position=(x + 2e-2 * k, y, z), radius=size * light.radius, shadow=shadow)


def measure_frames(scenes: Scenes, rounds: int, _folder: Path | None) -> dict[str, Any]:
    """Time of one soft frame with 64 points over 64 exact hard frames."""
    results: dict[str, Any] = {}
    for name, make in scenes:
        scene = make()
        with gs.Renderer() as renderer, gs.Renderer() as hard:
            taken: tuple[list[float], list[float]] = ([], [])
            for k in range(-1, min(rounds, 3)):
                sun = replace(turned_sun(scene, k, gs.Shadow()), angle=2.0)
                start = time.perf_counter()
                renderer.render(scene, None, [sun], SIZE, outputs=("image",), samples=1)
                middle = time.perf_counter()
                for point in sun.hard_lights(64):
                    hard.render(scene, None, [point], SIZE, outputs=("image",), samples=1)
                end = time.perf_counter()
                if k >= 0:
                    taken[0].append(middle - start)
                    taken[1].append(end - middle)
        results[name] = float(np.median(np.array(taken[0]) / np.array(taken[1])))
        click.echo(f"{name:30s} {results[name]:.3f} x of 64 exact frames")
    return results


@contextmanager
def timed_asking(taken: list[float]) -> Iterator[None]:
    """Seconds of the passes that ask the penumbra."""
    original = Area._cast_rays

    def timed(self: Area, *arguments: Any) -> None:
        self._context.ctx.finish()
        start = time.perf_counter()
        original(self, *arguments)
        self._context.ctx.finish()
        taken.append(time.perf_counter() - start)

    Area._cast_rays = timed  # type: ignore[method-assign]
    try:
        yield
    finally:
        Area._cast_rays = original  # type: ignore[method-assign]


def measure_embree(scenes: Scenes, rounds: int, _folder: Path | None) -> dict[str, Any]:
    """Time of the penumbra passes, and of Embree with the same rays and its tree built before."""
    results: dict[str, Any] = {}
    for name, make in [each for each in scenes if each[0] == "courtyard"]:
        scene = make()
        sun = replace(turned_sun(scene, 0, gs.Shadow()), angle=2.0)
        with gs.Renderer() as renderer:
            ours: list[float] = []
            with timed_asking(ours):
                for k in range(-2, rounds):
                    moved = replace(turned_sun(scene, k, gs.Shadow()), angle=2.0)
                    renderer.render(scene, None, [moved], SIZE, outputs=("visibility", "triangle"), samples=1)
                frame = renderer.render(scene, None, [sun], SIZE, outputs=("visibility", "triangle"), samples=1)
            source = renderer._cache.techniques[0, "Area"]
            assert isinstance(source, Area)
            asked = source.partly_lit
        truth = gs.trace(scene, None, [sun], SIZE, surface=frame.triangle, samples=1)
        share = np.nan_to_num(frame.visibility[0])
        rows = (share > 0.0) & (share < 1.0)
        points, own = truth.position[rows] - truth.rays.origin, frame.triangle[rows]
        aims = np.array(
            [-np.asarray(point.direction) for point in sun.hard_lights(64) if isinstance(point, gs.DirectionalLight)]
        )
        aims /= np.linalg.norm(aims, axis=1, keepdims=True)
        starts, owns = np.repeat(points, 64, axis=0), np.repeat(own, 64)
        ways, far = np.tile(aims, (len(points), 1)), np.full(64 * len(points), np.inf)
        theirs = []
        for _ in range(3):
            start = time.perf_counter()
            truth.rays.blocked(owns, starts, ways, far)
            theirs.append(time.perf_counter() - start)
        ours_each = float(np.median(ours[2:])) / (64 * asked)
        theirs_each = float(np.median(theirs)) / len(owns)
        results[name] = {
            "asked": asked,
            "rays_embree": len(owns),
            "ours_ns": 1e9 * ours_each,
            "embree_ns": 1e9 * theirs_each,
        }
        click.echo(f"{name}: {asked} pixels tested, {1e9 * ours_each:.0f} ns a point; Embree {1e9 * theirs_each:.0f} ns a ray: "
                   f"{ours_each / theirs_each:.2f} x")  # fmt: skip
    return results


main = command(
    __doc__,
    {
        "others": measure_others, "wrong": measure_wrong, "error": measure_error, "time": measure_time, "frames": measure_frames,
        "embree": measure_embree,
    },
)  # fmt: skip


if __name__ == "__main__":
    main()
