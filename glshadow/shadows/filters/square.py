"""SquareFilter: base of filters that compare bilinearly over a square, taps a texel apart."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from glshadow.core.spaces import Array
from glshadow.shadows.filters.filter import Compare, Filter, Needs, weighted


class SquareFilter(Filter):
    """Base of square filters; a subclass has a field `radius`, the taps on each side of the middle one."""

    needs = Needs.COMPARISON

    @property
    def slack_texels(self) -> float:
        """One texel: a bilinear comparison reads texel centres up to one texel from where the plane is evaluated."""
        return 1.0

    @property
    def reach_texels(self) -> float:
        """The bilinear footprint of the outermost tap."""
        return self.radius + 1.0

    @abstractmethod
    def weights(self, fraction: Array) -> Array:
        """Weights of the 2 radius + 2 texels that a row of taps reads; sum 1.

        Parameters
        ----------
        fraction : (...) float64
            Position of the receiver between the centres of its two nearest texels, in [0, 1).

        Returns
        -------
        (..., 2 radius + 2) float64
        """

    def visibility(self, position: Array, compare: Compare) -> Array:
        """The weighted mean; the plane is evaluated once per block of 2 x 2 texels, in its middle."""
        base = np.floor(position - 0.5)
        weights = self.weights(position - 0.5 - base)
        radius = int(self.radius)

        def terms() -> Iterator[tuple[Array, NDArray[np.int64], Array]]:
            for j in range(2 * radius + 2):
                for i in range(2 * radius + 2):
                    tap = base + np.array([i, j]) - radius
                    block = tap - np.array([i, j]) % 2 + 1.0 - position
                    yield weights[:, 0, i] * weights[:, 1, j], tap.astype(np.int64), block

        return weighted(compare, terms())
