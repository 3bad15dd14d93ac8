"""A kilometre of hills, where one map is too coarse. Look at: the pickets' shadows before the camera, and the trees far away.

Prints mean error against rays by distance, for one map, one in perspective, four cascades, and Exact().
"""

import warnings
from dataclasses import replace

import numpy as np

import glshadow as gs
from glshadow import image

warnings.filterwarnings("ignore", "a texel of the light's")  # that one map is too coarse is what this shows
SIZE = (640, 360)
BANDS = ((0.0, 10.0), (10.0, 30.0), (30.0, 100.0), (100.0, 300.0), (300.0, 2000.0))
scene = gs.scenes.outdoors()
assert scene.lights is not None
sun = scene.lights[0]
truth = gs.trace(scene, size=SIZE)
shadows = {
    "one map": gs.Shadow(filter=gs.Pcf(1)),
    "Lispsm()": gs.Shadow(filter=gs.Pcf(1), fit=gs.Lispsm()),
    "Cascades(4)": gs.Shadow(filter=gs.Pcf(1), fit=gs.Cascades(4)),
    "Exact()": gs.Shadow(filter=gs.Exact()),
}
pictures = []
with gs.Renderer() as renderer:
    print(f"{'':12s}" + "".join(f"{f'to {int(far)} m':>12s}" for _, far in BANDS))
    for name, shadow in shadows.items():
        lamp = replace(sun, shadow=shadow)
        frame = renderer.render(scene, lights=[lamp], size=SIZE, outputs=("image", "visibility", "depth"))
        gap = np.abs(frame.visibility[0] - truth.visibility[0])
        errors = [float(np.nanmean(gap[(frame.depth >= low) & (frame.depth < high)])) for low, high in BANDS]
        print(f"{name:12s}" + "".join(f"{each:12.4f}" for each in errors))
        pictures.append(frame.image)
image.write("17_outdoors.png", np.vstack([np.hstack(pictures[:2]), np.hstack(pictures[2:])]))
