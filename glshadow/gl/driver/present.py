"""Presenter: draws a finished image into the window of a context."""

from __future__ import annotations

import moderngl
import numpy as np
from numpy.typing import NDArray

_VERTEX = """#version 330
out vec2 v_place;
void main() {
    v_place = vec2(gl_VertexID == 1 ? 2.0 : 0.0, gl_VertexID == 2 ? 2.0 : 0.0);
    gl_Position = vec4(2.0 * v_place - 1.0, 0.0, 1.0);
}
"""
_FRAGMENT = """#version 330
uniform sampler2D u_image;
in vec2 v_place;
out vec4 o_color;
void main() {
    o_color = vec4(texture(u_image, vec2(v_place.x, 1.0 - v_place.y)).rgb, 1.0);
}
"""


class Presenter:
    """Draws images over the whole window."""

    def __init__(self, context: moderngl.Context) -> None:
        self._context = context
        self._program = context.program(vertex_shader=_VERTEX, fragment_shader=_FRAGMENT)
        self._array = context.vertex_array(self._program, [])
        self._texture: moderngl.Texture | None = None

    def show(self, image: NDArray[np.uint8], size: tuple[int, int]) -> None:
        """Draw an image (H, W, 3), row 0 at the top, into a window of this many pixels."""
        shape = (image.shape[1], image.shape[0])
        if self._texture is None or self._texture.size != shape:
            if self._texture is not None:
                self._texture.release()
            self._texture = self._context.texture(shape, 3, alignment=1)
        self._texture.write(np.ascontiguousarray(image).tobytes(), alignment=1)
        screen = self._context.screen
        screen.use()
        screen.viewport = (0, 0, *size)
        self._context.enable_only(moderngl.NOTHING)
        self._texture.use(0)
        self._array.render(moderngl.TRIANGLES, vertices=3)

    def release(self) -> None:
        """Free the GPU memory."""
        for thing in (self._texture, self._array, self._program):
            if thing is not None:
                thing.release()


def window_context() -> moderngl.Context:
    """A context for the window that is current."""
    return moderngl.create_context(require=330)
