"""EdgePcf: percentage closer filtering at shadow edges only."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import product
from typing import Self

import numpy as np

from glshadow.core.setting import setting, whole
from glshadow.core.spaces import Array
from glshadow.shadows.filters.filter import Compare, StudiedFilter
from glshadow.shadows.filters.pcf import MAX_RADIUS, box_weights
from glshadow.shadows.filters.square import SquareFilter


@dataclass(frozen=True)
class EdgePcf(SquareFilter, StudiedFilter):
    """`Pcf` where five blocks of its texels (corners and middle) disagree; otherwise the result of the blocks.

    Parameters
    ----------
    radius : int
        2 to 4 texels. With less, five blocks are more than half of all texels.

    References
    ----------
    Isidoro 2006, "Shadow Mapping: GPU-based Tips and Techniques", Game Developers Conference.
    """

    radius: int = setting(whole(2, MAX_RADIUS, unit="texels"), MAX_RADIUS, help=f"radius in texels, 2 to {MAX_RADIUS}")

    spelling = "edgepcf"
    snippet = "filter/edgepcf.glsl"
    summary = "pcf:RADIUS where five of its blocks disagree, else their common result"
    source = "Isidoro 2006"
    fails = "as pcf; features thinner than the gaps between the five blocks"

    def defines(self) -> Mapping[str, int | str]:
        """Define for the radius."""
        return {"GLS_PCF_RADIUS": self.radius}

    def weights(self, fraction: Array) -> Array:
        """Box weights, where all texels are read."""
        return box_weights(fraction, self.radius)

    def visibility(self, position: Array, compare: Compare) -> Array:
        """The mean of all texels, or the common result of the five blocks."""
        whole_ = super().visibility(position, compare)
        base = np.floor(position - 0.5)
        middle = 2 * (self.radius // 2)
        starts = [*product((0, 2 * self.radius), repeat=2), (middle, middle)]
        lit = []
        for start in starts:
            for step in product((0, 1), repeat=2):
                tap = base + np.add(start, step) - self.radius
                lit.append(compare(tap.astype(np.int64), base + np.array(start) - self.radius + 1.0 - position))
        few = np.stack(lit)
        return np.where(few.min(axis=0) == 1.0, 1.0, np.where(few.max(axis=0) == 0.0, 0.0, whole_))

    @classmethod
    def variants(cls) -> tuple[Self, ...]:
        """The smallest and the largest radius."""
        return (cls(2), cls(MAX_RADIUS))
