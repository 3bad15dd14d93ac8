"""Three ways to make an OpenGL 3.3 core context without a visible window: EGL, OSMesa, a hidden glfw window."""

import ctypes as C
from collections.abc import Callable
from typing import Any, Self

import moderngl

from glshadow.errors import ContextError
from glshadow.gl.driver.current import Current, Switch, address, current, make_current
from glshadow.gl.driver.egl import load_egl
from glshadow.signals import undisturbed

EGL_LIBRARY = "libEGL.so.1"
OSMESA_LIBRARIES = ("libOSMesa.so.8", "libOSMesa.so.6", "libOSMesa.so")

_INSTALL_EGL = "apt-get install libegl1 libgl1-mesa-dri"
_INSTALL_OSMESA = "apt-get install libosmesa6 (Mesa 25.1 and later have no OSMesa: use EGL)"
_INSTALL_GLX = "apt-get install libgl1 libgl1-mesa-dri"


class BackendUnavailable(ContextError):
    """One backend cannot create a context on this machine; holds the reason and the remedy."""

    def __init__(self, reason: str, remedy: str) -> None:
        super().__init__(f"{reason}; {remedy}")
        self.reason = reason
        self.remedy = remedy


class Loader:
    """The interface that moderngl needs of a context: function addresses, making it current, releasing it."""

    standalone = True

    def __init__(self, place: Current, load: Callable[[str], int], destroy: Callable[[], object]) -> None:
        self.switch = Switch(place)
        self.load = load
        self.load_opengl_function = load
        self._destroy: Callable[[], object] | None = destroy

    def __enter__(self) -> Self:
        self.switch.__enter__()
        return self

    def __exit__(self, *_: object) -> None:
        # moderngl calls this without arguments.
        self.switch.__exit__()

    def release(self) -> None:
        if self._destroy is not None:
            self.switch.kill()
            self._destroy()
            self._destroy = None


def egl_loader(device: int | None = None) -> Loader:
    """Surfaceless EGL. libGL is not needed: every function address comes from libEGL. `device`: as in `Egl.open`.

    Raises
    ------
    BackendUnavailable
        With the reason and what to install.
    """
    try:
        egl = load_egl(EGL_LIBRARY)
        destroy = egl.open(device)
    except (OSError, ContextError) as error:
        raise BackendUnavailable(str(error), _INSTALL_EGL) from error
    return Loader(_place_or_refuse("EGL", _INSTALL_EGL), egl.address, destroy)


def osmesa_loader() -> Loader:
    """OSMesa, Mesa's off-screen library without a window system.

    Raises
    ------
    BackendUnavailable
        With the reason and what to install.
    """
    library = _first_library(OSMESA_LIBRARIES)
    create = C.CFUNCTYPE(C.c_void_p, C.POINTER(C.c_int), C.c_void_p)(("OSMesaCreateContextAttribs", library))
    make = C.CFUNCTYPE(C.c_ubyte, C.c_void_p, C.c_void_p, C.c_uint, C.c_int, C.c_int)(("OSMesaMakeCurrent", library))
    destroy = C.CFUNCTYPE(None, C.c_void_p)(("OSMesaDestroyContext", library))
    context = None
    for major, minor in ((4, 5), (3, 3)):
        # FORMAT RGBA, DEPTH_BITS 0, PROFILE core, CONTEXT_MAJOR_VERSION, CONTEXT_MINOR_VERSION
        attributes = (C.c_int * 11)(0x22, 0x1908, 0x30, 0, 0x33, 0x34, 0x36, major, 0x37, minor, 0)
        context = context or create(attributes, None)
    if not context:
        raise BackendUnavailable("OSMesaCreateContextAttribs made no core profile context", _INSTALL_OSMESA)
    # OSMesa needs a default framebuffer in our memory; nothing is ever drawn into it.
    pixels = (C.c_ubyte * (4 * 4 * 4))()
    if not make(context, pixels, 0x1401, 4, 4):
        destroy(context)
        raise BackendUnavailable("OSMesaMakeCurrent failed", _INSTALL_OSMESA)

    def release() -> None:
        destroy(context)
        # Referenced by the closure after the context is gone: keeps the pixels alive until here.
        C.memset(pixels, 0, C.sizeof(pixels))

    return Loader(_place_or_refuse("OSMesa", _INSTALL_OSMESA), address, release)


def window_loader() -> Loader:
    """A hidden glfw window: needs the extra `view` and a display.

    Raises
    ------
    BackendUnavailable
        With the reason and what to install or set.
    """
    try:
        import glfw
    except ImportError as error:
        raise BackendUnavailable("glfw is not installed", "pip install 'glshadow[view]'") from error

    # glfw turns errors into Python warnings; here they become part of an exception.
    glfw.ERROR_REPORTING = "ignore"
    if not glfw.init():
        raise BackendUnavailable(_glfw_reason(glfw), "set DISPLAY, or run under xvfb-run (apt-get install xvfb)")
    previous: Any = glfw.get_current_context()  # None if there is none, which glfw's type hints omit
    glfw.default_window_hints()
    for hint, value in (
        (glfw.VISIBLE, False),
        (glfw.CONTEXT_VERSION_MAJOR, 3),
        (glfw.CONTEXT_VERSION_MINOR, 3),
        (glfw.OPENGL_PROFILE, glfw.OPENGL_CORE_PROFILE),
        (glfw.OPENGL_FORWARD_COMPAT, True),
    ):
        glfw.window_hint(hint, value)
    window = glfw.create_window(16, 16, "glshadow", None, None)
    glfw.default_window_hints()
    if not window:
        raise BackendUnavailable(_glfw_reason(glfw), _INSTALL_GLX)
    glfw.make_context_current(window)
    place = current()
    # glfw caches which window is current; that must not stay our window. Therefore not glfw.get_proc_address, which reads the cache.
    glfw.make_context_current(previous)
    make_current(place)
    return Loader(place, address, lambda: glfw.destroy_window(window))


def _glfw_reason(glfw: Any) -> str:
    code, text = glfw.get_error()
    if not code:
        return "glfw found no display"
    return text.decode() if isinstance(text, bytes) else str(text)


def _first_library(names: tuple[str, ...]) -> C.CDLL:
    for name in names:
        try:
            return C.CDLL(name)
        except OSError:
            continue
    raise BackendUnavailable(f"none of {', '.join(names)} could be loaded", _INSTALL_OSMESA)


def _place_or_refuse(library: str, remedy: str) -> Current:
    place = current()
    if not place:
        raise BackendUnavailable(f"{library} made a context but could not make it current on this thread", remedy)
    return place


LOADERS: dict[str, Callable[[], Loader]] = {"egl": egl_loader, "osmesa": osmesa_loader, "window": window_loader}
"""Backend name -> function that creates its context, in the order in which `auto` tries them."""


def make_context(backend: str) -> tuple[moderngl.Context, Loader]:
    """A new moderngl context; the context that was current before is current again.

    Raises
    ------
    BackendUnavailable
        If the backend does not provide an OpenGL 3.3 core context.
    """
    before = current()
    make_current({})
    try:
        name, _, device = backend.partition(":")
        loader = egl_loader(int(device)) if device else LOADERS[name]()
        try:
            settings: dict[str, Any] = {"context": loader}
            with undisturbed():
                ctx = moderngl.create_context(standalone=True, require=330, **settings)
        except BaseException as error:
            loader.release()
            if isinstance(error, moderngl.Error | ValueError):  # the rest comes from signal handlers
                raise BackendUnavailable(str(error), "install a driver with OpenGL 3.3 core or newer") from error
            raise
        return ctx, loader
    finally:
        make_current(before)
