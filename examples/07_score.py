"""The error of an image. Needs the extra `reference`. Look at: yellow on shadow edges, the cost of a finite resolution; no red or blue."""

from dataclasses import replace

import glshadow as gs
from glshadow import image

scene = gs.scenes.courtyard()
truth = gs.trace(scene)  # once: it does not depend on maps
with gs.Renderer() as renderer:
    for resolution in (512, 1024, 2048, 4096):
        sun = replace(scene.lights[0], shadow=gs.Shadow(resolution=resolution))
        error = gs.measure(renderer.render(scene, lights=[sun]), truth)
        print(f"{resolution:5d}: {error}")
image.write("07_score.png", error.picture())
