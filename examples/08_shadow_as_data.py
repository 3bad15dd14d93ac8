"""Shadow as numbers: how much of the ground lies in shade through the day. Look at: long shadows morning and evening, short at noon."""

import numpy as np

import glshadow as gs

scene = gs.scenes.courtyard()
above = gs.PerspectiveCamera(position=(0, 30, 0.01), target=(0, 0, 0), fov_y=45)
with gs.Renderer() as renderer:
    for hour in range(7, 18, 2):
        angle = np.pi * (hour - 6) / 12  # sunrise at 6, sunset at 18
        sun = gs.DirectionalLight(direction=(-np.cos(angle), -np.sin(angle), -0.3))
        frame = renderer.render(scene, above, [sun], size=(512, 512), outputs=("visibility", "depth"))
        ground = np.isclose(frame.depth, 30.0, atol=0.01)
        shade = 1.0 - frame.visibility[0][ground].mean()
        print(f"{hour:2d}:00  {shade:6.1%} of the ground in shade  {'#' * round(60 * shade)}")
