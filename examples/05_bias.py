"""Why the bias is derived. Look at: stripes with none, detached shadows with a large constant, neither with the default."""

import numpy as np

import glshadow as gs
from glshadow import image

scene = gs.scenes.courtyard()
biases = [gs.NoBias(), gs.ConstantBias(0.01), gs.ConstantBias(0.3), gs.ReceiverPlaneBias()]
pictures = []
with gs.Renderer() as renderer:
    for bias in biases:
        sun = gs.DirectionalLight(shadow=gs.Shadow(bias=bias))
        pictures.append(renderer.render(scene, lights=[sun], size=(640, 360)).image)

image.write("05_bias.png", np.vstack([np.hstack(pictures[:2]), np.hstack(pictures[2:])]))
