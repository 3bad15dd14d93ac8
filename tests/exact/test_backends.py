"""Exact() under OSMesa, and in a context that belongs to another program."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

import moderngl
import numpy as np
import pytest

import glshadow as gs
from glshadow.errors import ContextError
from glshadow.gl.driver.entry_points import EntryPoints
from glshadow.gl.driver.state import read_state
from glshadow.lights import Light
from glshadow.renderer import Renderer
from glshadow.scene.nodes import Node, Scene

from .test_casters import LIGHTS, leaf, leaves, placed, scene_of

SIZE = (320, 180)


def exact(light: Light) -> Light:
    return replace(light, shadow=gs.Shadow(filter=gs.Exact()))


@pytest.fixture(scope="module")
def masked() -> Scene:
    image = leaves(8, 6)
    return scene_of(
        Node(leaf(image), placed(-1.0, 1.0, 0.0, 1), "a"),
        Node(leaf(image, 2.0), placed(1.0, 1.4, -0.5, 3), "b"),
        name="masked",
    )


# -- OSMesa


def test_osmesa_renders_the_same_image(renderer: Renderer, masked: Scene, optional: Callable[[str, str], None]) -> None:
    try:
        other = Renderer("osmesa")
    except ContextError:
        optional("OSMesa", "libosmesa6")
    with other:
        lights = [exact(light) for light in LIGHTS.values()]
        for samples in (1, 4):
            ours, theirs = (
                each.render(masked, None, lights, SIZE, outputs=("visibility", "linear"), samples=samples)
                for each in (renderer, other)
            )
            np.testing.assert_array_equal(theirs.visibility, ours.visibility)
            np.testing.assert_array_equal(theirs.linear, ours.linear)


# -- a context of another program


@pytest.fixture
def foreign(built_on_the_gpu: None) -> Iterator[moderngl.Context]:
    with moderngl.create_context(
        standalone=True, backend="egl", require=430, libgl="libEGL.so.1", libegl="libEGL.so.1"
    ) as ctx:
        yield ctx
    ctx.release()


@pytest.mark.parametrize("samples", [1, 4])
def test_foreign_context_state_is_restored(
    foreign: moderngl.Context, renderer: Renderer, masked: Scene, samples: int
) -> None:
    """Storage buffers, image units, blending and more: bound by the caller, used to build the triangle lists, restored."""
    buffers = [foreign.buffer(bytes([i]) * 64) for i in range(6)]
    for binding, buffer in enumerate(buffers):
        buffer.bind_to_storage_buffer(binding)
    image = foreign.texture((4, 4), 1, dtype="u4", data=bytes(range(64)))
    image.bind_to_image(0, read=True, write=False)
    image.bind_to_image(3, read=True, write=True)
    table = foreign.texture((2, 2), 4, bytes(16))
    table.use(7)
    foreign.simple_framebuffer((8, 8)).use()
    foreign.enable_only(moderngl.BLEND | moderngl.CULL_FACE)
    foreign.blend_func = moderngl.ONE_MINUS_SRC_ALPHA, moderngl.DST_COLOR
    foreign.depth_func = ">"
    foreign.cull_face = "front"
    gl = EntryPoints(foreign.mglo._context.load_opengl_function)
    state = read_state(foreign, gl)
    lights = [exact(light) for light in LIGHTS.values()]
    expected = renderer.render(masked, None, lights, SIZE, outputs=("visibility", "image"), samples=samples)
    with Renderer(context=foreign) as adopted:
        for _ in range(2):
            frame = adopted.render(masked, None, lights, SIZE, outputs=("visibility", "image"), samples=samples)
            np.testing.assert_array_equal(frame.visibility, expected.visibility)
            np.testing.assert_array_equal(frame.image, expected.image)
            assert read_state(foreign, gl) == state
            assert foreign.error == "GL_NO_ERROR"
    assert read_state(foreign, gl) == state
    assert [buffer.read() for buffer in buffers] == [bytes([i]) * 64 for i in range(6)]
    assert image.read() == bytes(range(64))
    assert foreign.error == "GL_NO_ERROR"
