"""A light that has a size. Look at: sharp where the caster touches the ground, wider the farther it is away, and no grain anywhere."""

import numpy as np

import glshadow as gs
from glshadow import image

scene = gs.scenes.courtyard()
pictures = []
with gs.Renderer() as renderer:
    for angle in (0.0, 0.53, 3.0):  # a point at infinity, the sun, a sun behind haze
        sun = gs.DirectionalLight(angle=angle, intensity=0.8)
        frame = renderer.render(scene, lights=[sun], size=(480, 270), samples=4)
        pictures.append(frame.image[60:240, 60:360])

image.write("12_soft.png", np.hstack(pictures))
