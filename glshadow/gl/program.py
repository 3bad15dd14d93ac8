"""Composed snippets become moderngl programs, once each; a driver's complaint names the snippet and its line."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import moderngl
import numpy as np

from glshadow.errors import ShaderError
from glshadow.gl.context import GLContext
from glshadow.shader.compose import Text, compose

# Which texture unit each sampler reads, the same in every program, so that it is set once.
UNITS = {
    "u_map": 0,
    "u_texture": 0,
    "u_surface": 1,
    "u_camera_depth": 2,
    "u_planes": 3,
    "u_owners": 4,
    "u_colors": 5,
    "u_sum": 6,
    "u_heads": 0,
    "u_numbers": 0,
    "u_given": 0,
    "u_points": 7,
    "u_edges": 11,
    "u_pixels": 12,
    "u_facets": 7,
    "u_links": 8,
    "u_masks": 9,
    "u_alphas": 10,
    "u_positions": 11,
    "u_corners": 12,
    "u_traits": 13,
}

Slots = Mapping[str, str]
Defines = Mapping[str, int | str]


class Program:
    """A linked program with uniforms that may be absent: the compiler drops what a variant does not use."""

    def __init__(self, context: GLContext, vertex: Text, fragment: Text) -> None:
        try:
            self.gl = context.ctx.program(vertex.code, fragment.code)
        except moderngl.Error as error:
            message = str(error)
            raise _rejected(vertex if "\nvertex_shader\n" in message else fragment, message) from error
        self._empty: moderngl.VertexArray | None = None
        self._members: dict[str, Any] = {name: self.gl[name] for name in self.gl}
        for name, unit in UNITS.items():
            context.gl.set_sampler(self.gl.glo, name, unit)

    def vertex_array(self) -> moderngl.VertexArray:
        """A vertex array without attributes, for passes that make their triangle from gl_VertexID."""
        if self._empty is None:
            self._empty = self.gl.ctx.vertex_array(self.gl, [])
        return self._empty

    def __contains__(self, name: str) -> bool:
        return name in self._members

    def set(self, **values: Any) -> None:
        """Numbers, tuples, float64 arrays (matrices row-major, as everywhere in Python) and raw bytes to uniforms."""
        _set(self._members, values)

    def write(self, name: str, data: bytes) -> None:
        """Raw float32 bytes to a uniform, if it is there."""
        member = self._members.get(name)
        if member is not None:
            member.write(data)


class ComputeProgram:
    """A linked compute pass."""

    def __init__(self, context: GLContext, text: Text) -> None:
        try:
            self.gl = context.ctx.compute_shader(text.code)
        except moderngl.Error as error:
            raise _rejected(text, str(error)) from error
        self._members: dict[str, Any] = {name: self.gl[name] for name in self.gl}
        for name, unit in UNITS.items():
            context.gl.set_sampler(self.gl.glo, name, unit)

    def set(self, **values: Any) -> None:
        """Numbers, tuples and float64 matrices to uniforms, which may be absent."""
        _set(self._members, values)


def _set(members: Mapping[str, Any], values: Mapping[str, Any]) -> None:
    for name, value in values.items():
        member = members.get(name)
        if member is None:
            continue
        if isinstance(value, bytes):
            member.write(value)
        elif isinstance(value, np.ndarray):
            member.write(np.ascontiguousarray(value.T, dtype=np.float32).tobytes())
        else:
            member.value = value


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
    ) -> Program:
        """The program of a vertex and a fragment pass, compiled the first time it is asked for.

        Raises
        ------
        ShaderError
            If a snippet is missing or the driver rejects the text.
        """
        slots, defines = slots or {}, defines or {}
        key = (vertex, fragment, dialect, tuple(sorted(slots.items())), tuple(sorted(defines.items())))
        if key not in self._programs:
            plain = "core330" if dialect.startswith("core") else dialect  # a vertex stage gathers nothing
            texts = []
            for name, spoken in ((vertex, plain), (fragment, dialect)):
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
