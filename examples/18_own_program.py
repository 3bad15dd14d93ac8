"""Shadows in a plain moderngl program of your own. Look at: the lines between "shadow" comments; everything else is the program's own.

A foreign program with its own buffers, shaders and matrices: ours draws the map through its callback and hands out GLSL.
"""

from typing import Any

import moderngl
import numpy as np
import trimesh

import glshadow as gs
from glshadow import image

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
boxes = [trimesh.creation.box(bounds=[(-4, -0.2, -4), (4, 0, 4)])]
boxes += [trimesh.creation.box(bounds=[(x, 0, -x / 2), (x + 0.6, 1 + x / 4, 0.6 - x / 2)]) for x in range(-3, 4)]
corners = np.concatenate([box.triangles for box in boxes]).astype("f4")
normals = np.concatenate([np.repeat(box.face_normals, 3, axis=0) for box in boxes]).astype("f4")
places, directions = ctx.buffer(corners.tobytes()), ctx.buffer(normals.tobytes())

# shadow: a map of a sun over the program's bounds, drawn with the program's own buffers
shadow = gs.ShadowMap(
    ctx, gs.DirectionalLight(direction=(0.7, -0.7, -0.35)), [corners.min(axis=(0, 1)), corners.max(axis=(0, 1))]
)


def cast(caster: gs.Caster) -> None:
    caster.place()
    ctx.vertex_array(caster.program, [(places, "3f", "in_position")]).render()


shadow.draw(cast)
program = ctx.program(vertex_shader=VERTEX, fragment_shader=shadow.source("sun") + FRAGMENT)
shadow.apply(program, "sun", unit=0)
# shadow: that is all

camera = gs.PerspectiveCamera(position=(5, 5, 7), target=(0, 0.3, 0), fov_y=45)
near, far, (left, right, bottom, top) = 0.1, 50.0, camera.window(SIZE)  # of the view at distance 1
matrix = np.diag([2 / (right - left), 2 / (top - bottom), (far + near) / (near - far), 0.0])
matrix[2, 3], matrix[3, 2] = 2 * far * near / (near - far), -1.0
matrix = matrix @ camera.view_from_world
program["camera"] = tuple(matrix.T.ravel())
target = ctx.framebuffer([ctx.texture(SIZE, 3)], ctx.depth_renderbuffer(SIZE))
target.use()
target.clear(0.8, 0.82, 0.84)
ctx.enable(moderngl.DEPTH_TEST)
ctx.vertex_array(program, [(places, "3f", "place"), (directions, "3f", "direction")]).render()
image.write("18_own_program.png", np.frombuffer(target.read(), np.uint8).reshape(SIZE[1], SIZE[0], 3)[::-1])
