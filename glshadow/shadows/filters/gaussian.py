"""Gaussian: percentage closer filtering with bell-shaped weights."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import ArrayLike

from glshadow.core.setting import setting, whole
from glshadow.core.spaces import Array
from glshadow.shadows.filters.filter import StudiedFilter
from glshadow.shadows.filters.square import SquareFilter

BELLS = {1: (1, 2, 1), 2: (1, 3, 4, 3, 1), 3: (1, 5, 12, 16, 12, 5, 1)}
"""Weights of bilinear taps a texel apart, by radius."""


@dataclass(frozen=True)
class Gaussian(SquareFilter, StudiedFilter):
    """Percentage closer filtering with lower weights towards the border: softer edges than a box of the same reach.

    Parameters
    ----------
    radius : int
        1 to 3 texels: 3 x 3, 5 x 5, 7 x 7 bilinear comparisons.

    References
    ----------
    Castano 2013, "Shadow Mapping Summary", The Witness: weights 1 2 1, 1 3 4 3 1 and 1 5 12 16 12 5 1 along each axis. Babylon.js calls the
    first two PCF at medium and high quality.
    """

    radius: int = setting(whole(1, max(BELLS), unit="texels"), 2, help="radius in texels, 1 to 3")

    spelling = "gaussian"
    snippet = "filter/gaussian.glsl"
    summary = "mean over (2 RADIUS + 1)^2 comparisons with bell-shaped weights"
    source = "Castano 2013"
    fails = "edges widen to about 1.5 RADIUS + 1 texels; creases read the neighbouring wall"

    def defines(self) -> Mapping[str, int | str]:
        """Define for the radius."""
        return {"GLS_GAUSSIAN_RADIUS": self.radius}

    def weights(self, fraction: Array) -> Array:
        """Bell-shaped weights."""
        return bell_weights(fraction, self.radius)

    @classmethod
    def variants(cls) -> tuple[Self, ...]:
        """Every radius."""
        return tuple(cls(radius) for radius in BELLS)

    @classmethod
    def extremes(cls) -> tuple[Self, ...]:
        """The largest radius."""
        return (cls(max(BELLS)),)


def bell_weights(fraction: ArrayLike, radius: int) -> Array:
    """Weights (..., 2 radius + 2) of the texels that a row of bilinear taps reads; sum 1. `fraction`: see `pcf.box_weights`."""
    f = np.asarray(fraction, dtype=np.float64)[..., None]
    bell = np.array(BELLS[radius], dtype=np.float64)
    return np.asarray((np.append(bell, 0.0) * (1.0 - f) + np.insert(bell, 0, 0.0) * f) / bell.sum())
