"""Poisson: percentage closer filtering at a few scattered places."""

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
    """The mean of four nearest comparisons at scattered places: a Poisson disc of four points.

    Parameters
    ----------
    radius_texels : float
        0.5 to 16. 1 is Babylon.js's.
    rotate : bool
        Turn the four from pixel to pixel: noise instead of four copies of each edge.

    References
    ----------
    Cook 1986, "Stochastic Sampling in Computer Graphics"; the places are those of Babylon.js. Rotation as in `Disc`.
    """

    radius_texels: float = setting(number(0.5, 16.0, unit="texels"), 1.0, help="0.5 to 16")
    rotate: bool = setting(flag(), False)

    spelling = "poisson"
    needs = Needs.COMPARISON
    snippet = "filter/poisson.glsl"
    summary = "mean over four nearest comparisons, scattered"
    source = "Cook 1986, Babylon.js"
    fails = "five greys: steps along every edge, noise where the four are turned"

    @property
    def radius(self) -> float:
        """The farthest of the four."""
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
        """Radius and rotation."""
        return {"GLS_POISSON_RADIUS": repr(self.radius_texels), "GLS_POISSON_ROTATE": int(self.rotate)}

    def visibility(self, position: Array, compare: Compare) -> Array:
        """The mean, not rotated."""

        def terms() -> Iterator[tuple[Array, NDArray[np.int64], Array]]:
            for offset in PLACES * self.radius_texels:
                texel = np.floor(position + offset)
                yield np.full(len(position), 0.25), texel.astype(np.int64), texel + 0.5 - position

        return weighted(compare, terms())

    @classmethod
    def variants(cls) -> tuple[Self, ...]:
        """Both ways."""
        return (cls(), cls(3.0), cls(rotate=True))
