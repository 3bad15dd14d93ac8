"""Riemer's street: three spots, their maps the channels of one texture. Look at: the headlights on the wall, cut by the first lamppost.

Prints what packing costs: texels that differ from maps of their own, pixels that do, memory and time.
"""

import time
from dataclasses import replace
from typing import Any

import numpy as np

import glshadow as gs

SIZE = (960, 540)
scene = gs.scenes.street()
assert scene.lights is not None
shadow = gs.Shadow(filter=gs.Pcf(1), target=gs.Target.R32F, resolution=2048)
apart = [replace(light, shadow=shadow) for light in scene.lights if isinstance(light, gs.SpotLight)]
packed = [light for light in gs.PackedShadow(apart) if isinstance(light, gs.SpotLight)]

with gs.Renderer() as renderer:
    look: dict[str, Any] = {"ambient": 0.03, "background": (0.02, 0.02, 0.05)}
    outputs = ("image", "visibility", "shadow_maps")
    frames = []
    for name, lights in (("three maps", apart), ("one texture", packed)):
        times = []
        for k in range(3):
            moved = [replace(each, position=tuple(np.add(each.position, 0.01 * k))) for each in lights]
            start = time.perf_counter()
            renderer.render(scene, lights=moved, size=SIZE, **look)
            times.append(time.perf_counter() - start)
        frames.append(renderer.render(scene, lights=lights, size=SIZE, outputs=outputs, **look))
        print(f"{name}: {1e3 * float(np.median(times)):.0f} ms a frame")

texels = sum(int((np.abs(a - b) > 1e-5).sum()) for a, b in zip(*(each.shadow_maps for each in frames), strict=True))
pixels = int((np.abs(np.nan_to_num(frames[0].visibility - frames[1].visibility)) > 0.01).sum())
megabytes = 2048 * 2048 * 4 / 1e6
print(f"{texels} of {3 * 2048 * 2048} texels and {pixels} of {3 * SIZE[0] * SIZE[1]} pixels differ")
print(f"memory: {3 * 2 * megabytes:.0f} MB of depth and metric apart; {(4 + 1) * megabytes:.0f} MB together")
with gs.Renderer() as renderer:
    frame = renderer.render(scene, lights=packed, size=SIZE, samples=4, ambient=0.03, background=(0.02, 0.02, 0.05))
frame.save("13_street.png")
