"""Light on given points and on faces. Look at: the dark balls, which do not see the sun, and how the sky fades on the faces under the ramp.

Prints how many points of a grid see the sun, and the share of the sky that faces see, with its error.
"""

import numpy as np

import glshadow as gs
from glshadow import image

SIZE = (640, 400)
courtyard = gs.scenes.courtyard()
camera = gs.PerspectiveCamera((9.0, 7.0, 11.0), (0.0, 0.8, 0.0), fov_y=45.0)
sun = gs.DirectionalLight(direction=(-0.55, -0.8, -0.25))
x, z = np.meshgrid(np.linspace(-7.0, 7.0, 45), np.linspace(-7.0, 7.0, 45))
points = np.stack([x, np.full_like(x, 1.2), z], axis=-1).reshape(-1, 3)

with gs.Renderer() as renderer:
    seen = renderer.visibility(courtyard, points, [sun, gs.SkyLight()])
    print(f"{seen[0].mean():.1%} of {len(points)} points see the sun; of the sky they see {seen[1].mean():.3f}")
    colors = 0.08 + seen[0][:, None] * (0.9, 0.55, 0.1)
    balls = gs.Node(gs.Points(points, radius=0.07, colors=np.clip(colors, 0.0, 1.0)), casts=False)
    shown = gs.Scene([*courtyard.nodes, balls], camera)
    above = renderer.render(shown, lights=[sun], size=SIZE, outputs="image").image

# 80 x 80 squares in place of the floor's two triangles
line = np.linspace(-8.0, 8.0, 81)
x, z = (each.ravel() for each in np.meshgrid(line, line))
corner = (np.arange(80)[:, None] * 81 + np.arange(80)).ravel()
triangles = np.concatenate(
    [np.stack([corner, corner + 81, corner + 82], 1), np.stack([corner, corner + 82, corner + 1], 1)]
)
floor = gs.Node(gs.Mesh(np.stack([x, 0.0 * x, z], axis=1), triangles), name="floor")
scene = gs.Scene([floor, *courtyard.nodes[1:]], camera)
baked = gs.bake(scene, gs.SkyLight(), samples=4)
assert baked.error is not None
print(f"{baked}: mean {np.nanmean(baked.values):.3f}, error of a face {np.nanmean(baked.error):.3f}")
baked.to_gltf("35_points.glb")
below = gs.render(gs.load("35_points.glb", look="plain"), camera, [], SIZE, ambient=1.0).image
image.write("35_points.png", np.hstack([above, below]))
