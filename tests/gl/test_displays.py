"""The EGL display of a context: survives other programs that terminate theirs; if it is terminated, errors and release are clean."""

import ctypes as C
import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import moderngl
import numpy as np
import pytest

import glshadow as gs
from glshadow.gl.driver import backends, egl
from glshadow.gl.driver.context import open_context
from glshadow.gl.driver.current import current

from ..tolerances import PATIENCE_S

PYRENDER_CHECKS = Path(__file__).with_name("pyrender_checks.py")
SIZE = (48, 32)


def run_python(*arguments: str, **environment: str) -> None:
    done = subprocess.run(
        [sys.executable, *arguments],
        env=os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)} | environment,
        capture_output=True,
        text=True,
        timeout=PATIENCE_S,
        check=False,
    )
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("check", ["after", "before", "interleaved", "threads"])
def test_beside_pyrender(check: str) -> None:
    run_python(str(PYRENDER_CHECKS), check, PYOPENGL_PLATFORM="egl")


# -- a display that another program terminates

LIBRARY = C.CDLL(backends.EGL_LIBRARY)
terminate = C.CFUNCTYPE(C.c_uint, C.c_void_p)(("eglTerminate", LIBRARY))


class OnDevice(egl.Egl):
    """Offers the first device's display only, as on systems without a surfaceless one."""

    def _candidates(self) -> list[int]:
        return [self._calls["eglGetPlatformDisplayEXT"](0x313F, self._device, None)]


@pytest.fixture
def end_display(monkeypatch: pytest.MonkeyPatch) -> Iterator[Callable[[], None]]:
    """Contexts of this test use a shared display; call this to terminate it."""
    shared = OnDevice(LIBRARY)
    monkeypatch.setattr(backends, "load_egl", lambda _: shared)

    def end() -> None:
        assert shared._displays[None]
        assert terminate(shared._displays[None])

    yield end
    assert current() == {}


@pytest.mark.parametrize("initialised_again", [False, True])
def test_terminated_display_is_named_and_released_quietly(
    end_display: Callable[[], None], initialised_again: bool
) -> None:
    scene = gs.scenes.box().scene
    with gs.Renderer("egl") as renderer:
        expected = renderer.render(scene, size=SIZE, samples=1).image
        end_display()
        other = gs.Renderer("egl") if initialised_again else None
        with pytest.raises(gs.ContextError, match=r"terminated the EGL display.*pyrender.*make a new Renderer"):
            renderer.render(scene, size=SIZE, samples=1)
    renderer.release()
    with pytest.raises(gs.GlshadowError, match="released"):
        renderer.render(scene, size=SIZE, samples=1)
    for later in (other or gs.Renderer("egl"), gs.Renderer("egl")):
        with later:
            np.testing.assert_array_equal(later.render(scene, size=SIZE, samples=1).image, expected)


def test_display_terminated_inside_the_block(end_display: Callable[[], None]) -> None:
    with gs.Renderer("egl") as renderer, renderer._context:
        end_display()
    assert renderer._context.released


def test_foreign_context_of_a_terminated_display(end_display: Callable[[], None]) -> None:
    context = open_context("egl")
    with gs.Renderer(context=context.ctx) as renderer:
        end_display()
        with pytest.raises(gs.ContextError, match="terminated the EGL display"):
            renderer.render(gs.scenes.box().scene, size=SIZE, samples=1)
    context.release()


# -- which display is used


def test_own_display_on_the_first_device() -> None:
    """Another display than that of moderngl and pyrender, but the same driver."""
    host = moderngl.create_context(
        standalone=True, backend="egl", require=330, libgl="libEGL.so.1", libegl="libEGL.so.1"
    )
    theirs = current()["_Egl"][1]
    context = open_context("egl")
    with context:
        assert current()["_Egl"][1] != theirs
        assert context.caps.renderer == host.info["GL_RENDERER"]
    context.release()
    with host:
        pass
    host.release()


ONLY_DEFAULT = """
from glshadow.gl.driver import backends
from glshadow.gl.driver.egl import Egl
class Old(Egl):
    def __init__(self, library):
        super().__init__(library)
        self._extensions, self._device = set(), None
        for name in ("eglGetPlatformDisplayEXT", "eglQueryDevicesEXT", "eglQueryDisplayAttribEXT"):
            self._calls.pop(name, None)
import ctypes
old = Old(ctypes.CDLL(backends.EGL_LIBRARY))
backends.load_egl = lambda _: old
import glshadow as gs
with gs.Renderer("egl") as renderer:
    assert renderer.render(gs.scenes.box().scene, size=(48, 32)).image.any()
assert old._displays[None] == old._calls["eglGetDisplay"](None)
"""


def test_only_the_default_display() -> None:
    """EGL 1.4 without client extensions: glvnd off, an old driver."""
    run_python("-c", ONLY_DEFAULT, EGL_PLATFORM="surfaceless")


FREE_FIRST = """
import ctypes as C
egl = C.CDLL("libEGL.so.1")
default = C.CFUNCTYPE(C.c_void_p, C.c_void_p)(("eglGetDisplay", egl))(None)
assert C.CFUNCTYPE(C.c_uint, C.c_void_p, C.c_void_p, C.c_void_p)(("eglInitialize", egl))(default, None, None)
import glshadow as gs
with gs.Renderer("egl") as renderer:
    image = renderer.render(gs.scenes.box().scene, size=(48, 32)).image
    C.CFUNCTYPE(C.c_uint, C.c_void_p)(("eglTerminate", egl))(default)
    assert (renderer.render(gs.scenes.box().scene, size=(48, 32)).image == image).all()
"""


def test_display_in_use_is_not_shared() -> None:
    """EGL_PLATFORM=surfaceless makes the default display the one that we would otherwise use."""
    run_python("-c", FREE_FIRST, EGL_PLATFORM="surfaceless")


def test_missing_display_names_the_failed_call(monkeypatch: pytest.MonkeyPatch) -> None:
    class Without(egl.Egl):
        def _candidates(self) -> list[int]:
            return []

    monkeypatch.setattr(backends, "load_egl", lambda _: Without(LIBRARY))
    with pytest.raises(gs.ContextError, match=r"eglInitialize failed.*apt-get install libegl1 libgl1-mesa-dri"):
        open_context("egl")


def test_bound_api_is_kept() -> None:
    """A program that renders with OpenGL ES keeps it bound."""
    bind, bound = LIBRARY.eglBindAPI, LIBRARY.eglQueryAPI
    before = bound()
    assert bind(0x30A0)  # EGL_OPENGL_ES_API
    open_context("egl").release()
    assert bound() == 0x30A0
    bind(before)
