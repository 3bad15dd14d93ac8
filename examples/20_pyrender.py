"""One changed line in a pyrender program. Look at: the ring's soft shadow under a point light, which pyrender does not draw.

Needs `pip install 'glshadow[pyrender]'`: for the scene, which is pyrender's.
"""

import numpy as np
import pyrender
import trimesh
from numpy.typing import NDArray

import glshadow as gs
from glshadow import image


def turned(angle: float) -> NDArray[np.float64]:
    """About x, in radians."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[1, 0, 0, 0], [0, c, -s, 0], [0, s, c, 0], [0, 0, 0, 1]])


ring = trimesh.creation.torus(0.6, 0.15, 128, 64, transform=turned(1.3))
ring.apply_translation([0, 0.9, 0])
ring.visual.vertex_colors = (214, 120, 60, 255)
floor = trimesh.creation.box((6, 0.1, 6))
floor.apply_translation([0, -0.05, 0])
scene = pyrender.Scene(ambient_light=(0.25, 0.25, 0.28))
scene.add(pyrender.Mesh.from_trimesh(ring))
scene.add(pyrender.Mesh.from_trimesh(floor))
lamp = np.eye(4)
lamp[:3, 3] = (1.2, 2.6, 0.8)
scene.add(pyrender.PointLight(intensity=25.0), pose=lamp)
camera = turned(-0.5)
camera[:3, 3] = (0.0, 2.4, 3.4)
scene.add(pyrender.PerspectiveCamera(yfov=0.9), pose=camera)

renderer = gs.PyrenderRenderer(640, 480, radius=0.15)  # was: pyrender.OffscreenRenderer(640, 480)
color, depth = renderer.render(scene, flags=pyrender.RenderFlags.SHADOWS_POINT)
renderer.delete()

image.write("20_pyrender.png", color)
print(f"{color.shape} {color.dtype}, depth {depth[depth > 0].min():.2f} to {depth.max():.2f}")
