"""MomentFilter: base of the prefiltered shadow maps, which store means of functions of depth over a square of texels."""

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
"""Mip maps above level 0: as many as its guard band keeps free of neighbouring tiles."""

FLOAT_ROUNDING = 2.0**-22
"""Relative error of a stored mean: a few float32 roundings, its own and those of the sums that made it."""

HALF_ROUNDING = 2.0**-9
"""The same for float16, to which each pass rounds; llvmpipe rounds down."""


@dataclass(frozen=True)
class MomentFilter(StudiedFilter):
    """Base of prefiltered (moment) shadow map filters.

    Attributes
    ----------
    encoding : str
        GLSL file for the slot <encoding> of pass/moments.frag.
    """

    radius: int = setting(
        whole(0, MAX_RADIUS, unit="texels"), 1, help=f"0 to {MAX_RADIUS}: radius of the square, (2 RADIUS + 1)^2"
    )

    _: KW_ONLY
    mip_maps: bool = setting(flag(), False, help="mip maps, which filter pixels larger than a texel: stable from afar")

    needs = Needs.MOMENTS
    encoding: ClassVar[str] = ""

    @property
    def reach_texels(self) -> float:
        """The hardware's bilinear filter reads means of a square next to the receiver."""
        return self.radius + 1.0 + (1.5 * (2.0**MIP_LEVELS - 1.0) if self.mip_maps else 0.0)

    @property
    def precision(self) -> str:
        """The texture format as moderngl names it."""
        return "f4"

    def defines(self) -> Mapping[str, int | str]:
        """Defines for radius and mip maps."""
        return {"GLS_MOMENT_RADIUS": self.radius, "GLS_MIP_LEVELS": MIP_LEVELS if self.mip_maps else 0}

    def encoded(self, depth: Array) -> Array:
        """What a map stores (N, components) for depths (N,) from 0 at near to 1 at far; the float64 twin of <encoding>."""
        raise NotImplementedError

    def lit(self, depth: Array, means: Array, deviation: Array, extent: Array) -> Array:
        """Visibility of receivers; the float64 twin of <filter>.

        Parameters
        ----------
        depth : (N,) float64
            Depth of receivers.
        means : (N, components) float64
            Means of what is stored around them.
        deviation, extent : (N,) float64
            Spread of the receiver plane's own depth over the kernel: standard deviation, and largest difference.
        """
        raise NotImplementedError

    @classmethod
    def variants(cls) -> tuple[Self, ...]:
        """One filter for each variant of the shader."""
        return (cls(),)


@dataclass(frozen=True)
class BoundFilter(MomentFilter):
    """Base of filters that use a bound. Light bleeds; a setting reduces that."""

    bleeding: float = setting(
        number(0.0, 1.0, below=True), 0.0, help="0 to 1: share of light removed to reduce light bleeding"
    )
    half: bool = setting(flag(), False)

    def defines(self) -> Mapping[str, int | str]:
        """Defines of a moment filter, with the light bleeding reduction."""
        return {**super().defines(), "GLS_BLEEDING": repr(self.bleeding)}

    def unbled(self, share: Array) -> Array:
        """Share of light after light bleeding reduction: the rest is rescaled to 0..1."""
        return np.asarray(np.clip((share - self.bleeding) / (1.0 - self.bleeding), 0.0, 1.0))


def spread(radius: int, slope: Array) -> tuple[Array, Array]:
    """(deviation, extent) of a plane's depth over the kernel; `slope` (N, 2): its gradient per texel. Twin of lib/plane_spread.glsl."""
    width = 2 * radius + 1
    deviation = np.linalg.norm(slope, axis=-1) * np.sqrt((width**2 - 1) / 12.0 + 0.25)
    return np.asarray(deviation), np.asarray(np.abs(slope).sum(axis=-1) * (radius + 1))


def chebyshev(mean: Array, square: Array, x: Any, least_variance: Any) -> Array:
    """Chebyshev's bound: the largest share at or beyond x for a given mean and mean square."""
    beyond = x - mean
    variance = np.maximum(square - mean**2, least_variance)
    share = variance / (variance + beyond**2)
    return np.where(beyond <= 0.0, 1.0, share)
