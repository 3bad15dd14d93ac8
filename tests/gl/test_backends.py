"""The same image through every backend, in several contexts at once, on several threads, and in a foreign context."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from ctypes import CDLL
from typing import Any

import moderngl
import numpy as np
import pytest

from glshadow import scenes as builtin
from glshadow.errors import ContextError
from glshadow.frame import Frame
from glshadow.gl.driver.backends import OSMESA_LIBRARIES
from glshadow.gl.driver.current import current
from glshadow.gl.driver.entry_points import EntryPoints
from glshadow.gl.driver.state import read_state
from glshadow.lights import DirectionalLight, Light, PointLight, SpotLight
from glshadow.renderer import Renderer
from glshadow.scene.nodes import Scene
from glshadow.shadows.fits import SceneFit
from glshadow.shadows.metric import Target
from glshadow.shadows.shadow import Shadow

from ..tolerances import PATIENCE_S

SIZE = (96, 64)
OUTPUTS = ("image", "visibility", "depth", "linear", "shadow_maps")


def lights() -> list[Light]:
    """Every kind of light, depth and metric targets, both directions of depth."""
    return [
        DirectionalLight(direction=(-0.6, -1.0, 0.4), intensity=0.5, shadow=Shadow(resolution=256)),
        SpotLight(position=(2.0, 5.0, 2.0), direction=(-2.0, -5.0, -2.0), intensity=0.3, shadow=Shadow(resolution=128)),
        PointLight(position=(-2.0, 4.0, 1.0), intensity=0.2, shadow=Shadow(resolution=64, target=Target.R32F)),
    ]


@pytest.fixture(scope="module")
def scene() -> Scene:
    return builtin.box().scene


def picture(renderer: Renderer, scene: Scene) -> Frame:
    return renderer.render(scene, lights=lights(), size=SIZE, outputs=OUTPUTS, samples=1)


def assert_identical(a: Frame, b: Frame) -> None:
    for name in OUTPUTS:
        for one, other in zip(getattr(a, name), getattr(b, name), strict=True):
            np.testing.assert_array_equal(one, other, err_msg=name)


@pytest.fixture(scope="module")
def expected(scene: Scene) -> Frame:
    with Renderer("egl") as renderer:
        frame = picture(renderer, scene)
    for visibility in frame.visibility:
        assert (visibility > 0.9).any(), "all dark"
        assert (visibility < 0.1).any(), "all lit"
    return frame


@pytest.fixture
def osmesa(optional: Callable[[str, str], None]) -> Iterator[Renderer]:
    for name in OSMESA_LIBRARIES:
        try:
            CDLL(name)
        except OSError:
            continue
        with Renderer("osmesa") as renderer:
            yield renderer
        return
    optional("OSMesa", "libosmesa6")


def test_osmesa(osmesa: Renderer, scene: Scene, expected: Frame) -> None:
    """The same rasteriser in another context. Two builds of Mesa may round differently, but only in pixels at edges."""
    frame = picture(osmesa, scene)
    assert osmesa.info["backend"] == "osmesa"
    with Renderer("egl") as egl:
        same_driver = osmesa.info["renderer"] == egl.info["renderer"] and osmesa.info["version"] == egl.info["version"]
    if same_driver:
        assert_identical(frame, expected)
    difference = np.abs(frame.image.astype(int) - expected.image.astype(int)).max(axis=-1)
    assert (difference > 1).mean() <= 1e-3


def test_alternating_renderers(scene: Scene, expected: Frame) -> None:
    """Object names of two contexts collide: each renderer must draw with its own."""
    other_scene = builtin.room(rods=True).scene
    with Renderer("egl") as a, Renderer("egl") as b:
        there = picture(b, other_scene)
        for _ in range(3):
            assert_identical(picture(a, scene), expected)
            assert_identical(picture(b, other_scene), there)
        a.release()
        assert_identical(picture(b, other_scene), there)
    assert current() == {}


def test_backends_side_by_side(osmesa: Renderer, scene: Scene, expected: Frame) -> None:
    with Renderer("egl") as egl:
        first = picture(osmesa, scene)
        for _ in range(2):
            assert_identical(picture(egl, scene), expected)
            assert_identical(picture(osmesa, scene), first)


def test_one_renderer_per_thread(scene: Scene, expected: Frame) -> None:
    start = threading.Barrier(3)

    def work(_: int) -> list[Frame]:
        start.wait(timeout=PATIENCE_S)
        with Renderer("egl") as renderer:
            return [picture(renderer, scene) for _ in range(3)]

    with ThreadPoolExecutor(3) as pool:
        for frames in pool.map(work, range(3)):
            for frame in frames:
                assert_identical(frame, expected)


def test_renderer_moves_to_another_thread(scene: Scene, expected: Frame) -> None:
    with Renderer("egl") as renderer, ThreadPoolExecutor(1) as pool:
        assert_identical(picture(renderer, scene), expected)
        assert_identical(pool.submit(picture, renderer, scene).result(timeout=PATIENCE_S), expected)
        assert_identical(picture(renderer, scene), expected)


def test_released_twice() -> None:
    renderer = Renderer("egl")
    renderer.release()
    renderer.release()
    assert current() == {}


# -- a foreign context


def foreign_context() -> moderngl.Context:
    names = {"libgl": "libEGL.so.1", "libegl": "libEGL.so.1"}  # the unversioned names belong to development packages
    return moderngl.create_context(standalone=True, backend="egl", require=330, **names)


@pytest.fixture
def foreign() -> Iterator[moderngl.Context]:
    with foreign_context() as ctx:
        yield ctx
    ctx.release()


class Painter:
    """A small program of the caller: draws a red quarter and reads it back."""

    def __init__(self, ctx: moderngl.Context) -> None:
        self.ctx = ctx
        self.program = ctx.program(
            "#version 330\nin vec2 a; void main() { gl_Position = vec4(a, 0.25, 1.0); }",
            "#version 330\nuniform sampler2D t; out vec4 o; void main() { o = texture(t, vec2(0.5)); }",
        )
        corners = np.array([-1, -1, 0, -1, -1, 0, 0, 0], dtype="f4")
        self.vertices = ctx.vertex_array(self.program, ctx.buffer(corners.tobytes()), "a")
        self.texture = ctx.texture((1, 1), 4, bytes([255, 0, 0, 255]))
        self.target = ctx.texture((4, 4), 4)
        self.framebuffer = ctx.framebuffer([self.target], ctx.depth_texture((4, 4)))

    def paint(self) -> bytes:
        self.framebuffer.use()
        self.ctx.viewport = (0, 0, 4, 4)
        self.framebuffer.clear(0.0, 0.0, 1.0, 1.0)
        self.texture.use(0)
        self.vertices.render(moderngl.TRIANGLE_STRIP)
        return bytes(self.target.read())


def test_foreign_context(foreign: moderngl.Context, scene: Scene, expected: Frame) -> None:
    """The context's state is restored, its objects still work, and it is never released."""
    painter = Painter(foreign)
    before = painter.paint()
    assert before[:4] == bytes([255, 0, 0, 255])
    assert before[-4:] == bytes([0, 0, 255, 255])
    gl = EntryPoints(foreign.mglo._context.load_opengl_function)
    painter.framebuffer.use()
    foreign.enable_only(moderngl.BLEND | moderngl.CULL_FACE)
    foreign.depth_func = ">"
    foreign.cull_face = "front"
    foreign.viewport = (1, 2, 3, 1)
    state = read_state(foreign, gl)
    with Renderer(context=foreign) as renderer:
        assert renderer.info["backend"] == "foreign"
        for _ in range(2):
            assert_identical(picture(renderer, scene), expected)
            assert read_state(foreign, gl) == state
            assert foreign.error == "GL_NO_ERROR"
    assert read_state(foreign, gl) == state
    foreign.enable_only(moderngl.NOTHING)
    assert painter.paint() == before
    assert foreign.error == "GL_NO_ERROR"


