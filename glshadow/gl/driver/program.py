"""Composed snippets become moderngl programs, once each; a driver's complaint names the snippet and its line."""

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
    """A linked program: uniforms that may be absent, since the compiler drops what a variant does not use, and its texture units."""

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
        """Names of the textures it reads."""
        return tuple(self._units)

    def set(self, **values: Any) -> None:
        """Numbers, tuples, float64 arrays (matrices row-major, as everywhere in Python) and raw bytes to uniforms."""
        for name, value in values.items():
            member = self._members.get(name)
            if member is not None:
                set_uniform(member, value)

    def write(self, name: str, data: bytes | NDArray[Any]) -> None:
        """Bytes as OpenGL holds them to a uniform, if it is there."""
        member = self._members.get(name)
        if member is not None:
            member.write(data)

    def bind(self, **textures: Any) -> None:
        """Textures, (texture, sampler object) or what makes one, to the units that read them; what it does not read is not made."""
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
        """Take the sampler objects off its units: they would override the filter of what is bound there next."""
        if self._units:
            self.gl.ctx.clear_samplers(0, len(self._units))


def set_uniform(member: Any, value: Any) -> None:
    """A number, a tuple, a float64 array (matrices row-major) or raw bytes to a moderngl.Uniform."""
    if isinstance(value, bytes):
        # the compiler may drop an array's last elements
        member.write(value[: 4 * member.dimension * member.array_length])
    elif isinstance(value, np.ndarray):
        member.write(np.ascontiguousarray(value.T, dtype=np.float32).tobytes())
    else:
        member.value = value


class Program(_Linked):
    """A linked vertex and fragment pass, with a geometry pass between them or none."""

    def __init__(self, context: GLContext, vertex: Text, fragment: Text, geometry: Text | None = None) -> None:
        stages = {"vertex_shader": vertex, "fragment_shader": fragment}
        if geometry is not None:
            stages["geometry_shader"] = geometry
        try:
            with undisturbed():
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
        """A vertex array without attributes, for passes that make their triangle from gl_VertexID."""
        if self._empty is None:
            self._empty = self.gl.ctx.vertex_array(self.gl, [])
        return self._empty


class ComputeProgram(_Linked):
    """A linked compute pass."""

    def __init__(self, context: GLContext, text: Text) -> None:
        try:
            with undisturbed():
                linked = context.ctx.compute_shader(text.code)
        except moderngl.Error as error:
            raise _rejected(text, str(error)) from error
        super().__init__(context, linked, text)
        self.run = linked.run


def _rejected(text: Text, message: str) -> ShaderError:
    return ShaderError(f"{text.files[1]} of {text.files}: {text.explain(message)}")


class Programs:
    """Every program that a context has compiled, by its composition."""

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
        """The program of a vertex and a fragment pass, and a geometry pass between them if it is named; compiled once.

        Raises
        ------
        ShaderError
            If a snippet is missing or the driver rejects the text.
        """
        slots, defines = slots or {}, defines or {}
        key = (vertex, fragment, geometry, dialect, tuple(sorted(slots.items())), tuple(sorted(defines.items())))
        if key not in self._programs:
            plain = "core330" if dialect.startswith("core") else dialect  # extensions are the fragment stage's alone
            texts = []
            for name, spoken in ((vertex, plain), (fragment, dialect), *([(geometry, plain)] if geometry else [])):
                texts.append(compose(name, spoken, slots, _declared(name, spoken, slots, defines)))
            self._programs[key] = Program(self._context, *texts)
        return self._programs[key]

    def compute(self, name: str, slots: Slots | None = None, defines: Defines | None = None) -> ComputeProgram:
        """The program of a compute pass, compiled the first time it is asked for; needs `Caps.compute`."""
        slots, defines = slots or {}, defines or {}
        key = (name, tuple(sorted(slots.items())), tuple(sorted(defines.items())))
        if key not in self._computes:
            self._computes[key] = ComputeProgram(self._context, compose(name, "core430", slots, defines))
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
    """The defines that this stage knows: a setting of one stage is none of the other's."""
    known = compose(name, dialect, slots).declared
    return {key: value for key, value in defines.items() if key in known}
