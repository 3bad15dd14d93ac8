"""The image: which pixels are clipped, what several samples bring and cost, what many images of one scene and the first one cost.

Times are medians of alternating rounds in one process, read-back included, with one moving directional light and the default filter;
compare ratios only. The reference has 16 x 16 samples: an image four times as large in each direction with 16 samples, averaged.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import click
import numpy as np
from frame import SIZE, start_up, turned_sun
from sections import Scenes, command

import glshadow as gs

SMALL = (640, 360)  # for errors: sixteen times as many pixels fit into a texture
LINEAR = ("courtyard", "bicycle.glb", "japanese_bridge_garden.glb", "chess_board.glb")
LIMITS = {4: (0.5, 1.5), 16: (0.25, 2.3)}
ORBIT, ORBIT_SIZE = 36, "640x480"


def errors(scene: gs.Scene) -> dict[int, float]:
    """Mean error of each sample count against 16 x 16, over that of one sample; linear, clamped."""
    with gs.Renderer() as renderer:
        large = (4 * SMALL[0], 4 * SMALL[1])
        fine = np.clip(renderer.render(scene, size=large, outputs=("linear",), samples=16).linear, 0.0, 1.0)
        truth = fine.reshape(SMALL[1], 4, SMALL[0], 4, 3).mean(axis=(1, 3))
        found = {}
        for samples in (1, 4, 8, 16):
            light = renderer.render(scene, size=SMALL, outputs=("linear",), samples=samples).linear
            found[samples] = float(np.abs(np.clip(light, 0.0, 1.0) - truth).mean())
    return {samples: error / found[1] for samples, error in found.items()}


def times(scene: gs.Scene, rounds: int, still: bool) -> dict[int, float]:
    """Time of each sample count over that of one. `still`: the camera does not move, and its surfaces are cached."""
    renderers = {samples: gs.Renderer() for samples in (1, 4, 8, 16)}
    taken: dict[int, list[float]] = {samples: [] for samples in renderers}
    camera = scene.camera
    for k in range(-2, rounds):
        turned = camera if still else _nudged(camera, k)
        sun = turned_sun(scene, k, gs.Shadow())
        for samples, renderer in renderers.items():
            start = time.perf_counter()
            renderer.render(scene, turned, [sun], SIZE, outputs=("image",), samples=samples)
            if k >= 0:
                taken[samples].append(time.perf_counter() - start)
    for renderer in renderers.values():
        renderer.release()
    one = np.array(taken[1])
    return {samples: float(np.median(np.array(values) / one)) for samples, values in taken.items()}


def _nudged(camera: Any, k: int) -> Any:
    from dataclasses import replace

    return replace(camera, position=tuple(np.asarray(camera.position) * (1.0 + 1e-6 * (k + 3))))


def measure_samples(scenes: Scenes, rounds: int, _: Path | None) -> dict[str, Any]:
    """Error and time of several samples."""
    results: dict[str, Any] = {}
    click.echo(f"{'scene':30s} error over that of one sample, 4 8 16    time, camera moves    camera stands")
    for name, make in scenes:
        scene = make()
        row: dict[str, Any] = {"moves": times(scene, rounds, False), "stands": times(scene, rounds, True)}
        if name in LINEAR:
            row["error"] = errors(scene)
        results[name] = row
        cells = [
            " ".join(f"{row[what][n]:6.2f}" for n in (4, 8, 16)) if what in row else " " * 20
            for what in ("error", "moves", "stands")
        ]
        click.echo(f"{name:30s} {'    '.join(cells)}")
    for samples in (4, 8, 16):
        middle = np.median([row["moves"][samples] for name, row in results.items() if name != "courtyard"] or [np.nan])
        click.echo(f"median of the models, {samples:2d} samples, camera moves: {middle:.2f} x")
    return results


def measure_orbit(_: Scenes, rounds: int, folder: Path | None) -> dict[str, Any]:
    """`--orbit 36` of the chess board against as many single commands."""
    assert folder is not None
    model = str(folder / "chess_board.glb")
    base = [sys.executable, "-m", "glshadow", "render", model, "--size", ORBIT_SIZE]
    single, whole = [], []
    for _round in range(min(rounds, 3)):
        with tempfile.TemporaryDirectory() as place:
            for command, taken in (
                ([*base, "-o", f"{place}/one.png"], single),
                ([*base, "--orbit", str(ORBIT), "-o", f"{place}/v{{:03d}}.png"], whole),
            ):
                start = time.perf_counter()
                subprocess.run(command, check=True, capture_output=True)
                taken.append(time.perf_counter() - start)
    one, each = float(np.median(single)), float(np.median(whole)) / ORBIT
    click.echo(
        f"chess board, {ORBIT_SIZE}: one command {one:.2f} s, an image of --orbit {ORBIT} {each:.3f} s: {each / one:.2f} x"
    )
    return {"single_s": one, "picture_s": each, "ratio": each / one}


def measure_start(_: Scenes, rounds: int, folder: Path | None) -> dict[str, Any]:
    """Time from process start to the PNG of the chess board."""
    assert folder is not None
    found = start_up(folder / "chess_board.glb", rounds)
    click.echo(f"glshadow render chess_board.glb: {found['median_s']:.2f} s; {found['where']}")
    return found


def measure_clipped(scenes: Scenes, rounds: int, _: Path | None) -> dict[str, Any]:
    """Pixels of each model, ground left out, that are brighter than a display's white with the default sun and ambient light."""
    results: dict[str, Any] = {}
    with gs.Renderer() as renderer:
        for name, make in scenes:
            scene = make()
            frame = renderer.render(
                scene, lights=[gs.DirectionalLight(intensity=0.8)], size=SMALL, outputs=("linear", "node")
            )
            model = (frame.node >= 0) & (frame.node != len(scene.nodes) - 1)
            brightest = frame.linear[model].max(axis=-1)
            results[name] = {"clipped": float((brightest > 1.0).mean()), "most": float(brightest.max())}
            click.echo(f"{name:30s} {results[name]['clipped']:6.1%} clipped, brightest {results[name]['most']:.3f}")
    return results


main = command(
    __doc__, {"clipped": measure_clipped, "samples": measure_samples, "orbit": measure_orbit, "start": measure_start}
)


if __name__ == "__main__":
    main()
