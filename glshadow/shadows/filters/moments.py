"""MomentFilter: base of filters that ask the mean of something of depth, taken over a square of texels before it is asked."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import KW_ONLY, dataclass
from typing import Any, ClassVar, Self

import numpy as np

from glshadow.core.setting import flag, number, setting, whole
from glshadow.core.spaces import Array
from glshadow.shadows.filters.filter import Needs, StudiedFilter

MAX_RADIUS = 16

MIP_LEVELS = 3
"""Mip maps above a map's own: as many as its guard band keeps free of what lies beside it."""

FLOAT_ROUNDING = 2.0**-22
"""Of a stored mean, relative: a few roundings of float32, its own and those of the sums that made it."""

HALF_ROUNDING = 2.0**-9
"""The same of float16, to which each pass rounds, by llvmpipe downwards."""


@dataclass(frozen=True)
class MomentFilter(StudiedFilter):
    """Base.

    Attributes
    ----------
    encoding : str
        What fills the slot <encoding> of pass/moments.frag.
    """

    radius: int = setting(
        whole(0, MAX_RADIUS, unit="texels"), 1, help=f"0 to {MAX_RADIUS}: of the square, (2 RADIUS + 1)^2"
    )

    _: KW_ONLY
    mip_maps: bool = setting(flag(), False, help="also over a pixel, where it is larger than a texel: calm from afar")

    needs = Needs.MOMENTS
    encoding: ClassVar[str] = ""

    @property
    def reach_texels(self) -> float:
        """The hardware's bilinear filter reads means of a square beside the receiver."""
        return self.radius + 1.0 + (1.5 * (2.0**MIP_LEVELS - 1.0) if self.mip_maps else 0.0)

    @property
    def precision(self) -> str:
        """As moderngl calls it."""
        return "f4"

    def defines(self) -> Mapping[str, int | str]:
        """Radius and mip maps."""
        return {"GLS_MOMENT_RADIUS": self.radius, "GLS_MIP_LEVELS": MIP_LEVELS if self.mip_maps else 0}

    def encoded(self, depth: Array) -> Array:
        """What a map stores (N, components) of depths (N,) from 0 at near to 1 at far; the float64 twin of <encoding>."""
        raise NotImplementedError

    def lit(self, depth: Array, means: Array, deviation: Array, extent: Array) -> Array:
        """The float64 twin of <filter>.

        Parameters
        ----------
        depth : (N,) float64
            Of receivers.
        means : (N, components) float64
            Of what is stored around them.
        deviation, extent : (N,) float64
            How their own plane's depth spreads over the kernel: standard deviation, and the most that it differs.
        """
        raise NotImplementedError

    @classmethod
    def variants(cls) -> tuple[Self, ...]:
        """One of each shape of code."""
        return (cls(),)


@dataclass(frozen=True)
class BoundFilter(MomentFilter):
    """Base of those that ask a bound: some light bleeds, and a share may be taken for that."""

    bleeding: float = setting(number(0.0, 1.0, below=True), 0.0, help="0 to 1: share taken for light that bleeds")
    half: bool = setting(flag(), False)

    def defines(self) -> Mapping[str, int | str]:
        """Also what is taken for bleeding."""
        return {**super().defines(), "GLS_BLEEDING": repr(self.bleeding)}

    def unbled(self, share: Array) -> Array:
        """What is left of a share of light, stretched."""
        return np.asarray(np.clip((share - self.bleeding) / (1.0 - self.bleeding), 0.0, 1.0))


def spread(radius: int, slope: Array) -> tuple[Array, Array]:
    """(deviation, extent) of a plane's depth over the kernel; `slope` (N, 2): its gradient per texel. Twin of lib/plane_spread.glsl."""
    width = 2 * radius + 1
    deviation = np.linalg.norm(slope, axis=-1) * np.sqrt((width**2 - 1) / 12.0 + 0.25)
    return np.asarray(deviation), np.asarray(np.abs(slope).sum(axis=-1) * (radius + 1))


def chebyshev(mean: Array, square: Array, x: Any, least_variance: Any) -> Array:
    """The greatest share at or beyond x that mean and mean square allow."""
    beyond = x - mean
    variance = np.maximum(square - mean**2, least_variance)
    share = variance / (variance + beyond**2)
    return np.where(beyond <= 0.0, 1.0, share)
