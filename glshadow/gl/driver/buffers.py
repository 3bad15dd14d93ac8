"""Buffer textures: buffers that shaders read with texelFetch."""

from __future__ import annotations

import ctypes as C
from typing import Any

import moderngl
import numpy as np
from numpy.typing import NDArray

from glshadow.gl.driver.context import GLContext
from glshadow.gl.driver.entry_points import EntryPoints

_TEXTURE_BUFFER, _TEXTURE_BINDING_BUFFER = 0x8C2A, 0x8C2C
_TEXTURE0, _ACTIVE_TEXTURE = 0x84C0, 0x84E0
_STORAGE_BUFFER, _WRITE_ONLY = 0x90D2, 0x88B9
PART = 256
"""Alignment in bytes: no driver's SHADER_STORAGE_BUFFER_OFFSET_ALIGNMENT is larger (OpenGL 4.3 core, table 23.64)."""


class BufferTexture:
    """A buffer that shaders read with texelFetch (samplerBuffer, usamplerBuffer): 2.5 to 3 times faster on llvmpipe than
    a storage buffer, and available from OpenGL 3.1 on. Owns its buffer.

    Parameters
    ----------
    buffer
        At most `Caps.max_texture_buffer_size` elements.
    internal_format
        R8, R32F, RGBA32F, R32UI, RG32UI or RGBA32UI.
    """

    def __init__(self, gl: EntryPoints, buffer: moderngl.Buffer, internal_format: int) -> None:
        self._gl = gl
        self.buffer = buffer
        self._format = internal_format
        name = C.c_uint()
        gl.call("glGenTextures", 1, C.byref(name))
        self.glo = name.value
        previous = gl.integer(_TEXTURE_BINDING_BUFFER)
        gl.call("glBindTexture", _TEXTURE_BUFFER, self.glo)
        gl.call("glTexBuffer", _TEXTURE_BUFFER, internal_format, buffer.glo)
        gl.call("glBindTexture", _TEXTURE_BUFFER, previous)

    def use(self, unit: int) -> None:
        """Bind to a texture unit."""
        active = self._gl.integer(_ACTIVE_TEXTURE)
        self._gl.call("glActiveTexture", _TEXTURE0 + unit)
        self._gl.call("glBindTexture", _TEXTURE_BUFFER, self.glo)
        self._gl.call("glActiveTexture", active)

    def bind_to_storage(self, binding: int, start: int, size: int) -> None:
        """Bind a part of it as storage buffer for compute passes: `size` bytes from `start`, a multiple of PART. A storage buffer can be
        far smaller than a buffer texture (llvmpipe: 128 MiB and 2 GiB)."""
        self._gl.call("glBindBufferRange", _STORAGE_BUFFER, binding, self.buffer.glo, start, size)

    def bind_to_image(self, unit: int) -> None:
        """Bind it for imageStore in compute passes."""
        self._gl.call("glBindImageTexture", unit, self.glo, 0, False, 0, _WRITE_ONLY, self._format)

    def release(self) -> None:
        """Delete both; may be called twice."""
        if self.glo:
            self._gl.call("glDeleteTextures", 1, C.byref(C.c_uint(self.glo)))
            self.buffer.release()
            self.glo = 0


def texture_buffer(context: GLContext, data: NDArray[Any], internal_format: int) -> BufferTexture:
    """Upload data into a buffer texture; the caller releases it."""
    return BufferTexture(context.gl, context.ctx.buffer(np.ascontiguousarray(data)), internal_format)
