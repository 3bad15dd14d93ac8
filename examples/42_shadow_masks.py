"""A training set from one view. Look at: the mask of each node's shadow in a colour, the image without shadows, the shadows alone.

Masks are counterfactual: each is what its node alone would darken. Writes COCO annotations and four folders of images, too.
"""

import numpy as np

import glshadow as gs

scene = gs.scenes.courtyard()
camera = gs.PerspectiveCamera((5.0, 6.0, 9.0), (-0.5, 0.6, 1.5), fov_y=40.0)
with gs.Renderer() as renderer:
    pair = gs.shadow_pair(scene, camera, size=(480, 320), renderer=renderer, outputs=("triangle", "node"))
    frame = renderer.render(scene, camera, size=(480, 320), outputs=("blocker", "blocker_distance"))
masks = gs.shadow_masks(pair.shadowed, of=["columns", "torus", "sphere", "fence", "ramp"])
print(masks)
print(pair)

coco = gs.to_coco({"0001.png": masks}, "42_shadows.json")
print(len(coco["annotations"]), "annotations;", coco["annotations"][1]["name"], coco["annotations"][1]["bbox"])
pair.save("42_set", "0001.png")

names = [scene.nodes[i].name for i in np.unique(frame.blocker[0]) if i >= 0]
print("blockers:", ", ".join(names))

colors = np.array([(60, 90, 220), (230, 120, 20), (30, 160, 60), (200, 30, 160), (220, 200, 30)])
shown = pair.shadowed.image.astype(float)
for color, mask in zip(colors, masks.shadows, strict=True):
    shown[mask] = 0.4 * shown[mask] + 0.6 * color
tiles = [pair.shadowed.image, shown.astype(np.uint8), pair.shadow_free.image, pair.matte[..., None].repeat(3, axis=2)]
gs.image.write("42_shadow_masks.png", np.vstack([np.hstack(tiles[:2]), np.hstack(tiles[2:])]))
