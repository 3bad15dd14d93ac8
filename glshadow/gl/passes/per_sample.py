"""PerSample: per-sample shading of collected pixels, with a block of samples for each."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import moderngl

from glshadow.gl.driver.buffers import BufferTexture


@dataclass(frozen=True, eq=False)
class PerSample:
    """A batch of collected pixels whose samples are shaded together.

    Parameters
    ----------
    framebuffer : moderngl.Framebuffer, optional
        Colour 0: the sum of all lights, blended; colour 1: one light's visibility, if requested. None: of passes with targets of their own.
    pixels : BufferTexture
        All collected pixels.
    first, count, across : int
        The batch within `pixels`, and the number of blocks in a row.
    block : (2,) ints
        Columns and rows of samples.
    visibility : bool
        Whether it is requested.
    size : (2,) ints
        Columns and rows of the packed buffers.
    aside : (2,) floats
        Offset of all rays, as of `CameraTargets.aside`; pixels.
    """

    framebuffer: moderngl.Framebuffer | None
    pixels: BufferTexture
    first: int
    count: int
    across: int
    block: tuple[int, int]
    visibility: bool
    size: tuple[int, int]
    aside: tuple[float, float] = (0.0, 0.0)

    @property
    def defines(self) -> dict[str, int | str]:
        """Defines of lib/per_sample.glsl."""
        return {"GLS_COLUMNS": self.block[0], "GLS_ROWS": self.block[1]}

    @property
    def uniforms(self) -> dict[str, Any]:
        """Uniforms of lib/per_sample.glsl."""
        return {"u_batch": (self.first, self.count, self.across)}

    @property
    def viewport(self) -> tuple[int, int, int, int]:
        """The part of the framebuffer that the batch uses."""
        return (0, 0, min(self.count, self.across) * self.block[0], -(-self.count // self.across) * self.block[1])
