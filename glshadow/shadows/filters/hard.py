"""Hard: one nearest texel decides."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from glshadow.core.spaces import Array
from glshadow.shadows.filters.filter import Compare, Filter, Needs


@dataclass(frozen=True)
class Hard(Filter):
    """One nearest texel, lit or not.

    References
    ----------
    Williams 1978, "Casting Curved Shadows on Curved Surfaces", SIGGRAPH.
    """

    spelling = "hard"
    needs = Needs.COMPARISON
    snippet = "filter/hard.glsl"
    summary = "one texel decides"
    source = "Williams 1978"
    fails = "staircases of a texel"

    @property
    def slack_texels(self) -> float:
        """The nearest centre lies up to half a texel away."""
        return 0.5

    @property
    def reach_texels(self) -> float:
        """As far as that."""
        return 0.5

    def visibility(self, position: Array, compare: Compare) -> Array:
        """The outcome of the nearest texel."""
        return compare(np.floor(position).astype(np.int64), np.zeros_like(position))
