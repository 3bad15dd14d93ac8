"""p5.tree's third exercise: 3 x 3 PCF, and why blurring the depth map is no substitute. Look at: three edges of one post's shadow.

Prints how many greys an edge has. The mean of comparisons is a share of the light; a comparison with a mean depth is still yes or no,
only somewhere else: at a depth between the post and the ground where nothing is.
"""

import numpy as np

import glshadow as gs
from glshadow import image

scene = gs.scenes.landscape(3)
camera = gs.PerspectiveCamera(position=(20.0, 75.0, 120.0), target=(-8.0, 0.0, 50.0), fov_y=18.0)
light = gs.scenes.landscape_light()
truth = gs.trace(scene, camera, [light], (320, 240))
pictures = []
with gs.Renderer() as renderer:
    for name, kind in (
        ("one comparison", gs.Hard()),
        ("3 x 3 PCF", gs.Pcf(1)),
        # exp(-87 (depth - mean depth)), at most 1: as near to "not behind the mean depth" as it gets
        ("blurred depth", gs.BabylonEsm(1, depth_scale=87.0, close=True)),
    ):
        lamp = gs.scenes.landscape_light(shadow=gs.Shadow(filter=kind, fit=gs.SceneFit(), resolution=512))
        frame = renderer.render(scene, camera, [lamp], (320, 240))
        seen = frame.visibility[0][~np.isnan(frame.visibility[0])]
        between = (seen > 0.05) & (seen < 0.95)
        print(
            f"{name}: {between.mean():.2%} of the pixels between light and dark, "
            f"mean error {np.nanmean(np.abs(frame.visibility[0] - truth.visibility[0])):.4f}"
        )
        pictures.append(frame.image)
image.write("16_blurred_depth.png", np.hstack(pictures))
