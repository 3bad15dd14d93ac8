"""Esm: exponential shadow maps."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from glshadow.core.setting import number, setting
from glshadow.core.spaces import Array
from glshadow.shadows.filters.moments import MomentFilter

MOST = 87.0
"""Largest exponent: ln of the largest float32 is 88.7."""


@dataclass(frozen=True)
class Esm(MomentFilter):
    """Exponential shadow map: the mean of exp(exponent (stored depth - own depth)), at most 1.

    Parameters
    ----------
    radius : int
        0 to 16: texels around the receiver that are averaged, (2 radius + 1)^2.
    exponent : float
        1 to 87, over the depth from near to far: a shadow is dark from about 3 / exponent of that behind the caster.

    References
    ----------
    Annen, Mertens, Seidel, Flerackers, Kautz 2008, "Exponential Shadow Maps", Graphics Interface.
    """

    exponent: float = setting(number(1.0, MOST), 80.0, help="exponent, 1 to 87")

    spelling = "esm"
    snippet = "filter/esm.glsl"
    encoding = "moments/esm.glsl"
    channels = 1
    summary = "mean of exp(EXPONENT depth) over a square, one sample"
    source = "Annen et al. 2008"
    fails = "light leaks near every contact, and where a far caster is beside a near one"

    def defines(self) -> Mapping[str, int | str]:
        """Defines for radius and exponent."""
        return {**super().defines(), "GLS_EXPONENT": repr(self.exponent)}

    def encoded(self, depth: Array) -> Array:
        """exp(c depth)."""
        return np.exp(self.exponent * depth)[:, None]

    def lit(self, depth: Array, means: Array, deviation: Array, extent: Array) -> Array:
        """The quotient of stored mean and exp(c depth), at most 1."""
        return np.minimum(means[:, 0] * np.exp(-self.exponent * depth), 1.0)
