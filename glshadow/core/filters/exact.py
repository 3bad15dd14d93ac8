"""Exact: the triangles themselves are asked."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np

from glshadow.core.filters.filter import Filter, Needs
from glshadow.core.setting import one_of, setting
from glshadow.core.spaces import Array

SAMPLES = (1, 4, 8, 16)

BLOCKS = {4: (2, 2), 8: (4, 2), 16: (4, 4)}
"""Columns and rows of the block that holds the samples of a pixel."""


@dataclass(frozen=True)
class Exact(Filter):
    """No map: each receiver asks the triangles themselves, sorted by where they lie seen from the light. Needs no bias.

    Exact hard shadows where OpenGL 4.3 is; elsewhere the triangles nearest in a map of their numbers are asked, which misses those
    that no texel saw (`Used.fallbacks` says so).

    Parameters
    ----------
    samples : int
        1, 4, 8 or 16 points in each pixel near a shadow's edge.

    References
    ----------
    Wyman, Hoetzlein, Lefohn 2015, "Frustum-Traced Raster Shadows: Revisiting Irregular Z-Buffers", I3D; Story 2015, "Hybrid
    Ray-Traced Shadows", GDC.
    """

    samples: int = setting(one_of(*SAMPLES), 1, help="points in each pixel on an edge: 1, 4, 8 or 16")

    spelling = "exact"
    terse = True
    needs = Needs.TRIANGLES
    summary = "no map: asks the triangles"
    source = "Wyman, Hoetzlein, Lefohn 2015"
    fails = "long lists where hundreds of slivers share a cell; OpenGL 3.3 has only a map of triangle numbers"

    @property
    def reach_texels(self) -> float:
        """Texels of the map of numbers that the fallback reads to each side."""
        return 2.0

    @classmethod
    def studied(cls) -> tuple[Self, ...]:
        """Without and with antialiasing, which costs time and saves no wrong pixel."""
        return (cls(), cls(16))


def sample_offsets(samples: int) -> Array:
    """Where in a pixel Exact's points lie: (samples, 2) from its middle, right and up, in pixels.

    16: a 4 x 4 grid. 4 and 8: one point in each row and column of a 4 x 4 or 8 x 8 grid.
    """
    if samples == 16:
        steps = (np.arange(4) + 0.5) / 4.0 - 0.5
        return np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2)
    columns = {1: (0,), 4: (1, 3, 0, 2), 8: (2, 5, 7, 1, 4, 0, 6, 3)}[samples]
    return np.stack([np.asarray(columns), np.arange(samples)], axis=-1) / samples + 0.5 / samples - 0.5
