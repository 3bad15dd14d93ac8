"""Shadows in a plain moderngl program of your own. Look at: the lines between "shadow" comments; all else was there before.

A foreign program with its own buffers, shaders and matrices: ours draws the map through its callback and hands out GLSL.
"""

from typing import Any

import moderngl
import numpy as np

import glshadow as gs
from glshadow import image
from glshadow.core.spaces import ClipSpace, perspective
from glshadow.scene import shapes

SIZE = (960, 540)
VERTEX = """#version 330
uniform mat4 camera; in vec3 place; in vec3 direction; out vec3 position; out vec3 normal;
void main() { position = place; normal = direction; gl_Position = camera * vec4(place, 1.0); }"""
FRAGMENT = """
in vec3 position; in vec3 normal; out vec4 color;
void main() {
    float light = 0.25 + 0.75 * max(dot(normal, sun_towards(position)), 0.0) * sun_visibility(position, normal); // shadow
    color = vec4(pow(vec3(0.8, 0.78, 0.74) * light, vec3(1.0 / 2.2)), 1.0);
}"""

headless: Any = {"standalone": True, "backend": "egl"}
ctx = moderngl.create_context(**headless)
boxes = [
    shapes.box((8, 0.2, 8), (0, -0.1, 0)),
    *(shapes.box((0.6, 1 + x / 4, 0.6), (x, 0.5 + x / 8, -x / 2)) for x in range(-3, 4)),
]
corners = np.concatenate([positions[triangles] for positions, triangles in boxes]).astype("f4")
normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
normals = np.repeat(normals / np.linalg.norm(normals, axis=1, keepdims=True), 3, axis=0).astype("f4")
places, directions = ctx.buffer(corners.tobytes()), ctx.buffer(normals.tobytes())

# shadow: a map of a sun over the program's bounds, drawn with the program's own buffers
shadow = gs.ShadowMap(
    ctx, gs.DirectionalLight(direction=(0.4, -0.8, 0.6)), [corners.min(axis=(0, 1)), corners.max(axis=(0, 1))]
)


def cast(caster: gs.Caster) -> None:
    caster.place()
    ctx.vertex_array(caster.program, [(places, "3f", "in_position")]).render()


shadow.draw(cast)
program = ctx.program(vertex_shader=VERTEX, fragment_shader=shadow.source("sun") + FRAGMENT)
shadow.apply(program, "sun", unit=0)
# shadow: that is all

camera = gs.PerspectiveCamera(position=(5, 5, 7), target=(0, 0.3, 0), fov_y=45)
matrix = perspective(*camera.window(SIZE), 0.1, 50.0, ClipSpace(False, False)) @ camera.view_from_world
program["camera"] = tuple(matrix.T.ravel())
target = ctx.framebuffer([ctx.texture(SIZE, 3)], ctx.depth_renderbuffer(SIZE))
target.use()
target.clear(0.8, 0.82, 0.84)
ctx.enable(moderngl.DEPTH_TEST)
ctx.vertex_array(program, [(places, "3f", "place"), (directions, "3f", "direction")]).render()
image.write("18_own_program.png", np.frombuffer(target.read(), np.uint8).reshape(SIZE[1], SIZE[0], 3)[::-1])
