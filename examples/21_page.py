"""A page for browsers. Look at: 21_page/index.html in any browser, also on a phone; drag to turn the model, press d for the shadow map."""

from dataclasses import replace

import glshadow as gs

scene = gs.scenes.courtyard()
lamp = gs.SpotLight(position=(5, 7, 4), direction=(-5, -7, -4), outer_angle=40)
page = gs.export_page(scene, "21_page", lights=[lamp], filter=gs.Pcf(2), resolution=1024)

# the same image here, by the same GLSL in desktop OpenGL's dialect
shadow = gs.Shadow(filter=gs.Pcf(2), resolution=1024, target=gs.Target.RGBA8)
gs.render(scene, lights=[replace(lamp, shadow=shadow)], size=(960, 540), path="21_page.png")
print(f"{page}: {page.stat().st_size / 1e6:.1f} MB")
