"""A windowless EGL context, on a display that other code of the process is unlikely to terminate.

EGL returns the same display to all code of a process for a (platform, native display), and eglTerminate ends all contexts on it. The
first device's display and the default one are widely used: pyrender and moderngl take the former, and pyrender terminates it. Mesa's
surfaceless display on that same device uses the same driver and has few other users.
"""

import ctypes as C
from collections.abc import Callable
from functools import cache
from threading import Lock
from typing import Any

from glshadow.errors import ContextError

_EXTENSIONS, _VERSION = 0x3055, 0x3054
_PLATFORM_DEVICE, _PLATFORM_SURFACELESS, _DEVICE = 0x313F, 0x31DD, 0x322C
_OPENGL_API, _OPENGL_BIT = 0x30A2, 0x0008
_SURFACE_TYPE, _RENDERABLE_TYPE, _NONE = 0x3033, 0x3040, 0x3038
_RENDERER, _DRM_DEVICE_FILE = 0x335F, 0x3233
_MOST_DEVICES = 64
_CONTEXT_MAJOR, _CONTEXT_MINOR, _PROFILE_MASK, _CORE_BIT = 0x3098, 0x30FB, 0x30FD, 0x1

_Integers = C.POINTER(C.c_int)
_CORE: dict[str, tuple[Any, ...]] = {
    "eglBindAPI": (C.c_uint, C.c_uint),
    "eglChooseConfig": (C.c_uint, C.c_void_p, _Integers, C.c_void_p, C.c_int, _Integers),
    "eglCreateContext": (C.c_void_p, C.c_void_p, C.c_void_p, C.c_void_p, _Integers),
    "eglDestroyContext": (C.c_uint, C.c_void_p, C.c_void_p),
    "eglGetDisplay": (C.c_void_p, C.c_void_p),
    "eglGetError": (C.c_int,),
    "eglGetProcAddress": (C.c_void_p, C.c_char_p),
    "eglInitialize": (C.c_uint, C.c_void_p, C.c_void_p, C.c_void_p),
    "eglMakeCurrent": (C.c_uint, C.c_void_p, C.c_void_p, C.c_void_p, C.c_void_p),
    "eglQueryAPI": (C.c_uint,),
    "eglQueryString": (C.c_char_p, C.c_void_p, C.c_int),
}
_EXTRA: dict[str, tuple[Any, ...]] = {
    "eglGetPlatformDisplayEXT": (C.c_void_p, C.c_uint, C.c_void_p, C.c_void_p),
    "eglQueryDeviceStringEXT": (C.c_char_p, C.c_void_p, C.c_int),
    "eglQueryDevicesEXT": (C.c_uint, C.c_int, C.c_void_p, _Integers),
    "eglQueryDisplayAttribEXT": (C.c_uint, C.c_void_p, C.c_int, C.c_void_p),
}
"""Name -> return type, argument types. Functions of the second table are called only if a client extension promises them."""


