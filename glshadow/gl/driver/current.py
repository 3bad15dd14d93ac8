"""Which OpenGL context is current on this thread: queried from the window-system libraries, changed, and restored.

moderngl's `with ctx:` keeps one predecessor per context, so that the nesting A, B, A ends with B current instead of nothing, and it
does not notice when the switch fails. Here every entry keeps its own predecessor, and a context of one library is released before one
of another library is made current: glvnd refuses EGL while GLX is current (EGL_BAD_ACCESS), and Mesa's OSMesa and EGL overwrite each
other's dispatch table (Mesa 22.3).
"""

import ctypes as C
import os
import sys
from collections.abc import Mapping
from functools import partial
from typing import Self

from glshadow.errors import ContextError

Handles = tuple[int, ...]
"""The calls of one library that query and change its current context."""

Current = Mapping[str, Handles]
"""Library name -> handles of the context that is current on a thread; empty if there is none."""

_GL_UNSIGNED_BYTE = 0x1401
_EGL_DRAW, _EGL_READ = 0x3059, 0x305A
_EGL_CONTEXT_CLIENT_TYPE = 0x3097


class _Egl:
    sonames = ("libEGL.so.1",)

    def __init__(self, library: C.CDLL) -> None:
        pointer = C.c_void_p
        self._context = C.CFUNCTYPE(pointer)(("eglGetCurrentContext", library))
        self._display = C.CFUNCTYPE(pointer)(("eglGetCurrentDisplay", library))
        self._surface = C.CFUNCTYPE(pointer, C.c_int)(("eglGetCurrentSurface", library))
        self._make = C.CFUNCTYPE(C.c_uint, pointer, pointer, pointer, pointer)(("eglMakeCurrent", library))
        self._query = C.CFUNCTYPE(C.c_uint, pointer, pointer, C.c_int, pointer)(("eglQueryContext", library))
        self.address = C.CFUNCTYPE(pointer, C.c_char_p)(("eglGetProcAddress", library))

    def current(self) -> Handles | None:
        context = self._context()
        if not context:
            return None
        return (context, self._display() or 0, self._surface(_EGL_DRAW) or 0, self._surface(_EGL_READ) or 0)

    def make(self, handles: Handles) -> bool:
        context, display, draw, read = handles
        return bool(self._make(display, draw, read, context))

    def clear(self, handles: Handles) -> None:
        self._make(handles[1], None, None, None)

    def lost(self, handles: Handles) -> bool:
        context, display, _, _ = handles
        return not self._query(display, context, _EGL_CONTEXT_CLIENT_TYPE, C.byref(C.c_int()))


class _Glx:
    sonames = ("libGLX.so.0", "libGL.so.1")

    def __init__(self, library: C.CDLL) -> None:
        pointer, drawable = C.c_void_p, C.c_ulong
        self._context = C.CFUNCTYPE(pointer)(("glXGetCurrentContext", library))
        self._display = C.CFUNCTYPE(pointer)(("glXGetCurrentDisplay", library))
        self._draw = C.CFUNCTYPE(drawable)(("glXGetCurrentDrawable", library))
        self._read = C.CFUNCTYPE(drawable)(("glXGetCurrentReadDrawable", library))
        self._make = C.CFUNCTYPE(C.c_int, pointer, drawable, drawable, pointer)(("glXMakeContextCurrent", library))
        self.address = C.CFUNCTYPE(pointer, C.c_char_p)(("glXGetProcAddressARB", library))

    def current(self) -> Handles | None:
        context = self._context()
        return (context, self._display() or 0, self._draw(), self._read()) if context else None

    def make(self, handles: Handles) -> bool:
        context, display, draw, read = handles
        return bool(self._make(display, draw, read, context))

    def clear(self, handles: Handles) -> None:
        self._make(handles[1], 0, 0, None)


class _OSMesa:
    sonames = ("libOSMesa.so.8", "libOSMesa.so.6", "libOSMesa.so")

    def __init__(self, library: C.CDLL) -> None:
        pointer, out = C.c_void_p, C.POINTER(C.c_int)
        self._context = C.CFUNCTYPE(pointer)(("OSMesaGetCurrentContext", library))
        self._buffer = C.CFUNCTYPE(C.c_ubyte, pointer, out, out, out, C.POINTER(pointer))(
            ("OSMesaGetColorBuffer", library)
        )
        make = C.CFUNCTYPE(C.c_ubyte, pointer, pointer, C.c_uint, C.c_int, C.c_int)
        self._make = make(("OSMesaMakeCurrent", library))
        self.address = C.CFUNCTYPE(pointer, C.c_char_p)(("OSMesaGetProcAddress", library))

    def current(self) -> Handles | None:
        context = self._context()
        if not context:
            return None
        width, height, form, buffer = C.c_int(), C.c_int(), C.c_int(), C.c_void_p()
        self._buffer(context, C.byref(width), C.byref(height), C.byref(form), C.byref(buffer))
        return (context, buffer.value or 0, width.value, height.value)

    def make(self, handles: Handles) -> bool:
        context, buffer, width, height = handles
        return bool(self._make(context, buffer, _GL_UNSIGNED_BYTE, width, height))

    def clear(self, handles: Handles) -> None:
        self._make(None, None, 0, 0, 0)


