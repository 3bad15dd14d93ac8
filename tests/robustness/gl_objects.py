"""Numbers of OpenGL objects in a context by kind, and memory of the process."""

from __future__ import annotations

import ctypes as C
import os
from pathlib import Path

import glshadow as gs
from glshadow.gl.driver.current import address

KINDS = ("Texture", "Buffer", "Framebuffer", "VertexArray", "Program", "Shader", "Sampler", "Query", "Renderbuffer")
NAMES = 4096  # names tested one by one, at least; a driver that assigns the lowest free name needs no more


def counted(renderer: gs.Renderer) -> dict[str, int]:
    """Number of objects in the renderer's context by kind."""
    counts = {}
    with renderer._context:
        for kind in KINDS:
            is_object = C.CFUNCTYPE(C.c_ubyte, C.c_uint)(address(f"glIs{kind}"))
            counts[kind] = sum(bool(is_object(name)) for name in range(1, max(NAMES, _fresh(kind) + 1)))
    return counts


def _fresh(kind: str) -> int:
    """A free name: Mesa 22.3 counts names of textures and buffers upwards, so that all in use are below it."""
    if kind in ("Program", "Shader"):  # textures and buffers share one space of names
        name = int(C.CFUNCTYPE(C.c_uint)(address("glCreateProgram"))())
        C.CFUNCTYPE(None, C.c_uint)(address("glDeleteProgram"))(name)
        return name
    many = f"{kind.removesuffix('y')}ies" if kind.endswith("y") else f"{kind}s"
    given = C.c_uint()
    for verb in ("glGen", "glDelete"):
        C.CFUNCTYPE(None, C.c_int, C.POINTER(C.c_uint))(address(verb + many))(1, C.byref(given))
    return given.value


def resident_mib() -> float:
    """Resident memory of this process, without what the allocator caches (glibc: 40 MiB more or less, by chance)."""
    trim = getattr(C.CDLL(None), "malloc_trim", None)
    if trim is not None:
        trim(0)
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 2**20
