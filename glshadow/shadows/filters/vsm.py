"""Vsm and Evsm: variance shadow maps, of depth and of exponentially warped depth."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Self

import numpy as np

from glshadow.core.setting import one_of, setting
from glshadow.core.spaces import Array
from glshadow.shadows.filters.moments import FLOAT_ROUNDING, HALF_ROUNDING, BoundFilter, chebyshev

EXPONENTS = {"f4": 42.0, "f2": 5.54}
"""Greatest c such that the format can store exp(2 c): ln(FLT_MAX) / 2 = 44.4, ln(65504) / 2 = 5.545."""


class VarianceFilter(BoundFilter):
    """Base of filters that use Chebyshev's inequality."""

    @property
    def precision(self) -> str:
        """Half floats or floats."""
        return "f2" if self.half else "f4"

    @property
    def rounding(self) -> float:
        """Relative error of a stored mean."""
        return HALF_ROUNDING if self.half else FLOAT_ROUNDING

    def defines(self) -> Mapping[str, int | str]:
        """Defines of a bound filter, with the rounding."""
        return {**super().defines(), "GLS_ROUNDING": repr(self.rounding)}


@dataclass(frozen=True)
class Vsm(VarianceFilter):
    """Variance shadow map: the most light that is consistent with mean and variance of the stored depths.

    Parameters
    ----------
    radius : int
        0 to 16: texels around the receiver that are averaged, (2 radius + 1)^2.
    bleeding : float
        0 to 1: share of the light that is removed to reduce light bleeding; the rest is rescaled.
    half : bool
        Half floats: half the memory; only for casters far from what they shadow, about 3 % of the depth from near to far.

    References
    ----------
    Donnelly, Lauritzen 2006, "Variance Shadow Maps", I3D. Lauritzen 2007, GPU Gems 3, chapter 8: bleeding.
    """

    spelling = "vsm"
    snippet = "filter/vsm.glsl"
    encoding = "moments/vsm.glsl"
    channels = 2
    summary = "Chebyshev's bound from mean and variance over a square"
    source = "Donnelly, Lauritzen 2006"
    fails = "light bleeding where casters overlap; light leaks near every contact"

    def encoded(self, depth: Array) -> Array:
        """x, x^2 of x from -1 to 1."""
        x = 2.0 * depth - 1.0
        return np.stack([x, x * x], axis=-1)

    def lit(self, depth: Array, means: Array, deviation: Array, extent: Array) -> Array:
        """Chebyshev's bound."""
        return self.unbled(chebyshev(means[:, 0], means[:, 1], 2.0 * depth - 1.0, self.rounding))

    @classmethod
    def variants(cls) -> tuple[Self, ...]:
        """The default, and one with less light bleeding."""
        return (cls(), cls(3, 0.25), cls(mip_maps=True))


@dataclass(frozen=True)
class Evsm(VarianceFilter):
    """Exponential variance shadow map: `Vsm` of depth warped by exp, which separates casters from each other.

    Parameters
    ----------
    radius, bleeding
        As in `Vsm`.
    half : bool
        Half floats: half the memory, but an exponent of 5.54 instead of 42, which warps little.
    components : {4, 2}
        4: warped both ways, using the smaller share; 2: one way.

    References
    ----------
    Lauritzen, McCool 2008, "Layered Variance Shadow Maps", Graphics Interface, section 5. Pettineo 2013, "A Sampling of Shadow Techniques".
    """

    components: int = setting(one_of(4, 2), 4, help="channels, 4 or 2")

    spelling = "evsm"
    snippet = "filter/evsm.glsl"
    encoding = "moments/evsm.glsl"
    summary = "vsm of depth warped by exp, one way or both"
    source = "Lauritzen, McCool 2008"
    fails = "light bleeding, less than vsm; half floats: about as much as vsm"

    @property
    def channels(self) -> int:  # type: ignore[override]
        """`components`."""
        return self.components

    @property
    def exponent(self) -> float:
        """The largest exponent that the format can store."""
        return EXPONENTS[self.precision]

    def defines(self) -> Mapping[str, int | str]:
        """Defines of a variance filter, with exponent and components."""
        more: dict[str, int | str] = {"GLS_EXPONENT": repr(self.exponent), "GLS_COMPONENTS": self.components}
        return {**super().defines(), **more}

    def encoded(self, depth: Array) -> Array:
        """Depth warped both ways, with squares."""
        x = 2.0 * depth - 1.0
        away, back = np.exp(self.exponent * x), -np.exp(-self.exponent * x)
        return np.stack([away, away**2, back, back**2], axis=-1)[:, : self.components]

    def lit(self, depth: Array, means: Array, deviation: Array, extent: Array) -> Array:
        """The smaller of the two bounds; see glsl/filter/evsm.glsl for the corrections."""
        x, c = np.clip(2.0 * depth - 1.0, -1.0, 1.0), self.exponent
        away = np.exp(c * x)
        found = self.unbled(chebyshev(means[:, 0], means[:, 1], away, self.rounding * away**2))
        if self.components == 2:
            return found
        shift = np.minimum(0.5 * c * (2.0 * deviation) ** 2, 2.0 * extent)
        back = -np.exp(-c * np.maximum(x - shift, -1.0))
        return np.minimum(found, self.unbled(chebyshev(means[:, 2], means[:, 3], back, self.rounding * back**2)))

    @classmethod
    def variants(cls) -> tuple[Self, ...]:
        """Both component counts, both formats."""
        return (cls(), cls(3, 0.1, components=2), cls(half=True), cls(mip_maps=True))

    @classmethod
    def studied(cls) -> tuple[Self, ...]:
        """Both component counts."""
        return (cls(), cls(components=2))
