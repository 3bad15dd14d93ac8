"""How wrong is a picture? Needs the extra `reference`. Look at: yellow on the shadow edges (the price of the resolution), no red, no blue."""

import glshadow as gs
from glshadow import image

scene = gs.scenes.courtyard()
truth = gs.trace(scene)
with gs.Renderer() as renderer:
    for resolution in (512, 1024, 2048, 4096):
        sun = gs.DirectionalLight(direction=scene.lights[0].direction, shadow=gs.Shadow(resolution=resolution))
        truth_of_sun = truth if sun == scene.lights[0] else gs.trace(scene, lights=[sun])
        error = gs.measure(renderer.render(scene, lights=[sun]), truth_of_sun)
        print(f"{resolution:5d}: {error}")
image.write("07_score.png", error.picture())
