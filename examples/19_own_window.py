"""Shadows in a moderngl-window program. Look at: the shadow of the moving spot light; without a screen one frame is drawn and saved.

Needs `pip install moderngl-window`.
"""

import logging
import os
from typing import Any

import numpy as np
from moderngl_window import geometry, run_window_config
from moderngl_window.context.base import WindowConfig
from pyglm import glm

import glshadow as gs
from glshadow import image

VERTEX = """#version 330
uniform mat4 camera; uniform vec3 offset; in vec3 in_position; in vec3 in_normal; out vec3 position; out vec3 normal;
void main() { position = in_position + offset; normal = in_normal; gl_Position = camera * vec4(position, 1.0); }"""
FRAGMENT = """
in vec3 position; in vec3 normal; out vec4 color;
void main() {
    vec3 n = normalize(normal);
    float light = 0.25 + 0.75 * max(dot(n, lamp_towards(position)), 0.0) * lamp_visibility(position, n);
    color = vec4(pow(vec3(0.85, 0.7, 0.55) * light, vec3(1.0 / 2.2)), 1.0);
}"""


class Turning(WindowConfig):
    gl_version, window_size, title, log_level = (3, 3), (960, 540), "glshadow in moderngl-window", logging.ERROR

    def __init__(self, **options: Any) -> None:
        super().__init__(**options)
        cube, ball, ground = geometry.cube(size=(1, 1, 1)), geometry.sphere(0.7), geometry.cube(size=(8, 0.2, 8))
        self.things = {ground: (0.0, -0.1, 0.0), cube: (-1.0, 0.5, 0.0), ball: (1.0, 0.9, 0.5)}
        self.shadow = gs.ShadowMap(self.ctx, lamp(0.0), [(-4, -0.2, -4), (4, 2, 4)])
        self.program = self.ctx.program(vertex_shader=VERTEX, fragment_shader=self.shadow.source("lamp") + FRAGMENT)

    def cast(self, caster: gs.Caster) -> None:
        for thing, (x, y, z) in self.things.items():
            caster.place(np.array([[1, 0, 0, x], [0, 1, 0, y], [0, 0, 1, z], [0, 0, 0, 1.0]]))
            thing.render(caster.program)

    def on_render(self, time: float, frame_time: float) -> None:
        self.shadow.fit(lamp(time))
        self.shadow.draw(self.cast)
        self.shadow.apply(self.program, "lamp", unit=0)
        view = gs.PerspectiveCamera(position=(4, 4, 6), target=(0, 0.4, 0), fov_y=45)
        matrix = np.array(glm.perspective(glm.radians(45.0), self.wnd.aspect_ratio, 0.1, 50.0)) @ view.view_from_world
        self.program["camera"] = tuple(matrix.T.ravel())
        self.ctx.clear(0.8, 0.82, 0.84)
        self.ctx.enable(self.ctx.DEPTH_TEST)
        for thing, offset in self.things.items():
            self.program["offset"] = offset
            thing.render(self.program)
        if not os.environ.get("DISPLAY"):
            width, height = self.wnd.size
            image.write(
                "19_own_window.png", np.frombuffer(self.wnd.fbo.read(), np.uint8).reshape(height, width, 3)[::-1]
            )
            self.wnd.close()


def lamp(time: float) -> gs.SpotLight:
    place = (4.0 * float(np.sin(time)), 5.0, 4.0 * float(np.cos(time)))
    return gs.SpotLight(position=place, direction=(-place[0], -5.0, -place[2]), outer_angle=40.0)


if __name__ == "__main__":
    run_window_config(Turning, args=None if os.environ.get("DISPLAY") else ["--window", "headless", "--backend", "egl"])
