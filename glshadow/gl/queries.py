"""Questions that OpenGL answers about what was drawn."""

from __future__ import annotations

import ctypes as C

from glshadow.gl.entry_points import EntryPoints

ANY_SAMPLES_PASSED, _QUERY_RESULT = 0x8C2F, 0x8866


class AnySamples:
    """Whether anything was drawn inside `with`; moderngl's own query cannot be released."""

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
        """The answer; waits for the drawing."""
        result = C.c_uint()
        self._gl.call("glGetQueryObjectuiv", self.glo, _QUERY_RESULT, C.byref(result))
        return bool(result.value)

    def release(self) -> None:
        """Delete the query."""
        if self.glo:
            self._gl.call("glDeleteQueries", 1, C.byref(C.c_uint(self.glo)))
            self.glo = 0
