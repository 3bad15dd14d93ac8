"""Shadows without a texel. Look at: a staircase from one texel (left), a blur from 3 x 3, the true edge, and the edge antialiased."""

import numpy as np

import glshadow as gs
from glshadow import image

scene = gs.scenes.courtyard()
crops = []
with gs.Renderer() as renderer:
    for kind, samples in ((gs.Hard(), 1), (gs.Pcf(1), 1), (gs.Exact(), 1), (gs.Exact(), 16)):
        sun = gs.DirectionalLight(shadow=gs.Shadow(filter=kind, resolution=1024))  # Exact has no map
        frame = renderer.render(scene, lights=[sun], samples=samples)
        crops.append(np.kron(frame.image[470:540, 400:480], np.ones((5, 5, 1), np.uint8)))

image.write("09_exact.png", np.hstack(crops))
