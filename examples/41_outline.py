"""The shadow of a courtyard as polygons. Look at: red lines, which are the borders of the shadows on the floor, and its area.

Also writes them as GeoJSON with a coordinate reference system, and as SVG. On a sphere or a ramp the image has the shadow there.
"""

from PIL import Image, ImageDraw

import glshadow as gs

scene = gs.scenes.courtyard()
camera = gs.PerspectiveCamera((0.5, 15.0, 9.0), (-0.5, 0.0, 0.8), fov_y=36.0)
floor = ((0, 0, 0), (0, 1, 0))
outline = gs.shadow_outline(scene, plane=floor, of=["columns", "torus", "sphere", "ramp"])
print(outline)
print(f"the torus alone: {gs.shadow_outline(scene, plane=floor, of='torus').area:.4f}")

size = (960, 540)
frame = gs.render(scene, camera, size=size)
R, t = camera.opencv()
drawing = ImageDraw.Draw(shown := Image.fromarray(frame.image))
for exterior, holes in outline.world:
    for ring in (exterior, *holes):
        seen = (ring @ R.T + t) @ camera.K(size).T
        drawing.line([(x / z, y / z) for x, y, z in seen], fill=(220, 40, 20), width=2)
shown.save("41_outline.png")

outline.to_geojson("41_outline.geojson", crs="EPSG:25832", offset=(367000.0, 5621000.0))
outline.to_svg("41_outline.svg")
