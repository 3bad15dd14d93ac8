"""An area light. Look at: shadows that are sharp at contacts and wider with the distance to the caster, and no noise.

Above: a directional light without size, one of 4 degrees by percentage closer soft shadows, and by shadow rays to 64 samples of the light.
Below: the reference, 144 rays a pixel, and 10 times the error of the two.
"""

import numpy as np

import glshadow as gs
from glshadow import image

SIZE = (300, 200)
scene = gs.scenes.courtyard()
camera = gs.PerspectiveCamera(position=(7.0, 5.0, 8.0), target=(0.4, 0.4, 1.4), fov_y=32.0)
sun = gs.DirectionalLight(intensity=0.8, angle=4.0)
lights = {
    "a point": gs.DirectionalLight(intensity=0.8),
    "Pcss()": gs.DirectionalLight(intensity=0.8, angle=4.0, shadow=gs.Shadow(filter=gs.Pcss(32, 64))),
    "Exact()": sun,
}

with gs.Renderer() as renderer:
    outputs = ("image", "visibility", "triangle")
    frames = {
        name: renderer.render(scene, camera, [light], SIZE, outputs=outputs, samples=1)
        for name, light in lights.items()
    }

truth = gs.trace(scene, camera, [sun], SIZE, light_samples=144, surface=frames["Exact()"].triangle)
greys = [np.nan_to_num(truth.visibility[0])]
for name in ("Pcss()", "Exact()"):
    error = gs.measure(frames[name], truth)
    print(f"{name}: mean error {error.mean:.5f}, in the penumbra {error.penumbra:.4f}")
    greys.append(np.clip(10.0 * np.nan_to_num(np.abs(frames[name].visibility[0] - truth.visibility[0])), 0.0, 1.0))
below = [np.repeat((255.0 * grey).astype(np.uint8)[..., None], 3, axis=-1) for grey in greys]
image.write("12_soft.png", np.vstack([np.hstack([frame.image for frame in frames.values()]), np.hstack(below)]))
