"""OpenGL queries: whether samples passed, and GPU timestamps."""

from __future__ import annotations

import ctypes as C

from glshadow.gl.driver.entry_points import EntryPoints

ANY_SAMPLES_PASSED, _QUERY_RESULT = 0x8C2F, 0x8866
_TIMESTAMP, _QUERY_COUNTER_BITS = 0x8E28, 0x8864


class AnySamples:
    """Whether any sample passed inside `with`. moderngl's own query cannot be released."""

    def __init__(self, gl: EntryPoints) -> None:
        self._gl = gl
        name = C.c_uint()
        gl.call("glGenQueries", 1, C.byref(name))
        self.glo = name.value

    def __enter__(self) -> None:
        self._gl.call("glBeginQuery", ANY_SAMPLES_PASSED, self.glo)

    def __exit__(self, *_: object) -> None:
        self._gl.call("glEndQuery", ANY_SAMPLES_PASSED)

    @property
    def passed(self) -> bool:
        """The result; waits for the GPU."""
        result = C.c_uint()
        self._gl.call("glGetQueryObjectuiv", self.glo, _QUERY_RESULT, C.byref(result))
        return bool(result.value)

    def release(self) -> None:
        """Delete the query."""
        if self.glo:
            self._gl.call("glDeleteQueries", 1, C.byref(C.c_uint(self.glo)))
            self.glo = 0


class Timestamp:
    """Time at which the GPU has finished all commands so far; nothing waits until it is read, once."""

    def __init__(self, gl: EntryPoints) -> None:
        self._gl = gl
        self._name = C.c_uint()
        gl.call("glGenQueries", 1, C.byref(self._name))
        gl.call("glQueryCounter", self._name, _TIMESTAMP)

    def read(self) -> float:
        """Seconds since an arbitrary start; deletes the query."""
        nanoseconds = C.c_uint64()
        self._gl.call("glGetQueryObjectui64v", self._name, _QUERY_RESULT, C.byref(nanoseconds))
        self._gl.call("glDeleteQueries", 1, C.byref(self._name))
        return 1e-9 * nanoseconds.value


def has_timestamps(gl: EntryPoints) -> bool:
    """Whether timestamps work: a driver may report a counter of zero bits."""
    if not (gl.has("glQueryCounter") and gl.has("glGetQueryObjectui64v")):
        return False
    bits = C.c_int()
    gl.call("glGetQueryiv", _TIMESTAMP, _QUERY_COUNTER_BITS, C.byref(bits))
    return bits.value > 0
