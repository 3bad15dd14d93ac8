"""A moving object: the mesh stays on the GPU, only its matrix changes. Look at: the sphere's shadow follows it over the steps."""

import numpy as np

import glshadow as gs
from glshadow import image

scene = gs.scenes.courtyard()
matrix = {node.name: node.world_from_mesh for node in scene.nodes}["sphere"]
with gs.Renderer() as renderer:
    strip = []
    for step in range(4):
        lifted = matrix.copy()
        lifted[1, 3] += 0.5 * step
        frame = renderer.render(scene.moved({"sphere": lifted}), size=(320, 240))
        strip.append(frame.image)

image.write("06_moving_object.png", np.hstack(strip))
