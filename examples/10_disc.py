"""A wide soft edge. Look at: the roof's edge in bands with 16 taps, noise where these are rotated, a smooth ramp with 64."""

import numpy as np

import glshadow as gs
from glshadow import image

scene = gs.scenes.courtyard()
crops = []
with gs.Renderer() as renderer:
    for kind in (gs.Disc(12, taps=16), gs.Disc(12, taps=16, rotate=True), gs.Disc(12, taps=64)):
        sun = gs.DirectionalLight(shadow=gs.Shadow(filter=kind))
        frame = renderer.render(scene, lights=[sun])
        crops.append(np.kron(frame.image[500:580, 400:490], np.ones((6, 6, 1), np.uint8)))

image.write("10_disc.png", np.hstack(crops))
