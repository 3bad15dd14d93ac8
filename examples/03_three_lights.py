"""Sun, spot and point light together. Look at: three shadows of each column in three colours, adding up, without seams."""

import glshadow as gs

scene = gs.scenes.courtyard()
lights = [
    gs.DirectionalLight(direction=(-0.55, -0.8, -0.25), color=(1.0, 0.9, 0.7), intensity=0.5),
    gs.SpotLight(position=(4, 7, 5), direction=(-4, -7, -5), color=(0.2, 0.4, 1.0)),
    gs.PointLight(position=(0.5, 2.2, 0.8), color=(1.0, 0.2, 0.1), range=8.0),
]
frame = gs.render(scene, lights=lights, path="03_three_lights.png")
for light, used in zip(lights, frame.used, strict=True):
    print(f"{type(light).__name__:17s} {len(used.views)} views, {used.target}, clip {used.clip}, {used.draws} draws")
