"""A window that shows a scene. Look at: press h for the keys; e shows the errors, a moves the light, d shows its map."""

import trimesh

import glshadow as gs

knot = trimesh.creation.torus(1.0, 0.35)
scene = gs.load(knot, ground=True, up_axis="z")
lamp = gs.SpotLight(position=(2, 5, 3), direction=(-2, -5, -3), shadow=gs.Shadow(filter=gs.Pcf(2)))
try:
    gs.show(scene, lights=[lamp])
except gs.ContextError as error:  # on a machine without a screen
    print(error)
