"""Checks that need a display; test_context.py runs each in a process of its own, because glfw dies with its X server."""

import sys

import glfw
import moderngl

from glshadow.gl.driver.context import GLContext, open_context
from glshadow.gl.driver.current import current
from glshadow.gl.driver.state import read_state


def paint(glcontext: GLContext, value: int) -> int:
    with glcontext as context:
        framebuffer = context.ctx.simple_framebuffer((2, 2))
        framebuffer.clear(*[value / 255] * 4)
        context.check_errors("painting")
        return framebuffer.read()[0]


def host() -> tuple[object, moderngl.Context]:
    """A program with a window of its own, as moderngl's users write it."""
    assert glfw.init()
    glfw.window_hint(glfw.VISIBLE, False)
    window = glfw.create_window(16, 16, "host", None, None)
    glfw.make_context_current(window)
    return window, moderngl.create_context(require=330)


def backend() -> None:
    context = open_context("window")
    assert current() == {}
    assert not glfw.get_current_context()
    assert context.caps.backend == "window"
    assert paint(context, 11) == 11
    second = open_context("window")
    with context:
        assert paint(second, 12) == 12
        assert paint(context, 13) == 13
    second.release()
    assert paint(context, 14) == 14
    context.release()


def host_window() -> None:
    window, ctx = host()
    place = current()
    assert place
    adopted = open_context(context=ctx)
    before = read_state(ctx, adopted.gl)
    screen = ctx.fbo
    with adopted.drawing():
        assert paint(adopted, 21) == 21
        ctx.enable_only(moderngl.DEPTH_TEST)
    assert current() == place
    assert read_state(ctx, adopted.gl) == before
    assert ctx.fbo is screen
    adopted.release()
    ctx.clear(1.0, 1.0, 1.0)
    glfw.swap_buffers(window)
    assert ctx.error == "GL_NO_ERROR"


def egl_beside_window() -> None:
    """glvnd refuses EGL while GLX is current; the host's context is restored all the same."""
    _, ctx = host()
    place = current()
    texture = ctx.texture((2, 2), 4, bytes([7] * 16))
    own = open_context("egl")
    assert current() == place
    assert paint(own, 31) == 31
    assert current() == place
    assert texture.read()[0] == 7
    own.release()
    assert texture.read()[0] == 7


if __name__ == "__main__":
    {"backend": backend, "host_window": host_window, "egl_beside_window": egl_beside_window}[sys.argv[1]]()
