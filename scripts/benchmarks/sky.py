"""Light from the whole sky: time in exact hard frames, and error against 1,024 rays, of DirectionMaps() and of Exact().

Times are processor times, the least of alternating rounds in one process, read-back included; compare ratios only.
"""

from __future__ import annotations

import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import click
import numpy as np
from frame import turned_sun
from sections import Scenes, command

import glshadow as gs

SIZE = (640, 480)
RAYS, PIXELS = 1024, 4000
FILTERS: dict[str, gs.Filter] = {"maps": gs.DirectionMaps(), "exact 64": gs.Exact()}


def _sky(filter: gs.Filter | None, k: float = 0.0) -> gs.SkyLight:
    return gs.SkyLight(direction=(1e-3 * k, -1.0, 0.0), shadow=gs.Shadow(filter=filter))


def _ratios(scene: gs.Scene, rounds: int) -> dict[str, float]:
    """Seconds of a hard frame with a moving light, and frames of the sky over it."""
    taken: dict[str, list[float]] = {"hard": [], "drawn": [], "kept": [], "exact": []}
    with gs.Renderer() as hard, gs.Renderer() as maps, gs.Renderer() as exact:
        cameras = list(gs.orbit(maps.render(scene, None, [_sky(None)], SIZE, samples=1).camera, 360))
        for k in range(-1, rounds):
            drawn, own = _sky(FILTERS["maps"], k), _sky(FILTERS["exact 64"], k)
            jobs: dict[str, tuple[gs.Renderer, gs.Camera | None, gs.Light]] = {
                "hard": (hard, None, turned_sun(scene, k, gs.Shadow())),
                "drawn": (maps, None, drawn),
                "kept": (maps, cameras[k % 9 + 1], drawn),
            }
            if k < 1:  # 64 hard frames each
                jobs["exact"] = (exact, None, own)
            for kind, (renderer, camera, light) in jobs.items():
                start = time.process_time()
                renderer.render(scene, camera, [light], SIZE, samples=1)
                if k >= 0:
                    taken[kind].append(time.process_time() - start)
    least = {kind: min(values) for kind, values in taken.items()}
    return {kind: value if kind == "hard" else value / least["hard"] for kind, value in least.items()}


def measure_time(scenes: Scenes, rounds: int, _folder: Path | None) -> dict[str, Any]:
    """Frames with a moving light and with a moving camera, over a hard frame with a moving light."""
    results: dict[str, Any] = {}
    click.echo(f"{'scene':30s} hard ms; over it: maps drawn anew, maps kept and a moving camera; Exact() with 64 rays")
    for name, make in scenes:
        row = results[name] = _ratios(make(), rounds)
        click.echo(f"{name:30s} {1e3 * row['hard']:6.0f} {row['drawn']:6.1f} {row['kept']:6.1f} {row['exact']:6.1f}")
    return results


def measure_error(scenes: Scenes, _rounds: int, _folder: Path | None) -> dict[str, Any]:
    """Error of visibility at random pixels that face the light."""
    results: dict[str, Any] = {}
    click.echo(f"{'scene':30s} directions; mean error, its mean with sign, 99 % within: maps; Exact() with 64 rays")
    with gs.Renderer() as renderer:
        for name, make in scenes:
            scene, truth = make(), None
            row: dict[str, Any] = {}
            for kind, filter in FILTERS.items():
                outputs = ("visibility", "triangle")
                frame = renderer.render(scene, None, [_sky(filter)], SIZE, outputs=outputs, samples=1)
                if truth is None:
                    shown = np.flatnonzero(frame.triangle.ravel() >= 0)
                    chosen = np.random.default_rng(1).choice(shown, min(PIXELS, len(shown)), replace=False)
                    surface = np.full(frame.triangle.size, -1, dtype=np.int32)
                    surface[chosen] = frame.triangle.ravel()[chosen]
                    surface = surface.reshape(frame.triangle.shape)
                    light = replace(_sky(None), shadow=gs.Shadow())
                    truth = gs.trace(scene, None, [light], SIZE, surface=surface, light_samples=RAYS, samples=1)
                asked = (truth.triangle >= 0) & truth.reached[0] & (truth.cosine[0] > 0.0)
                gap = (frame.visibility[0] - truth.visibility[0])[asked]
                row[kind] = {"mean": float(np.abs(gap).mean()), "signed": float(gap.mean()),
                             "p99": float(np.percentile(np.abs(gap), 99)), "filter": str(frame.used[0].filter)}  # fmt: skip
            results[name] = row
            cells = "; ".join(f"{each['mean']:.4f} {each['signed']:+.4f} {each['p99']:.3f}" for each in row.values())
            click.echo(f"{name:30s} {row['maps']['filter'].split(':')[1]:>4s}; {cells}")
    return results


main = command(__doc__, {"time": measure_time, "error": measure_error})


if __name__ == "__main__":
    main()
