"""p5.tree's second exercise: orthographic against perspective projection of the light. Look at: the two previews of the depth map.

Prints the bias matrix times the light's P V as data, how depth is distributed, and how large a texel is near the light and far from it.
"""

import numpy as np

import glshadow as gs
from glshadow import image

scene = gs.scenes.landscape(1)
shadow = gs.Shadow(filter=gs.Pcf(1), fit=gs.SceneFit(), resolution=512, clip=gs.ClipSpace(False, False))
pictures = []
with gs.Renderer() as renderer:
    for name, perspective in (("orthographic", False), ("perspective", True)):
        light = gs.scenes.landscape_light(perspective=perspective, shadow=shadow)
        frame = renderer.render(scene, lights=[light], size=(480, 360), outputs=("image", "visibility", "shadow_maps"))
        view, depth = frame.used[0].views[0], frame.shadow_maps[0][0]
        drawn = depth[depth < 1.0]
        print(
            f"{name}: window depth of what is drawn: least {drawn.min():.3f}, median {np.median(drawn):.3f}, greatest {drawn.max():.3f}"
        )
        near, far = (1.0, 1.0) if not perspective else (view.near, view.far)
        print(
            f"  a texel is {view.texel[0] * near:.3f} units wide at the near plane, {view.texel[0] * far:.3f} at the far plane"
        )
        print(f"  bias matrix x P x V:\n{np.array2string(view.uvz_from_world, precision=4, suppress_small=True)}")
        grey = np.clip((depth - drawn.min()) / max(float(np.ptp(drawn)), 1e-9), 0.0, 1.0)
        preview = np.repeat((255.0 * grey[::2, ::2]).astype(np.uint8)[..., None], 3, axis=-1)
        side = np.zeros((360, 256, 3), dtype=np.uint8)
        side[52:308] = preview
        pictures.append(np.hstack([frame.image, side]))
image.write("15_light_projection.png", np.vstack(pictures))