class Egl:
    """The calls of one libEGL that create a context, and the display that this process uses."""

    def __init__(self, library: C.CDLL) -> None:
        calls: dict[str, Any] = {name: C.CFUNCTYPE(*types)((name, library)) for name, types in _CORE.items()}
        for name, types in _EXTRA.items():
            if found := calls["eglGetProcAddress"](name.encode()):
                calls[name] = C.CFUNCTYPE(*types)(found)
        self._calls = calls
        self._extensions = set((calls["eglQueryString"](None, _EXTENSIONS) or b"").decode().split())
        self._devices = self._all_devices()
        self._device = (
            self._devices[0] if self._devices else None
        )  # the device that other programs use too: a GPU if there is one
        self._displays: dict[int | None, int] = {}  # by device; None: the first that works
        self._choosing = Lock()
        self._addresses: dict[str, int] = {}

    def address(self, name: str) -> int:
        """Address of an OpenGL function, of every context the same; 0 where the driver has none."""
        if name not in self._addresses:
            self._addresses[name] = self._calls["eglGetProcAddress"](name.encode()) or 0
        return self._addresses[name]

    @property
    def devices(self) -> list[str]:
        """EGL's devices, in its order; their indices are their numbers."""
        return [self._named(device) for device in self._devices]

    def open(self, device: int | None = None) -> Callable[[], object]:
        """Create an OpenGL 3.3 core context, current on this thread; returns the function that destroys it.

        Parameters
        ----------
        device : int, optional
            Which of `devices`; None: the first display that works.

        Raises
        ------
        ContextError
            Names the call that failed and EGL's error code.
        """
        with self._choosing:
            if device not in self._displays:
                self._displays[device] = self._choose() if device is None else self._of_device(device)
            display = self._displays[device]
            # Again, in case other code terminated the display; does nothing otherwise.
            if not self._calls["eglInitialize"](display, None, None):
                raise self._failure("eglInitialize")
        api = self._calls["eglQueryAPI"]()
        self._calls["eglBindAPI"](_OPENGL_API)
        try:
            context = self._create(display)
        finally:
            self._calls["eglBindAPI"](api)
        self._calls["eglMakeCurrent"](display, None, None, context)
        return lambda: self._calls["eglDestroyContext"](display, context)

    def _create(self, display: int) -> int:
        config, count = C.c_void_p(), C.c_int()
        # No surface is ever created. Without such a config EGL would search for one that supports windows.
        wanted = _integers(_SURFACE_TYPE, 0, _RENDERABLE_TYPE, _OPENGL_BIT, _NONE)
        chosen = self._calls["eglChooseConfig"](display, wanted, C.byref(config), 1, C.byref(count))
        if not (chosen and count.value):
            raise self._failure("eglChooseConfig")
        attributes = _integers(_CONTEXT_MAJOR, 3, _CONTEXT_MINOR, 3, _PROFILE_MASK, _CORE_BIT, _NONE)
        context: int | None = self._calls["eglCreateContext"](display, config, None, attributes)
        if context is None:
            raise self._failure("eglCreateContext")
        return context

    def _choose(self) -> int:
        """The first display that works: the first device's before others, one that is in use only if there is no other."""
        spare: int | None = None
        for display in sorted(self._candidates(), key=self._is_in_use):
            if self._calls["eglInitialize"](display, None, None):
                if self._device_of(display) == self._device:
                    return display
                spare = spare or display
        if spare is None:
            raise self._failure("eglInitialize")
        return spare

    def _candidates(self) -> list[int]:
        of_platform, displays = self._calls.get("eglGetPlatformDisplayEXT"), []
        if of_platform and "EGL_MESA_platform_surfaceless" in self._extensions:
            displays.append(of_platform(_PLATFORM_SURFACELESS, None, None))
        if of_platform and self._device and "EGL_EXT_platform_device" in self._extensions:
            displays.append(of_platform(_PLATFORM_DEVICE, self._device, None))
        displays.append(self._calls["eglGetDisplay"](None))
        return [display for display in displays if display]

    def _is_in_use(self, display: int) -> bool:
        return self._calls["eglQueryString"](display, _VERSION) is not None

    def _of_device(self, number: int) -> int:
        """The display of one device."""
        of_platform = self._calls.get("eglGetPlatformDisplayEXT")
        if not (of_platform and self._devices and "EGL_EXT_platform_device" in self._extensions):
            raise ContextError("this EGL cannot say which devices there are: leave device out")
        if number >= len(self._devices):
            names = ", ".join(f"{k}: {name}" for k, name in enumerate(self.devices))
            raise ContextError(f"there is no device {number}; there are {names}")
        display: int | None = of_platform(_PLATFORM_DEVICE, self._devices[number], None)
        if not display:
            raise self._failure("eglGetPlatformDisplayEXT")
        return display

    def _all_devices(self) -> list[int]:
        """EGL's device pointers; None if EGL cannot list devices."""
        if not self._extensions & {"EGL_EXT_device_base", "EGL_EXT_device_enumeration"}:
            return []
        found, count = (C.c_void_p * _MOST_DEVICES)(), C.c_int()
        self._calls["eglQueryDevicesEXT"](_MOST_DEVICES, found, C.byref(count))
        return [device for device in found[: count.value] if device]

    def _named(self, device: int) -> str:
        """Name of a device's driver or its file, if EGL knows it."""
        text = self._calls.get("eglQueryDeviceStringEXT")
        if text is None:
            return "unnamed"
        extensions = (text(device, _EXTENSIONS) or b"").decode().split()
        if "EGL_EXT_device_query_name" in extensions and (name := text(device, _RENDERER)):
            return str(name.decode(errors="replace"))
        if "EGL_EXT_device_drm" in extensions and (name := text(device, _DRM_DEVICE_FILE)):
            return str(name.decode(errors="replace"))
        return "software" if "EGL_MESA_device_software" in extensions else "unnamed"

    def _device_of(self, display: int) -> int | None:
        if not self._extensions & {"EGL_EXT_device_base", "EGL_EXT_device_query"}:
            return None
        device = C.c_void_p()
        found = self._calls["eglQueryDisplayAttribEXT"](display, _DEVICE, C.byref(device))
        return device.value if found else None

    def _failure(self, name: str) -> ContextError:
        return ContextError(f"{name} failed (0x{self._calls['eglGetError']():x})")


@cache
def load_egl(soname: str) -> Egl:
    """The library, loaded once: its choices hold for all contexts of the process.

    Raises
    ------
    OSError
        If the library is missing.
    """
    return Egl(C.CDLL(soname))


def _integers(*values: int) -> C.Array[C.c_int]:
    return (C.c_int * len(values))(*values)
