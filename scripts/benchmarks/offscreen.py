"""Compares pyrender's OffscreenRenderer with ours on six scenes.

Without shadows: difference between our images and pyrender's of rough dielectrics (mostly their Lambert part), in units of 255. With a
directional light's shadow: wrong pixels of both against traced rays, and time, alternating, with a light that moves every frame.
"""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

import click
import numpy as np
from peers import GAMMA, SIZE, pose, pyrender_module, pyrender_scene, turned
from sections import Scenes, command

import glshadow as gs
from glshadow.core.spaces import view_axes

NAMES = ("courtyard", "athlete", "chess", "demosthenes", "flight", "bicycle")


def measure_line(scenes: Scenes, rounds: int, _folder: Path | None) -> dict[str, Any]:
    """Measure every scene."""
    pyrender: Any = pyrender_module()
    flags = pyrender.RenderFlags
    results: dict[str, Any] = {}
    for name, make in scenes:
        if not name.startswith(NAMES):
            continue
        scene, sun = make(), gs.DirectionalLight()
        there, light = pyrender_scene(pyrender, scene, sun)
        reach = float(
            np.linalg.norm(scene.bounds[1] - scene.bounds[0])
        )  # pyrender's clip planes are in metres: a chess board is smaller
        there.main_camera_node.camera.znear, there.main_camera_node.camera.zfar = 1e-3 * reach, 10.0 * reach
        offscreen, ours = pyrender.OffscreenRenderer(*SIZE), gs.PyrenderRenderer(*SIZE)
        a, _ = offscreen.render(there)
        b, _ = ours.render(there)
        gap = np.abs(a.astype(int) - b).max(axis=-1)
        truth = gs.trace(scene, None, [sun], SIZE)
        frame = gs.render(scene, None, [sun], SIZE, outputs=("visibility", "triangle"))
        exact = gs.measure(frame, truth).wrong
        lit, dark = (offscreen.render(there, flags=each)[0][..., 0] for each in (flags.NONE, flags.SHADOWS_DIRECTIONAL))
        share = (dark / np.maximum(lit, 1.0)) ** GAMMA
        known = (truth.cosine[0] > 0.05) & (lit > 8)
        theirs = float((np.abs(share - truth.visibility[0])[known] > 0.5).mean())
        times: dict[str, list[float]] = {"pyrender": [], "ours": [], "ours, no shadow": []}
        for k in range(-1, rounds):
            there.set_pose(light, pose(view_axes(np.asarray(turned(sun, k).direction)), (0, 0, 0)))
            for who, draw in (
                ("pyrender", lambda t=there, o=offscreen: o.render(t, flags=flags.SHADOWS_DIRECTIONAL)),
                ("ours", lambda t=there, o=ours: o.render(t, flags=flags.SHADOWS_DIRECTIONAL)),
                ("ours, no shadow", lambda t=there, o=ours: o.render(t)),
            ):
                start = time.perf_counter()
                draw()
                if k >= 0:
                    times[who].append(time.perf_counter() - start)
        medians = {who: float(np.median(taken)) for who, taken in times.items()}
        results[name] = {
            "gap": float(np.median(gap)),
            "far": float((gap > 12).mean()),
            "wrong": {"pyrender": theirs, "ours": exact},
            "time": medians["ours"] / medians["pyrender"],
        }
        click.echo(
            f"{name:34s} no shadow: median {np.median(gap):.0f} of 255, {(gap > 12).mean():.1%} off by more than 12; "
            f"wrong: pyrender {theirs:.2%}, ours {exact:.4%}; time {medians['ours'] / medians['pyrender']:.2f} x pyrender's"
        )
        offscreen.delete()
        ours.delete()
    return results


main = command(__doc__, {"line": measure_line})

if __name__ == "__main__":
    main()
