"""Msm: moment shadow maps."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Self

import numpy as np

from glshadow.core.setting import flag, setting
from glshadow.core.spaces import Array
from glshadow.shadows.filters.moments import BoundFilter

BIASES = {"f4": 3e-6, "nu2": 6e-5}
"""Share of a uniform distribution that is mixed in, by format, so that rounded moments stay valid (Peters, Klein 2015)."""


@dataclass(frozen=True)
class Msm(BoundFilter):
    """Moment shadow map: the least shadow that is consistent with four moments of the stored depths.

    Parameters
    ----------
    radius : int
        0 to 16: texels around the receiver that are averaged, (2 radius + 1)^2.
    bleeding : float
        0 to 1: share of the light that is removed to reduce light bleeding; the rest is rescaled.
    half : bool
        16 bits per moment instead of 32.
    hausdorff : bool
        Also require depths between near and far (the paper's Hausdorff problem): slightly more shadow. Otherwise the Hamburger problem.

    References
    ----------
    Peters, Klein 2015, "Moment Shadow Mapping", I3D.
    """

    hausdorff: bool = setting(flag(), False)

    spelling = "msm"
    snippet = "filter/msm.glsl"
    encoding = "moments/msm.glsl"
    channels = 4
    summary = "the least shadow consistent with four moments over a square"
    source = "Peters, Klein 2015"
    fails = "light bleeds where three depths meet; light near contacts"

    @property
    def precision(self) -> str:
        """16 bits normalised, or floats."""
        return "nu2" if self.half else "f4"

    def defines(self) -> Mapping[str, int | str]:
        """Defines for radius, problem and format."""
        more = {"GLS_HALF": int(self.half), "GLS_HAUSDORFF": int(self.hausdorff)}
        return {**super().defines(), **more, "GLS_MOMENT_BIAS": repr(BIASES[self.precision])}

    def encoded(self, depth: Array) -> Array:
        """Four powers of x from -1 to 1, plain or transformed for 16 bits."""
        x = 2.0 * depth - 1.0
        if not self.half:
            return np.stack([x, x**2, x**3, x**4], axis=-1)
        odd = (1.5 * x - 2.0 * x**3 + 0.5, np.sqrt(3.0) * (0.5 * x - 2.0 / 9.0 * x**3) + 0.5)
        return np.stack([*odd, 4.0 * (x**2 - x**4), 0.5 * (x**2 + x**4)], axis=-1)

    def lit(self, depth: Array, means: Array, deviation: Array, extent: Array) -> Array:
        """One minus the least share in front of the receiver, whose depth is reduced by the plane's deviation."""
        bias = BIASES[self.precision]
        moments = (1.0 - bias) * self._powers(means) + bias * np.array([0.0, 0.375, 0.0, 0.375])
        shadow = np.clip(least_before(moments, 2.0 * (depth - deviation) - 1.0, self.hausdorff), 0.0, 1.0)
        return self.unbled(1.0 - shadow)

    def _powers(self, means: Array) -> Array:
        if not self.half:
            return means
        odd = np.linalg.solve([[1.5, -2.0], [np.sqrt(0.75), -np.sqrt(12.0) / 9.0]], means[:, :2].T - 0.5)
        even = np.linalg.solve([[4.0, -4.0], [0.5, 0.5]], means[:, 2:].T)
        return np.stack([odd[0], even[0], odd[1], even[1]], axis=-1)

    @classmethod
    def variants(cls) -> tuple[Self, ...]:
        """Both problems, both formats."""
        return (cls(), cls(3, 0.1), cls(hausdorff=True), cls(half=True), cls(mip_maps=True))

    @classmethod
    def studied(cls) -> tuple[Self, ...]:
        """Both problems."""
        return (cls(), cls(hausdorff=True))


def least_before(moments: Array, x: Array, bounded: bool = False) -> Array:
    """The least share before x over all distributions with these moments.

    Parameters
    ----------
    moments : (N, 4) float64
        Means of the first four powers.
    x : (N,) float64
    bounded : bool
        Restrict to distributions on -1 to 1.

    References
    ----------
    Peters, Klein 2015: the extreme distribution has x and two more depths, roots of the orthogonal polynomials' kernel. If one of them is
    beyond an end, it has x, one more and both ends. Markov, Krein, Nudel'man 1977.
    """
    b1, b2, b3, b4 = moments.T
    hankel = np.stack(
        [np.stack([np.ones_like(b1), b1, b2], -1), np.stack([b1, b2, b3], -1), np.stack([b2, b3, b4], -1)], axis=-2
    )
    powers = np.stack([np.ones_like(x), x, x * x], axis=-1)
    c1, c2, c3 = np.linalg.solve(hankel, powers[..., None])[..., 0].T
    middle = -0.5 * c2 / c3
    root = np.sqrt(np.maximum(middle**2 - c1 / c3, 0.0))
    first, last = middle - root, middle + root
    with np.errstate(divide="ignore", invalid="ignore"):
        own = (first * last - b1 * (first + last) + b2) / ((x - first) * (x - last))
        before = (x * last - b1 * (x + last) + b2) / ((first - x) * (first - last))
        share = np.where(last < x, 1.0 - own, np.where(first < x, before, 0.0))
        if not bounded:
            return np.asarray(share)
        inner = (b1 - b3) - x * (1.0 - b2)
        other = ((b2 - b4) - x * (b1 - b3)) / inner
        total, product = x + other, x * other
        end = (b2 - total * b1 + product - b3 + total * b2 - product * b1) / (2.0 * (1.0 + x) * (1.0 + other))
        more = np.where(other < x, inner / ((1.0 - other**2) * (other - x)), 0.0)
    return np.where((first < -1.0) | (last > 1.0), end + more, share)
