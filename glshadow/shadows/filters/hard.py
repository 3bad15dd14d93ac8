"""Hard: a comparison with the nearest texel."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from glshadow.core.spaces import Array
from glshadow.shadows.filters.filter import Compare, Filter, Needs


@dataclass(frozen=True)
class Hard(Filter):
    """A comparison with the nearest texel: lit or not.

    References
    ----------
    Williams 1978, "Casting Curved Shadows on Curved Surfaces", SIGGRAPH.
    """

    spelling = "hard"
    needs = Needs.COMPARISON
    snippet = "filter/hard.glsl"
    summary = "one comparison with the nearest texel"
    source = "Williams 1978"
    fails = "stair-stepped edges, one texel per step"

    @property
    def slack_texels(self) -> float:
        """The nearest texel centre is up to half a texel away."""
        return 0.5

    @property
    def reach_texels(self) -> float:
        """The nearest texel centre."""
        return 0.5

    def visibility(self, position: Array, compare: Compare) -> Array:
        """The result for the nearest texel."""
        return compare(np.floor(position).astype(np.int64), np.zeros_like(position))
