"""PerSample: some pixels whose samples are shaded together, a block of samples for each."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import moderngl

from glshadow.gl.driver.buffers import BufferTexture


@dataclass(frozen=True, eq=False)
class PerSample:
    """Some of the collected pixels, whose samples are shaded together.

    Parameters
    ----------
    framebuffer : moderngl.Framebuffer
        Colour 0: the sum of all lights, blended; colour 1: one light's visibility, where it is wanted.
    pixels : BufferTexture
        All that are collected.
    first, count, across : int
        Which of them, and how many blocks lie in a row.
    block : (2,) ints
        Columns and rows of samples.
    visibility : bool
        Whether it is wanted.
    """

    framebuffer: moderngl.Framebuffer
    pixels: BufferTexture
    first: int
    count: int
    across: int
    block: tuple[int, int]
    visibility: bool

    @property
    def defines(self) -> dict[str, int | str]:
        """Of lib/per_sample.glsl."""
        return {"GLS_COLUMNS": self.block[0], "GLS_ROWS": self.block[1]}

    @property
    def uniforms(self) -> dict[str, Any]:
        """Of lib/per_sample.glsl."""
        return {"u_batch": (self.first, self.count, self.across)}

    @property
    def viewport(self) -> tuple[int, int, int, int]:
        """The blocks that are used."""
        return (0, 0, min(self.count, self.across) * self.block[0], -(-self.count // self.across) * self.block[1])
