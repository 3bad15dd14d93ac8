"""BabylonEsm: Babylon.js's two exponential shadow maps."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Self

import numpy as np

from glshadow.core.setting import flag, number, setting
from glshadow.core.spaces import Array
from glshadow.shadows.filters.esm import MOST
from glshadow.shadows.filters.moments import MomentFilter


@dataclass(frozen=True)
class BabylonEsm(MomentFilter):
    """Babylon.js's ESM, blurred ESM, close ESM and blurred close ESM, for comparison; `Esm` follows the paper.

    The plain form darkens the casters themselves: 20 % of the courtyard's pixels. `close=True` is correct away from contacts.

    Parameters
    ----------
    radius : int
        0 to 16 texels. 0: not blurred. Babylon.js blurs with a box, `blurBoxOffset`, in a map that is smaller by `blurScale`.
    depth_scale : float
        1 to 87; Babylon.js's `depthScale`.
    close : bool
        Babylon.js's close ESM: exp(-depth_scale (metric - mean of stored metrics)). Otherwise 1 - exp(depth_scale metric) * mean of
        exp(-depth_scale stored metric), which is dark wherever the receiver itself is stored.

    References
    ----------
    Babylon.js 9.34, `shadowMapFragment` and `shadowsFragmentFunctions`; the tests compare with readings of Babylon.js itself.
    """

    depth_scale: float = setting(number(1.0, MOST), 50.0, help="exponent, 1 to 87")
    close: bool = setting(flag(), False)

    spelling = "babylonesm"
    snippet = "filter/babylonesm.glsl"
    encoding = "moments/babylonesm.glsl"
    channels = 1
    summary = "Babylon.js's exponential shadow maps; `close`: its close ESM"
    source = "Babylon.js"
    fails = "casters are dark themselves; close: light leaks near contacts and where blurring mixes depths"

    def defines(self) -> Mapping[str, int | str]:
        """Defines for radius, scale and form."""
        return {**super().defines(), "GLS_EXPONENT": repr(self.depth_scale), "GLS_CLOSE": int(self.close)}

    def encoded(self, depth: Array) -> Array:
        """exp(-k metric), or the metric."""
        return (depth if self.close else np.exp(-np.minimum(MOST, self.depth_scale * depth)))[:, None]

    def lit(self, depth: Array, means: Array, deviation: Array, extent: Array) -> Array:
        """Visibility as Babylon.js computes it."""
        metric, stored = np.clip(depth, 0.0, 1.0), means[:, 0]
        if self.close:
            return np.clip(np.exp(np.minimum(MOST, -self.depth_scale * (metric - stored))), 0.0, 1.0)
        return 1.0 - np.clip(np.exp(np.minimum(MOST, self.depth_scale * metric)) * stored, 0.0, 1.0)

    @classmethod
    def variants(cls) -> tuple[Self, ...]:
        """One filter of each form."""
        return (cls(), cls(close=True))

    @classmethod
    def studied(cls) -> tuple[Self, ...]:
        """The close form, which is correct away from contacts."""
        return (cls(close=True),)