_Library = _Egl | _Glx | _OSMesa
# OSMesa last: through their shared dispatch table it reports an EGL context as its own (Mesa 22.3).
_KINDS: tuple[type[_Library], ...] = (_Egl, _Glx, _OSMesa)
_loaded: dict[str, _Library] = {}
_loads_seen = -1


def _libraries() -> Mapping[str, _Library]:
    """The libraries that this process has loaded so far, by name; never loads one."""
    global _loads_seen
    # Searching for a library that is not loaded costs 70 us; comparing the number of loads costs 2.
    loads = _load_count()
    if loads != _loads_seen:
        _loads_seen = loads
        for kind in _KINDS:
            if kind.__name__ not in _loaded:
                _find(kind)
    return _loaded


def _find(kind: type[_Library]) -> None:
    for soname in kind.sonames:
        try:
            _loaded[kind.__name__] = kind(C.CDLL(soname, mode=os.RTLD_NOLOAD | os.RTLD_NOW))
            return
        except (OSError, AttributeError):
            continue


class _PhdrInfo(C.Structure):
    """Head of glibc's struct dl_phdr_info, with room for the rest."""

    _fields_ = (
        ("addr", C.c_void_p),
        ("name", C.c_char_p),
        ("phdr", C.c_void_p),
        ("phnum", C.c_uint16),
        ("adds", C.c_ulonglong),
        ("rest", C.c_ubyte * 216),
    )


if sys.platform == "linux":
    _first = _PhdrInfo()
    _copy = C.CFUNCTYPE(C.c_void_p, C.c_void_p, C.c_void_p, C.c_size_t)(("memmove", C.CDLL(None)))
    # Called by C: in a function of ours a signal handler could run, and what it raises would be printed and lost.
    _visit = C.CFUNCTYPE(C.c_int, C.c_void_p, C.c_size_t, C.c_void_p)(partial(_copy, C.addressof(_first)))
    _iterate = C.CDLL(None).dl_iterate_phdr

    def _load_count() -> int:
        _iterate(_visit, None)
        return int(_first.adds)
else:

    def _load_count() -> int:
        return -1  # no search on other systems, which have none of these libraries


def current() -> Current:
    """The context that is current on this thread."""
    libraries = _libraries()
    for kind in _KINDS:
        library = libraries.get(kind.__name__)
        handles = library.current() if library else None
        if handles is not None:
            return {kind.__name__: handles}
    return {}


def make_current(wanted: Current) -> bool:
    """Make `wanted` (empty: nothing) the only current context of this thread; False if a library refused."""
    before = current()
    if before == wanted:
        return True
    libraries = _libraries()
    for name, handles in before.items():
        libraries[name].clear(handles)
    done = [libraries[name].make(handles) for name, handles in wanted.items()]
    return all(done)


def address(name: str) -> int:
    """Address of an OpenGL function in the library whose context is current; 0 if there is none."""
    libraries = _libraries()
    for kind in current():
        return libraries[kind].address(name.encode()) or 0
    return 0


class Switch:
    """Makes one context current inside a `with` block; blocks may be nested.

    Parameters
    ----------
    place
        The context, as `current()` reported it while it was current.
    """

    def __init__(self, place: Current) -> None:
        self.place = dict(place)
        self.dead = False
        self._before: list[Current] = []

    def __enter__(self) -> Self:
        if self.dead:
            raise ContextError("this OpenGL context was released; open a new one")
        before = current()
        if not make_current(self.place):
            make_current(before)
            if self.lost:
                raise ContextError(
                    "other code of this process terminated the EGL display of this OpenGL context (eglTerminate; pyrender's "
                    "OffscreenRenderer.delete() calls it), and with it went everything in the context: make a new Renderer"
                )
            raise ContextError(
                "the OpenGL context could not be made current on this thread; a context can be used by one thread at "
                "a time: leave its `with` block in the other thread first, or open one context per thread"
            )
        self._before.append(before)
        return self

    def __exit__(self, *_: object) -> None:
        before = self._before.pop()
        make_current({} if self.dead and before == self.place else before)

    @property
    def lost(self) -> bool:
        """Whether other code destroyed the context, by eglTerminate, which ends all contexts of a display."""
        egl = _libraries().get(_Egl.__name__)
        handles = self.place.get(_Egl.__name__)
        return isinstance(egl, _Egl) and handles is not None and egl.lost(handles)

    def kill(self) -> None:
        """Call before destroying the context: it is no longer current, and no `with` block makes it current again."""
        if current() == self.place:
            make_current({})
        self.dead = True
