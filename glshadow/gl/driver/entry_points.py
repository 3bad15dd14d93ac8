"""The OpenGL calls that moderngl lacks, as typed methods; addresses come from moderngl's own loader.

moderngl 5.13 has no clip control, no depth texture but 24 bits, no buffer texture, no clear of an integer target and no timestamp, and
cannot read most of the state that it sets.
"""

import ctypes as C
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshadow.errors import ContextError, GlshadowError, ResourceError

BLEND = 0x0BE2
DEPTH_COMPONENT16 = 0x81A5
DEPTH_COMPONENT24 = 0x81A6
DEPTH_COMPONENT32F = 0x8CAC
R32F = 0x822E
RGBA32F = 0x8814
R32UI = 0x8236
RGBA32UI = 0x8D70
RG32UI = 0x823C
RG32F = 0x8230
R8 = 0x8229

_TEXTURE_2D, _TEXTURE_BINDING_2D = 0x0DE1, 0x8069
_CURRENT_PROGRAM = 0x8B8D

_ERRORS = {
    0x0500: "GL_INVALID_ENUM",
    0x0501: "GL_INVALID_VALUE",
    0x0502: "GL_INVALID_OPERATION",
    0x0503: "GL_STACK_OVERFLOW",
    0x0504: "GL_STACK_UNDERFLOW",
    0x0505: "GL_OUT_OF_MEMORY",
    0x0506: "GL_INVALID_FRAMEBUFFER_OPERATION",
    0x0507: "GL_CONTEXT_LOST",
}
_OUT_OF_MEMORY = 0x0505
_MAX_ERRORS = 32  # a lost context reports errors endlessly

_TYPES: dict[str, Any] = {
    "I": C.c_uint,
    "i": C.c_int,
    "f": C.c_float,
    "d": C.c_double,
    "p": C.c_void_p,
    "B": C.c_ubyte,
    "n": C.c_ssize_t,
    "s": C.c_char_p,
}
# name -> (type returned, types of the arguments), in the letters above.
_SIGNATURES = {
    "glActiveTexture": ("", "I"),
    "glBeginQuery": ("", "II"),
    "glDeleteQueries": ("", "ip"),
    "glEndQuery": ("", "I"),
    "glGenQueries": ("", "ip"),
    "glGetQueryObjectui64v": ("", "IIp"),
    "glGetQueryObjectuiv": ("", "IIp"),
    "glGetQueryiv": ("", "IIp"),
    "glQueryCounter": ("", "II"),
    "glBindBuffer": ("", "II"),
    "glBindBufferBase": ("", "III"),
    "glBindBufferRange": ("", "IIInn"),
    "glBindFramebuffer": ("", "II"),
    "glBindImageTexture": ("", "IIiBiII"),
    "glBindRenderbuffer": ("", "II"),
    "glBindSampler": ("", "II"),
    "glBindTexture": ("", "II"),
    "glBindVertexArray": ("", "I"),
    "glBlendEquationSeparate": ("", "II"),
    "glBlendFuncSeparate": ("", "IIII"),
    "glClampColor": ("", "II"),
    "glClearBufferfv": ("", "Iip"),
    "glClearBufferuiv": ("", "Iip"),
    "glClearColor": ("", "ffff"),
    "glClearDepth": ("", "d"),
    "glClipControl": ("", "II"),
    "glColorMaski": ("", "IBBBB"),
    "glCullFace": ("", "I"),
    "glDeleteTextures": ("", "ip"),
    "glDepthFunc": ("", "I"),
    "glDepthMask": ("", "B"),
    "glDepthRange": ("", "dd"),
    "glDisable": ("", "I"),
    "glDisablei": ("", "II"),
    "glEnable": ("", "I"),
    "glEnablei": ("", "II"),
    "glFlush": ("", ""),
    "glFrontFace": ("", "I"),
    "glGenTextures": ("", "ip"),
    "glGetBooleani_v": ("", "IIp"),
    "glGetDoublev": ("", "Ip"),
    "glGetError": ("I", ""),
    "glGetInteger64i_v": ("", "IIp"),
    "glGetIntegeri_v": ("", "IIp"),
    "glGetIntegerv": ("", "Ip"),
    "glGetTexLevelParameteriv": ("", "IiIp"),
    "glGetUniformLocation": ("i", "Is"),
    "glIsProgram": ("B", "I"),
    "glIsEnabled": ("B", "I"),
    "glIsEnabledi": ("B", "II"),
    "glLineWidth": ("", "f"),
    "glMultiDrawElements": ("", "IpIpi"),
    "glPixelStorei": ("", "Ii"),
    "glPointSize": ("", "f"),
    "glPolygonMode": ("", "II"),
    "glPolygonOffset": ("", "ff"),
    "glPolygonOffsetClamp": ("", "fff"),
    "glScissor": ("", "iiii"),
    "glTexBuffer": ("", "III"),
    "glTexImage2D": ("", "IiiiiiIIp"),
    "glTexParameteri": ("", "IIi"),
    "glUniform1i": ("", "ii"),
    "glUseProgram": ("", "I"),
    "glViewport": ("", "iiii"),
}


