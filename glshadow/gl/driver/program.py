"""Programs: compiles composed snippets, once each, and maps driver errors to snippets and lines."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

import moderngl
import numpy as np
from numpy.typing import NDArray

from glshadow.errors import ShaderError
from glshadow.gl.driver.context import GLContext
from glshadow.shader.compose import Text, compose
from glshadow.signals import undisturbed

_SAMPLER = re.compile(r"\buniform\s+(?:\w+p\s+)?[iu]?sampler\w+\s+(\w+)")

Slots = Mapping[str, str]
Defines = Mapping[str, int | str]


class _Linked:
    """A linked program. Uniforms that the compiler dropped are ignored; textures get fixed units."""

    def __init__(self, context: GLContext, gl: moderngl.Program | moderngl.ComputeShader, *texts: Text) -> None:
        self.gl = gl
        self._members: dict[str, Any] = {name: gl[name] for name in gl}
        self._units: dict[str, int] = {}
        for name in dict.fromkeys(name for text in texts for name in _SAMPLER.findall(text.code)):
            if context.gl.set_sampler(gl.glo, name, len(self._units)):
                self._units[name] = len(self._units)

    def __contains__(self, name: str) -> bool:
        return name in self._members

    @property
    def samplers(self) -> tuple[str, ...]:
        """Names of the program's samplers."""
        return tuple(self._units)

    def set(self, **values: Any) -> None:
        """Set uniforms to numbers, tuples, float64 arrays (matrices row-major, as everywhere in Python) or raw bytes."""
        for name, value in values.items():
            member = self._members.get(name)
            if member is not None:
                set_uniform(member, value)

    def write(self, name: str, data: bytes | NDArray[Any]) -> None:
        """Write raw bytes, as OpenGL stores them, to a uniform, if the program has it."""
        member = self._members.get(name)
        if member is not None:
            member.write(data)

    def bind(self, **textures: Any) -> None:
        """Bind textures, given as (texture, sampler object) or as functions that create them. A texture that the program does not use is
        not created."""
        for name, given in textures.items():
            unit = self._units.get(name)
            if unit is None:
                continue
            if callable(given):
                given = given()
            texture, sampler = given if isinstance(given, tuple) else (given, None)
            texture.use(unit)
            if sampler is not None:
                sampler.use(unit)

    def unbind(self) -> None:
        """Remove the sampler objects from its units: they would override the filter of textures that are bound there next."""
        if self._units:
            self.gl.ctx.clear_samplers(0, len(self._units))


def set_uniform(member: Any, value: Any) -> None:
    """Set a moderngl.Uniform to a number, a tuple, a float64 array (matrices row-major) or raw bytes."""
    if isinstance(value, bytes):
        # the compiler may drop the last elements of an array
        member.write(value[: 4 * member.dimension * member.array_length])
    elif isinstance(value, np.ndarray):
        member.write(np.ascontiguousarray(value.T, dtype=np.float32).tobytes())
    else:
        member.value = value


class Program(_Linked):
    """A linked vertex and fragment pass, with a geometry pass between them or none. Make it `undisturbed`."""

    def __init__(self, context: GLContext, vertex: Text, fragment: Text, geometry: Text | None = None) -> None:
        stages = {"vertex_shader": vertex, "fragment_shader": fragment}
        if geometry is not None:
            stages["geometry_shader"] = geometry
        try:
            linked = context.ctx.program(
                vertex.code, fragment.code, geometry_shader=None if geometry is None else geometry.code
            )
        except moderngl.Error as error:
            message = str(error)
            rejected = next((text for stage, text in stages.items() if f"\n{stage}\n" in message), fragment)
            raise _rejected(rejected, message) from error
        super().__init__(context, linked, *stages.values())
        self._empty: moderngl.VertexArray | None = None

    def vertex_array(self) -> moderngl.VertexArray:
        """A vertex array without attributes, for passes that build their triangle from gl_VertexID."""
        if self._empty is None:
            self._empty = self.gl.ctx.vertex_array(self.gl, [])
        return self._empty


class ComputeProgram(_Linked):
    """A linked compute pass. Make it `undisturbed`."""

    def __init__(self, context: GLContext, text: Text) -> None:
        try:
            linked = context.ctx.compute_shader(text.code)
        except moderngl.Error as error:
            raise _rejected(text, str(error)) from error
        super().__init__(context, linked, text)
        self.run = linked.run


def _rejected(text: Text, message: str) -> ShaderError:
    return ShaderError(f"{text.files[1]} of {text.files}: {text.explain(message)}")


class Programs:
    """All programs that a context has compiled, by their composition."""

    def __init__(self, context: GLContext) -> None:
        self._context = context
        self._programs: dict[tuple[Any, ...], Program] = {}
        self._computes: dict[tuple[Any, ...], ComputeProgram] = {}

    def get(
        self,
        vertex: str,
        fragment: str,
        dialect: str = "core330",
        slots: Slots | None = None,
        defines: Defines | None = None,
        geometry: str | None = None,
    ) -> Program:
        """The program of a vertex and a fragment shader, and a geometry shader if given; compiled at its first use.

        Raises
        ------
        ShaderError
            If a snippet is missing or the driver rejects the text.
        """
        slots, defines = slots or {}, defines or {}
        key = (vertex, fragment, geometry, dialect, tuple(sorted(slots.items())), tuple(sorted(defines.items())))
        if key not in self._programs:
            plain = "core330" if dialect.startswith("core") else dialect  # only the fragment stage uses extensions
            texts = []
            for name, spoken in ((vertex, plain), (fragment, dialect), *([(geometry, plain)] if geometry else [])):
                texts.append(compose(name, spoken, slots, _declared(name, spoken, slots, defines)))
            with undisturbed():  # until it is noted: what is not would never be deleted
                self._programs[key] = Program(self._context, *texts)
        return self._programs[key]

    def compute(self, name: str, slots: Slots | None = None, defines: Defines | None = None) -> ComputeProgram:
        """The program of a compute shader, compiled at its first use; needs `Caps.compute`."""
        slots, defines = slots or {}, defines or {}
        key = (name, tuple(sorted(slots.items())), tuple(sorted(defines.items())))
        if key not in self._computes:
            text = compose(name, "core430", slots, defines)
            with undisturbed():
                self._computes[key] = ComputeProgram(self._context, text)
        return self._computes[key]

    def release(self) -> None:
        """Delete all programs."""
        for each in self._computes.values():
            each.gl.release()
        self._computes.clear()
        for program in self._programs.values():
            if program._empty is not None:
                program._empty.release()
            program.gl.release()
        self._programs.clear()


def _declared(name: str, dialect: str, slots: Slots, defines: Defines) -> Defines:
    """The defines that this stage uses: a define of one stage is no error in the other."""
    known = compose(name, dialect, slots).declared
    return {key: value for key, value in defines.items() if key in known}
