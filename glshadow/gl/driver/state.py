"""OpenGL state of the calling program: saved, set to the renderer's defaults, and restored.

Not saved, because nothing here changes it: attachments, draw buffers and contents of the program's objects,
stencil and logic operations, transform feedback, queries. Pending OpenGL errors of the program are dropped.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import moderngl

from glshadow.gl.driver.entry_points import EntryPoints

# Capabilities of glEnable; all are off by default except those in _ON.
_SWITCHES = {
    "depth test": 0x0B71,
    "cull face": 0x0B44,
    "scissor test": 0x0C11,
    "stencil test": 0x0B90,
    "depth clamp": 0x864F,
    "polygon offset fill": 0x8037,
    "polygon offset line": 0x2A02,
    "polygon offset point": 0x2A01,
    "rasterizer discard": 0x8C89,
    "program point size": 0x8642,
    "primitive restart": 0x8F9D,
    "colour logic op": 0x0BF2,
    "framebuffer sRGB": 0x8DB9,
    "dither": 0x0BD0,
    "multisample": 0x809D,
    "sample alpha to coverage": 0x809E,
    "sample alpha to one": 0x809F,
    "sample coverage": 0x80A0,
    "sample mask": 0x8E51,
    **{f"clip distance {i}": 0x3000 + i for i in range(8)},
}
_ON = {"multisample"}

# One integer each: name -> (glGet name, setter, arguments before the value).
_INTEGERS: dict[str, tuple[int, str, tuple[int, ...]]] = {
    "depth func": (0x0B74, "glDepthFunc", ()),
    "depth mask": (0x0B72, "glDepthMask", ()),
    "cull face mode": (0x0B45, "glCullFace", ()),
    "front face": (0x0B46, "glFrontFace", ()),
    "read colour clamp": (0x891C, "glClampColor", (0x891C,)),
    "program": (0x8B8D, "glUseProgram", ()),
    "vertex array": (0x85B5, "glBindVertexArray", ()),
    "array buffer": (0x8894, "glBindBuffer", (0x8892,)),
    "pixel pack buffer": (0x88ED, "glBindBuffer", (0x88EB,)),
    "pixel unpack buffer": (0x88EF, "glBindBuffer", (0x88EC,)),
    "copy read buffer": (0x8F36, "glBindBuffer", (0x8F36,)),
    "copy write buffer": (0x8F37, "glBindBuffer", (0x8F37,)),
    "texture buffer": (0x8C2A, "glBindBuffer", (0x8C2A,)),
    "renderbuffer": (0x8CA7, "glBindRenderbuffer", (0x8D41,)),
    "draw framebuffer": (0x8CA6, "glBindFramebuffer", (0x8CA9,)),
    "read framebuffer": (0x8CAA, "glBindFramebuffer", (0x8CA8,)),
    # glPixelStorei uses the same enum as glGet.
    **{
        f"{way} {what}": (first + i, "glPixelStorei", (first + i,))
        for way, first in (("unpack", 0x0CF0), ("pack", 0x0D00))
        for i, what in enumerate(("swap bytes", "lsb first", "row length", "skip rows", "skip pixels", "alignment"))
    },
}
_INTEGER_DEFAULTS = {
    "depth func": 0x0201,  # LESS
    "depth mask": 1,
    "cull face mode": 0x0405,  # BACK
    "front face": 0x0901,  # CCW
    "read colour clamp": 0x891D,  # FIXED_ONLY
    "unpack alignment": 4,
    "pack alignment": 4,
}
# Not set to a default: every draw of the renderer sets them.
_NO_DEFAULT = {"program", "vertex array", "draw framebuffer", "read framebuffer"}

_BLEND_FUNC = (0x80C9, 0x80C8, 0x80CB, 0x80CA)  # SRC_RGB, DST_RGB, SRC_ALPHA, DST_ALPHA
_BLEND_EQUATION = (0x8009, 0x883D)
_BLEND, _COLOR_WRITEMASK = 0x0BE2, 0x0C23
_POLYGON_MODE, _FRONT_AND_BACK, _FILL = 0x0B40, 0x0408, 0x1B02
_VIEWPORT, _SCISSOR_BOX = 0x0BA2, 0x0C10
_DEPTH_RANGE, _CLEAR_COLOR, _CLEAR_DEPTH = 0x0B70, 0x0C22, 0x0B73
_OFFSET_FACTOR, _OFFSET_UNITS, _OFFSET_CLAMP = 0x8038, 0x2A00, 0x8E1B
_LINE_WIDTH, _POINT_SIZE = 0x0B21, 0x0B11
_CLIP_ORIGIN, _CLIP_DEPTH_MODE = 0x935C, 0x935D
_LOWER_LEFT, _NEGATIVE_ONE_TO_ONE = 0x8CA1, 0x935E

_ACTIVE_TEXTURE, _TEXTURE0, _SAMPLER_BINDING = 0x84E0, 0x84C0, 0x8919
_TEXTURE_BINDINGS = {  # target: glGet name
    0x0DE1: 0x8069,  # 2D
    0x8C1A: 0x8C1D,  # 2D array
    0x8513: 0x8514,  # cube map
    0x806F: 0x806A,  # 3D
    0x8C2A: 0x8C2C,  # buffer
    0x9100: 0x9104,  # 2D multisample
}
_TEXTURE_UNITS = 16
_DRAW_BUFFERS = 8
_BUFFER_UNITS = 8
_UNIFORM_BUFFER = (0x8A11, 0x8A28, 0x8A29, 0x8A2A)  # target, binding, start, size
_STORAGE_BUFFER = (0x90D2, 0x90D3, 0x90D4, 0x90D5)
# NAME, LEVEL, LAYERED, LAYER, ACCESS, FORMAT: the arguments of glBindImageTexture after the unit
_IMAGE_BINDING = (0x8F3A, 0x8F3B, 0x8F3C, 0x8F3D, 0x8F3E, 0x906E)

State = dict[str, Any]
"""Name of a piece of state -> its value, comparable with ==."""


@dataclass(frozen=True)
class _Driver:
    """Optional state that this driver has; reading other state would raise a GL error."""

    clip_control: bool
    offset_clamp: bool
    storage_buffers: bool
    images: bool

    @classmethod
    def of(cls, ctx: moderngl.Context, gl: EntryPoints) -> "_Driver":
        version, extensions = ctx.version_code, ctx.extensions
        return cls(
            clip_control=version >= 450 or "GL_ARB_clip_control" in extensions,
            offset_clamp=gl.has("glPolygonOffsetClamp")
            and (version >= 460 or bool({"GL_ARB_polygon_offset_clamp", "GL_EXT_polygon_offset_clamp"} & extensions)),
            storage_buffers=version >= 430 or "GL_ARB_shader_storage_buffer_object" in extensions,
            images=version >= 420 or "GL_ARB_shader_image_load_store" in extensions,
        )


def read_state(ctx: moderngl.Context, gl: EntryPoints) -> State:
    """All state that the renderer may change, as OpenGL reports it for the current context."""
    driver = _Driver.of(ctx, gl)
    state: State = {name: gl.is_enabled(capability) for name, capability in _SWITCHES.items()}
    state |= {name: gl.integer(parameter) for name, (parameter, _, _) in _INTEGERS.items()}
    state |= {
        "blend": [bool(gl.call("glIsEnabledi", _BLEND, i)) for i in range(_DRAW_BUFFERS)],
        "blend func": [gl.integer(name) for name in _BLEND_FUNC],
        "blend equation": [gl.integer(name) for name in _BLEND_EQUATION],
        "colour masks": [gl.indexed_booleans(_COLOR_WRITEMASK, i, 4) for i in range(_DRAW_BUFFERS)],
        "polygon mode": gl.integer(_POLYGON_MODE),
        "viewport": gl.integers(_VIEWPORT, 4),
        "scissor box": gl.integers(_SCISSOR_BOX, 4),
        "depth range": gl.doubles(_DEPTH_RANGE, 2),
        "clear colour": gl.doubles(_CLEAR_COLOR, 4),
        "clear depth": gl.doubles(_CLEAR_DEPTH, 1),
        "line width": gl.doubles(_LINE_WIDTH, 1),
        "point size": gl.doubles(_POINT_SIZE, 1),
        "polygon offset": gl.doubles(_OFFSET_FACTOR) + gl.doubles(_OFFSET_UNITS),
        "uniform buffers": _read_buffers(gl, _UNIFORM_BUFFER),
        "uniform buffer": gl.integer(_UNIFORM_BUFFER[1]),
        "active texture": gl.integer(_ACTIVE_TEXTURE),
    }
    state["textures"] = _read_textures(ctx, gl)
    if driver.clip_control:
        state["clip control"] = (gl.integer(_CLIP_ORIGIN), gl.integer(_CLIP_DEPTH_MODE))
    if driver.offset_clamp:
        state["polygon offset"] += gl.doubles(_OFFSET_CLAMP)
    if driver.storage_buffers:
        state["storage buffers"] = _read_buffers(gl, _STORAGE_BUFFER)
        state["storage buffer"] = gl.integer(_STORAGE_BUFFER[1])
    if driver.images:
        state["images"] = [[gl.indexed_integer(name, i) for name in _IMAGE_BINDING] for i in range(_BUFFER_UNITS)]
    return state


def write_state(gl: EntryPoints, state: State) -> None:
    """Set everything that `read_state` returned, or a part of it."""
    for name, capability in _SWITCHES.items():
        if name in state:
            gl.set_enabled(capability, state[name])
    # The active unit last: binding textures changes it.
    for unit, (sampler, textures) in state.get("textures", {}).items():
        gl.call("glActiveTexture", _TEXTURE0 + unit)
        gl.call("glBindSampler", unit, sampler)
        for target, glo in textures.items():
            gl.call("glBindTexture", target, glo)
    # Indexed bindings before the plain ones: glBindBufferRange sets both.
    for group, name in ((_UNIFORM_BUFFER, "uniform buffer"), (_STORAGE_BUFFER, "storage buffer")):
        for unit, (glo, start, size) in enumerate(state.get(f"{name}s", ())):
            if size:
                gl.call("glBindBufferRange", group[0], unit, glo, start, size)
            else:
                gl.call("glBindBufferBase", group[0], unit, glo)
        if name in state:
            gl.call("glBindBuffer", group[0], state[name])
    for unit, image in enumerate(state.get("images", ())):
        gl.call("glBindImageTexture", unit, *image)
    for name, (_, setter, before) in _INTEGERS.items():
        if name in state:
            gl.call(setter, *before, state[name])
    for i, on in enumerate(state.get("blend", ())):
        gl.call("glEnablei" if on else "glDisablei", _BLEND, i)
    for i, mask in enumerate(state.get("colour masks", ())):
        gl.call("glColorMaski", i, *mask)
    if "polygon offset" in state:
        offset = state["polygon offset"]
        gl.call("glPolygonOffset" if len(offset) == 2 else "glPolygonOffsetClamp", *offset)
    if "polygon mode" in state:
        gl.call("glPolygonMode", _FRONT_AND_BACK, state["polygon mode"])
    if "active texture" in state:
        gl.call("glActiveTexture", state["active texture"])
    for name, setter in (
        ("blend func", "glBlendFuncSeparate"),
        ("blend equation", "glBlendEquationSeparate"),
        ("viewport", "glViewport"),
        ("scissor box", "glScissor"),
        ("depth range", "glDepthRange"),
        ("clear colour", "glClearColor"),
        ("clear depth", "glClearDepth"),
        ("line width", "glLineWidth"),
        ("point size", "glPointSize"),
        ("clip control", "glClipControl"),
    ):
        if name in state:
            gl.call(setter, *state[name])


def default_state(ctx: moderngl.Context, gl: EntryPoints) -> State:
    """Set the state in which the renderer starts every frame, in its own context and in adopted ones."""
    driver = _Driver.of(ctx, gl)
    state: State = {name: name in _ON for name in _SWITCHES}
    state |= {name: _INTEGER_DEFAULTS.get(name, 0) for name in _INTEGERS if name not in _NO_DEFAULT}
    state |= {
        "blend": [False] * _DRAW_BUFFERS,
        "blend func": (1, 0, 1, 0),
        "blend equation": (0x8006, 0x8006),
        "colour masks": [(1, 1, 1, 1)] * _DRAW_BUFFERS,
        "polygon mode": _FILL,
        "polygon offset": (0.0, 0.0, 0.0) if driver.offset_clamp else (0.0, 0.0),
        "depth range": (0.0, 1.0),
        "line width": (1.0,),
        "point size": (1.0,),
        # A sampler object on a unit would override the filter of the texture that is bound there next.
        "textures": {unit: (0, {}) for unit in range(_TEXTURE_UNITS)},
        "active texture": _TEXTURE0,
    }
    if driver.clip_control:
        state["clip control"] = (_LOWER_LEFT, _NEGATIVE_ONE_TO_ONE)
    return state


@contextmanager
def preserved_state(ctx: moderngl.Context, gl: EntryPoints) -> Iterator[None]:
    """Default state inside the block; afterwards the previous state, in OpenGL and in moderngl's own copy.

    moderngl caches the bound framebuffer, the enable flags, culling, polygon offset and wireframe, and relies on the cache; both are
    restored.
    """
    gl.errors()
    state = read_state(ctx, gl)
    notes = (ctx.fbo, ctx.mglo.fbo, ctx.cull_face, ctx.front_face, ctx.polygon_offset, ctx.wireframe)
    write_state(gl, default_state(ctx, gl))
    try:
        yield
    finally:
        ctx.fbo, ctx.mglo.fbo, ctx.cull_face, ctx.front_face, ctx.polygon_offset, ctx.wireframe = notes
        ctx.enable_only(_moderngl_flags(state))
        write_state(gl, state)
        gl.errors()


def _moderngl_flags(state: State) -> int:
    flags = {
        "depth test": moderngl.DEPTH_TEST,
        "cull face": moderngl.CULL_FACE,
        "rasterizer discard": moderngl.RASTERIZER_DISCARD,
        "program point size": moderngl.PROGRAM_POINT_SIZE,
    }
    blend = moderngl.BLEND if any(state["blend"]) else 0
    return sum(flag for name, flag in flags.items() if state[name]) | blend


def _read_buffers(gl: EntryPoints, group: tuple[int, int, int, int]) -> list[tuple[int, int, int]]:
    _, binding, start, size = group
    return [
        (gl.indexed_integer(binding, i), gl.indexed_long(start, i), gl.indexed_long(size, i))
        for i in range(_BUFFER_UNITS)
    ]


def _read_textures(ctx: moderngl.Context, gl: EntryPoints) -> dict[int, tuple[int, dict[int, int]]]:
    active = gl.integer(_ACTIVE_TEXTURE)
    found = {}
    # moderngl creates and reads textures on its default unit, the last one.
    for unit in (*range(_TEXTURE_UNITS), ctx.default_texture_unit):
        gl.call("glActiveTexture", _TEXTURE0 + unit)
        bindings = {target: gl.integer(name) for target, name in _TEXTURE_BINDINGS.items()}
        found[unit] = (gl.integer(_SAMPLER_BINDING), bindings)
    gl.call("glActiveTexture", active)
    return found
