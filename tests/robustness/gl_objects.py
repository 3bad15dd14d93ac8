"""How many OpenGL objects of each kind a context holds, and how much memory the process does."""

from __future__ import annotations

import ctypes as C
import os
from pathlib import Path

import glshadow as gs
from glshadow.gl.current import address

KINDS = ("Texture", "Buffer", "Framebuffer", "VertexArray", "Program", "Shader", "Sampler", "Query", "Renderbuffer")
NAMES = 4096  # asked one by one; drivers give the lowest name that is free, so that a leak shows as more names in use


def counted(renderer: gs.Renderer) -> dict[str, int]:
    """Objects by kind in the renderer's context."""
    counts = {}
    with renderer._context:
        for kind in KINDS:
            asked = C.CFUNCTYPE(C.c_ubyte, C.c_uint)(address(f"glIs{kind}"))
            counts[kind] = sum(bool(asked(name)) for name in range(1, NAMES))
    return counts


def resident_mib() -> float:
    """Memory of this process that is in RAM."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 2**20
