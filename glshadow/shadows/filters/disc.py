"""Disc: percentage closer filtering over a disc."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from glshadow.core.sample_patterns import disc
from glshadow.core.setting import flag, number, setting, whole
from glshadow.core.spaces import Array
from glshadow.shadows.filters.filter import Compare, Filter, Needs, weighted

GOLDEN_ANGLE = 2.399963229728653  # pi (3 - sqrt 5)
MAX_TAPS = 64


@dataclass(frozen=True)
class Disc(Filter):
    """The mean of bilinear comparisons on a spiral that fills a disc evenly.

    Parameters
    ----------
    radius_texels : float
        0.5 to 16.
    taps : int
        8 to 64.
    rotate : bool
        Rotate the spiral from pixel to pixel: noise instead of the faint rings of few taps.

    References
    ----------
    Vogel 1979, "A Better Way to Construct the Sunflower Head", Mathematical Biosciences 44: tap i of n at sqrt((i + 1/2) / n), turned
    by i golden angles. Castano 2013, "Shadow Mapping Summary", The Witness: bilinear comparisons as taps. Rotation: interleaved
    gradient noise, Jimenez 2014, "Next Generation Post Processing in Call of Duty: Advanced Warfare", SIGGRAPH course.
    """

    radius_texels: float = setting(number(0.5, 16.0, unit="texels"), 2.0, help="radius in texels, 0.5 to 16")
    taps: int = setting(whole(8, MAX_TAPS), 16, help=f"comparisons, 8 to {MAX_TAPS}")
    rotate: bool = setting(flag(), False)

    spelling = "disc"
    needs = Needs.COMPARISON
    snippet = "filter/disc.glsl"
    summary = "mean over TAPS comparisons in a disc"
    source = "Vogel 1979, Castano 2013"
    fails = "edges widen to 2 RADIUS_TEXELS + 1 texels; rings with few taps, noise if rotated"

    @property
    def radius(self) -> float:
        """The disc's radius in texels."""
        return self.radius_texels

    @property
    def slack_texels(self) -> float:
        """One texel: each tap is bilinear."""
        return 1.0

    @property
    def reach_texels(self) -> float:
        """The bilinear footprint of the outermost tap."""
        return self.radius_texels + 1.0

    def defines(self) -> Mapping[str, int | str]:
        """Defines for radius, taps and rotation."""
        return {
            "GLS_DISC_RADIUS": repr(self.radius_texels),
            "GLS_DISC_TAPS": self.taps,
            "GLS_DISC_ROTATE": int(self.rotate),
        }

    def visibility(self, position: Array, compare: Compare) -> Array:
        """The mean without rotation; the plane is evaluated in the middle of each tap's 2 x 2 texels."""

        def terms() -> Iterator[tuple[Array, NDArray[np.int64], Array]]:
            for offset in disc(self.taps) * self.radius_texels:
                base = np.floor(position + offset - 0.5)
                fraction = position + offset - 0.5 - base
                for corner in np.ndindex(2, 2):
                    weights = np.where(corner, fraction, 1.0 - fraction).prod(axis=1) / self.taps
                    yield weights, (base + corner).astype(np.int64), base + 1.0 - position

        return weighted(compare, terms())

    @classmethod
    def variants(cls) -> tuple[Self, ...]:
        """With and without rotation, with few taps and many."""
        return (cls(), cls(0.5, 8), cls(3.0, MAX_TAPS), cls(rotate=True))

    @classmethod
    def extremes(cls) -> tuple[Self, ...]:
        """The default, and a disc of the largest box filter's size with as many taps."""
        return (cls(), cls(4.0, MAX_TAPS))
