"""Pcf: percentage closer filtering over a square of texels."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import ArrayLike

from glshadow.core.setting import setting, whole
from glshadow.core.spaces import Array
from glshadow.shadows.filters.square import SquareFilter

MAX_RADIUS = 4


@dataclass(frozen=True)
class Pcf(SquareFilter):
    """Percentage closer filtering: the mean of (2 radius + 1)^2 bilinear comparisons, a texel apart.

    Parameters
    ----------
    radius : int
        0 to 4 texels. 0 is the hardware's 2 x 2 comparison (Luna's four taps).

    References
    ----------
    Reeves, Salesin, Cook 1987, "Rendering Antialiased Shadows with Depth Maps", SIGGRAPH.
    """

    radius: int = setting(whole(0, MAX_RADIUS, unit="texels"), 1, help=f"radius in texels, 0 to {MAX_RADIUS}")

    spelling = "pcf"
    snippet = "filter/pcf.glsl"
    summary = "mean over (2 RADIUS + 1)^2 comparisons"
    source = "Reeves, Salesin, Cook 1987"
    fails = "edges widen to 2 RADIUS + 1 texels; creases read the neighbouring wall"

    def defines(self) -> Mapping[str, int | str]:
        """Define for the radius."""
        return {"GLS_PCF_RADIUS": self.radius}

    def weights(self, fraction: Array) -> Array:
        """Box weights."""
        return box_weights(fraction, self.radius)

    @classmethod
    def variants(cls) -> tuple[Self, ...]:
        """Every radius."""
        return tuple(cls(radius) for radius in range(MAX_RADIUS + 1))

    @classmethod
    def rungs(cls) -> tuple[Self, ...]:
        """3 x 3 and 5 x 5."""
        return (cls(1), cls(2))

    @classmethod
    def extremes(cls) -> tuple[Self, ...]:
        """The smallest and the largest radius."""
        return (cls(0), cls(MAX_RADIUS))


def box_weights(fraction: ArrayLike, radius: int) -> Array:
    """Weights of the 2 radius + 2 texels that a row of bilinear taps reads; sum 1.

    Parameters
    ----------
    fraction : (...) array_like
        Position of the receiver between the centres of its two nearest texels, in [0, 1).

    Returns
    -------
    (..., 2 radius + 2) float64
        1 - f, 1, ..., 1, f over 2 radius + 1: bilinear taps a texel apart overlap to a box with ramps at its ends.
    """
    f = np.asarray(fraction, dtype=np.float64)
    weights = np.ones((*f.shape, 2 * radius + 2))
    weights[..., 0] = 1.0 - f
    weights[..., -1] = f
    return np.asarray(weights / (2 * radius + 1))