def test_foreign_context_draws_between_frames(foreign: moderngl.Context, scene: Scene, expected: Frame) -> None:
    painter = Painter(foreign)
    before = painter.paint()
    with Renderer(context=foreign) as renderer:
        for _ in range(3):
            assert_identical(picture(renderer, scene), expected)
            assert painter.paint() == before


def test_foreign_context_with_other_conventions(foreign: moderngl.Context, scene: Scene, expected: Frame) -> None:
    """State set by the caller does not affect the image."""
    foreign.enable_only(moderngl.BLEND | moderngl.CULL_FACE | moderngl.RASTERIZER_DISCARD)
    foreign.depth_func = ">"
    foreign.front_face = "cw"
    foreign.scissor = (0, 0, 1, 1)
    foreign.wireframe = True
    foreign.polygon_offset = (3.0, 4.0)
    with Renderer(context=foreign) as renderer:
        assert_identical(picture(renderer, scene), expected)
    assert foreign.wireframe
    assert foreign.scissor == (0, 0, 1, 1)
    assert foreign.polygon_offset == (3.0, 4.0)


def test_two_renderers_in_one_foreign_context(foreign: moderngl.Context, scene: Scene, expected: Frame) -> None:
    with Renderer(context=foreign) as a, Renderer(context=foreign) as b:
        assert_identical(picture(a, scene), expected)
        assert_identical(picture(b, scene), expected)
        a.release()
        assert_identical(picture(b, scene), expected)


def test_foreign_context_after_an_error(foreign: moderngl.Context, scene: Scene, expected: Frame) -> None:
    """A refused frame also restores the state."""
    gl = EntryPoints(foreign.mglo._context.load_opengl_function)
    foreign.enable_only(moderngl.BLEND)
    state = read_state(foreign, gl)
    huge = DirectionalLight(shadow=Shadow(resolution=16384, fit=SceneFit()))
    with Renderer(context=foreign) as renderer:
        with pytest.raises(Exception, match=r"shadow|limit|memory"):
            renderer.render(scene, lights=[huge] * 4, size=SIZE, samples=1)
        assert read_state(foreign, gl) == state
        assert_identical(picture(renderer, scene), expected)


@pytest.mark.parametrize("backend", ["glx", "vulkan"])
def test_unknown_backend(backend: Any) -> None:
    with pytest.raises(ValueError, match="backend must be one of"):
        Renderer(backend)


def test_no_context_is_a_named_error(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("glshadow.gl.driver.context.LOADERS", {})
    with pytest.raises(ContextError, match="no backend gives"):
        Renderer()
