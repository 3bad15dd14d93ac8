"""Any trimesh mesh on a ground plane. Look at: the ring's shadow starts where the ring stands, and shows its hole."""

import numpy as np
import trimesh

import glshadow as gs

ring = trimesh.creation.torus(major_radius=1.0, minor_radius=0.3, major_sections=192, minor_sections=64)
cosine, sine = np.cos(np.radians(75)), np.sin(np.radians(75))
ring.apply_transform([[cosine, 0, sine, 0], [0, 1, 0, 0], [-sine, 0, cosine, 0], [0, 0, 0, 1]])

scene = gs.load(ring, ground=True, up_axis="z")
gs.render(scene, size=(800, 600), background=(0.75, 0.85, 0.95), path="02_own_mesh.png")