class EntryPoints:
    """OpenGL functions of one context; call them only while it is current.

    Parameters
    ----------
    load
        Function name -> address, 0 if the driver does not have it.

    Attributes
    ----------
    failed : bool
        Whether `check` has found an error: resources created since may have no memory.
    """

    def __init__(self, load: Callable[[str], int]) -> None:
        self.failed = False
        self._functions: dict[str, Callable[..., int]] = {}
        for name, (result, arguments) in _SIGNATURES.items():
            address = load(name)
            if address:
                prototype = C.CFUNCTYPE(_TYPES.get(result), *(_TYPES[letter] for letter in arguments))
                self._functions[name] = prototype(address)

    def has(self, name: str) -> bool:
        """Whether the driver returned an address; EGL also returns one for functions of newer versions."""
        return name in self._functions

    def call(self, name: str, *arguments: Any) -> int:
        """Call a function of the table by its OpenGL name.

        Raises
        ------
        ContextError
            If the driver does not have it.
        """
        function = self._functions.get(name)
        if function is None:
            raise ContextError(f"the OpenGL driver has no {name}; `glshadow doctor` lists what it has")
        return function(*arguments)

    # -- reading state

    def integers(self, name: int, count: int = 1) -> tuple[int, ...]:
        """`count` integers of glGetIntegerv; it may write more than one, never more than 16."""
        values = (C.c_int * 16)()
        self.call("glGetIntegerv", name, values)
        return tuple(values[:count])

    def integer(self, name: int) -> int:
        """One integer of glGetIntegerv."""
        return self.integers(name)[0]

    def indexed_integer(self, name: int, index: int) -> int:
        """One integer of glGetIntegeri_v."""
        value = (C.c_int * 4)()
        self.call("glGetIntegeri_v", name, index, value)
        return value[0]

    def indexed_long(self, name: int, index: int) -> int:
        """One 64-bit integer of glGetInteger64i_v."""
        value = (C.c_int64 * 4)()
        self.call("glGetInteger64i_v", name, index, value)
        return value[0]

    def indexed_booleans(self, name: int, index: int, count: int) -> tuple[int, ...]:
        """`count` switches, 0 or 1, of glGetBooleani_v."""
        values = (C.c_ubyte * 16)()
        self.call("glGetBooleani_v", name, index, values)
        return tuple(values[:count])

    def doubles(self, name: int, count: int = 1) -> tuple[float, ...]:
        """`count` numbers of glGetDoublev, which keeps depth ranges exact where glGetFloatv rounds them."""
        values = (C.c_double * 16)()
        self.call("glGetDoublev", name, values)
        return tuple(values[:count])

    def is_enabled(self, capability: int) -> bool:
        """State of a glEnable switch."""
        return bool(self.call("glIsEnabled", capability))

    def set_enabled(self, capability: int, on: bool) -> None:
        """Turn a glEnable switch on or off."""
        self.call("glEnable" if on else "glDisable", capability)

    def texture_format(self, texture_glo: int) -> tuple[int, int, int]:
        """Actual width, height and internal format of level 0 of a 2-D texture."""
        with self._bound_2d(texture_glo):
            values = (C.c_int * 1)()
            found = []
            for parameter in (0x1000, 0x1001, 0x1003):  # TEXTURE_WIDTH, TEXTURE_HEIGHT, TEXTURE_INTERNAL_FORMAT
                self.call("glGetTexLevelParameteriv", _TEXTURE_2D, 0, parameter, values)
                found.append(values[0])
        return found[0], found[1], found[2]

    # -- errors

    def errors(self) -> list[str]:
        """Names of the pending errors; clears them."""
        return [_ERRORS.get(code, hex(code)) for code in self._drain()]

    def check(self, what: str) -> None:
        """Raise if OpenGL reported an error since the last check. moderngl never does.

        Parameters
        ----------
        what
            The action, as the message should name it: "allocating the 4096 x 4096 shadow map".

        Raises
        ------
        ResourceError
            On GL_OUT_OF_MEMORY.
        GlshadowError
            On any other error: a bug of this package or of the driver.
        """
        codes = self._drain()
        self.failed = self.failed or bool(codes)
        if _OUT_OF_MEMORY in codes:
            raise ResourceError(
                f"the OpenGL driver ran out of memory while {what}; use a smaller image, a lower shadow resolution, "
                "a smaller target format or fewer lights"
            )
        if codes:
            names = ", ".join(_ERRORS.get(code, hex(code)) for code in codes)
            raise GlshadowError(f"OpenGL reported {names} while {what}")

    def _drain(self) -> list[int]:
        codes: list[int] = []
        while len(codes) < _MAX_ERRORS and (code := self.call("glGetError")):
            codes.append(code)
        return codes

    # -- what moderngl lacks

    def clip_control(self, zero_to_one: bool) -> None:
        """NDC depth 0..1 or -1..1, origin at the lower left.

        Raises
        ------
        ContextError
            If the driver has neither OpenGL 4.5 nor ARB_clip_control.
        """
        self.call("glClipControl", 0x8CA1, 0x935F if zero_to_one else 0x935E)

    def specify_depth(self, texture_glo: int, size: tuple[int, int], internal_format: int) -> None:
        """Change the format of a moderngl depth texture, which is always 24 bits; its content is then undefined.

        The moderngl object, its `read()`, later framebuffers and samplers keep working, since the storage is
        mutable. Attach it to a framebuffer after this call.

        Parameters
        ----------
        texture_glo
            `moderngl.Texture.glo` of a `depth_texture`.
        size
            Width, height in texels.
        internal_format
            DEPTH_COMPONENT16, DEPTH_COMPONENT24 or DEPTH_COMPONENT32F.
        """
        with self._bound_2d(texture_glo):
            self.call("glTexImage2D", _TEXTURE_2D, 0, internal_format, *size, 0, 0x1902, 0x1406, None)

    def wrap(self, texture_glo: int, along_u: int, along_v: int) -> None:
        """Set how a 2D texture is wrapped; moderngl knows no mirrored repetition."""
        with self._bound_2d(texture_glo):
            self.call("glTexParameteri", _TEXTURE_2D, 0x2802, along_u)
            self.call("glTexParameteri", _TEXTURE_2D, 0x2803, along_v)

    def clear_unsigned(self, draw_buffer: int, values: Sequence[int]) -> None:
        """Clear an unsigned integer colour target of the bound framebuffer, which glClear leaves undefined."""
        self.call("glClearBufferuiv", 0x1800, draw_buffer, (C.c_uint * 4)(*values))

    def clear_floats(self, draw_buffer: int, values: Sequence[float]) -> None:
        """Clear one float or normalised colour target of the bound framebuffer and leave the others alone."""
        self.call("glClearBufferfv", 0x1800, draw_buffer, (C.c_float * 4)(*values))

    def multi_draw(self, program_glo: int, array_glo: int, first: NDArray[np.int64], count: NDArray[np.int64]) -> None:
        """Draw several runs of the triangles of a vertex array with 32 bit indices, in one call.

        Parameters
        ----------
        first, count : (R,) int64
            Triangles.
        """
        self.call("glUseProgram", program_glo)
        self.call("glBindVertexArray", array_glo)
        counts = np.ascontiguousarray(3 * count, dtype=np.int32)
        places = np.ascontiguousarray(12 * first, dtype=np.uintp)
        self.call("glMultiDrawElements", 4, counts.ctypes.data, 0x1405, places.ctypes.data, len(counts))

    def set_sampler(self, program_glo: int, name: str, unit: int) -> bool:
        """Let a sampler of a program read a texture unit; whether there is one of that name: the compiler drops what is not used.

        moderngl 5.13 cannot set a samplerBuffer and reports no error: `program["table"] = 5` changes nothing.
        """
        location = self.call("glGetUniformLocation", program_glo, name.encode())
        if location < 0:
            return False
        previous = self.integer(_CURRENT_PROGRAM)
        self.call("glUseProgram", program_glo)
        self.call("glUniform1i", location, unit)
        # a program that was deleted while it was current is gone now
        self.call("glUseProgram", previous if self.call("glIsProgram", previous) else 0)
        return True

    def _bound_2d(self, texture_glo: int) -> "_Bound2D":
        return _Bound2D(self, texture_glo)


class _Bound2D:
    """A 2-D texture bound to the active unit for the length of a `with` block."""

    def __init__(self, gl: EntryPoints, texture_glo: int) -> None:
        self._gl = gl
        self._glo = texture_glo

    def __enter__(self) -> None:
        self._previous = self._gl.integer(_TEXTURE_BINDING_2D)
        self._gl.call("glBindTexture", _TEXTURE_2D, self._glo)

    def __exit__(self, *_: object) -> None:
        self._gl.call("glBindTexture", _TEXTURE_2D, self._previous)
