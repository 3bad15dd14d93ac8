"""A glTF file's animation: frames at any times, and a video of them. Look at: the pendulum and its shadow swing, the posts stand."""

import base64
import json
from pathlib import Path

import numpy as np

import glshadow as gs
from glshadow import image, video

# a file with an animation: two posts and a pendulum, all of one box; any other .glb or .gltf does as well
CORNERS = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], dtype="<f4")
SIDES = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
TRIANGLES = np.array([[a, b, c, a, c, d] for a, b, c, d in SIDES], dtype="<u2").ravel()
TIMES = np.linspace(0, 2, 9, dtype="<f4")
ANGLES = 0.9 * np.cos(np.pi * TIMES)
TURNS = np.stack([0 * ANGLES, 0 * ANGLES, np.sin(ANGLES / 2), np.cos(ANGLES / 2)], axis=1).astype("<f4")
ARRAYS = [(CORNERS, 5126, "VEC3"), (TRIANGLES, 5123, "SCALAR"), (TIMES, 5126, "SCALAR"), (TURNS, 5126, "VEC4")]
starts = np.cumsum([0, *(array.nbytes for array, _, _ in ARRAYS)])
data = b"".join(array.tobytes() for array, _, _ in ARRAYS)
model = {
    "asset": {"version": "2.0"},
    "scenes": [{"nodes": [0, 1, 2]}],
    "nodes": [
        {"mesh": 0, "translation": [-2, 2, 0], "scale": [0.1, 2, 0.3]},
        {"mesh": 0, "translation": [2, 2, 0], "scale": [0.1, 2, 0.3]},
        {"name": "pivot", "translation": [0, 4, 0], "children": [3, 4]},
        {"mesh": 0, "translation": [0, -1.5, 0], "scale": [0.05, 1.5, 0.05]},
        {"mesh": 0, "translation": [0, -3, 0], "scale": [0.4, 0.4, 0.4]},
    ],
    "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
    "animations": [
        {
            "name": "swing",
            "samplers": [{"input": 2, "output": 3}],
            "channels": [{"sampler": 0, "target": {"node": 2, "path": "rotation"}}],
        }
    ],
    "buffers": [{"byteLength": len(data), "uri": f"data:;base64,{base64.b64encode(data).decode()}"}],
    "bufferViews": [
        {"buffer": 0, "byteOffset": int(start), "byteLength": array.nbytes}
        for start, (array, _, _) in zip(starts[:-1], ARRAYS, strict=True)
    ],
    "accessors": [
        {"bufferView": k, "componentType": kind, "type": shape, "count": len(array)}
        for k, (array, kind, shape) in enumerate(ARRAYS)
    ],
}
Path("pendulum.gltf").write_text(json.dumps(model))

scene = gs.load("pendulum.gltf", ground=True)
times = np.arange(0, scene.duration, 1 / 6)
scene = scene.framed(times)  # the camera sees the whole motion, the ground lies below all of it
with gs.Renderer() as renderer:
    pictures = [frame.image for frame in renderer.animation(scene, times, size=(320, 240))]

image.write("24_animation.png", np.vstack([np.hstack(pictures[0:3]), np.hstack(pictures[3:6])]))
video.write("24_animation.webp", pictures, fps=6)
