"""A turn around a scene; its triangle lists are built once. Look at: shadows that do not move while the camera does."""

import numpy as np

import glshadow as gs
from glshadow import image

scene = gs.scenes.courtyard()
with gs.Renderer() as renderer:
    frames = renderer.sequence(scene, gs.orbit(scene.camera, 6), size=(320, 180), samples=4)
    pictures = [frame.image for frame in frames]

image.write("11_turntable.png", np.vstack([np.hstack(pictures[:3]), np.hstack(pictures[3:])]))
