"""Poisson: percentage closer filtering at a few scattered positions."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from glshadow.core.setting import flag, number, setting
from glshadow.core.spaces import Array
from glshadow.shadows.filters.filter import Compare, Needs, StudiedFilter, weighted

PLACES = np.array(
    [(-0.94201624, -0.39906216), (0.94558609, -0.76890725), (-0.094184101, -0.92938870), (0.34495938, 0.29387760)]
)


@dataclass(frozen=True)
class Poisson(StudiedFilter):
    """The mean of four nearest comparisons at scattered positions: a Poisson disc of four points.

    Parameters
    ----------
    radius_texels : float
        0.5 to 16. Babylon.js uses 1.
    rotate : bool
        Rotate the four from pixel to pixel: noise instead of four copies of each edge.

    References
    ----------
    Cook 1986, "Stochastic Sampling in Computer Graphics"; the positions are those of Babylon.js. Rotation as in `Disc`.
    """

    radius_texels: float = setting(number(0.5, 16.0, unit="texels"), 1.0, help="radius in texels, 0.5 to 16")
    rotate: bool = setting(flag(), False)

    spelling = "poisson"
    needs = Needs.COMPARISON
    snippet = "filter/poisson.glsl"
    summary = "mean over four nearest comparisons, scattered"
    source = "Cook 1986, Babylon.js"
    fails = "five grey levels: steps along every edge, noise if rotated"

    @property
    def radius(self) -> float:
        """Distance of the farthest of the four positions."""
        return 1.22 * self.radius_texels

    @property
    def slack_texels(self) -> float:
        """Half a texel: each tap is nearest."""
        return 0.5

    @property
    def reach_texels(self) -> float:
        """The centre of the outermost texel."""
        return 1.22 * self.radius_texels + 0.5

    def defines(self) -> Mapping[str, int | str]:
        """Defines for radius and rotation."""
        return {"GLS_POISSON_RADIUS": repr(self.radius_texels), "GLS_POISSON_ROTATE": int(self.rotate)}

    def visibility(self, position: Array, compare: Compare) -> Array:
        """The mean without rotation."""

        def terms() -> Iterator[tuple[Array, NDArray[np.int64], Array]]:
            for offset in PLACES * self.radius_texels:
                texel = np.floor(position + offset)
                yield np.full(len(position), 0.25), texel.astype(np.int64), texel + 0.5 - position

        return weighted(compare, terms())

    @classmethod
    def variants(cls) -> tuple[Self, ...]:
        """With and without rotation."""
        return (cls(), cls(3.0), cls(rotate=True))
