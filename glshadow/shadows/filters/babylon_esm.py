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
    """Babylon.js's ESM, blurred ESM, close ESM and blurred close ESM, to compare with: `Esm` is what the paper says.

    Its plain form darkens what casts: on the courtyard 20 % of the pixels. `close=True` is the form that is right away from contacts.

    Parameters
    ----------
    radius : int
        0 to 16 texels. 0: not blurred. Babylon.js blurs by a box, `blurBoxOffset`, in a map smaller by `blurScale`.
    depth_scale : float
        1 to 87; its `depthScale`.
    close : bool
        Its close ESM: exp(-depth_scale (metric - mean of stored metrics)). Else 1 - exp(depth_scale metric) * mean of exp(-depth_scale
        stored metric), which is dark wherever the receiver is what is stored.

    References
    ----------
    Babylon.js 9.34, `shadowMapFragment` and `shadowsFragmentFunctions`; readings of the real one are part of the tests.
    """

    depth_scale: float = setting(number(1.0, MOST), 50.0, help="1 to 87")
    close: bool = setting(flag(), False)

    spelling = "babylonesm"
    snippet = "filter/babylonesm.glsl"
    encoding = "moments/babylonesm.glsl"
    channels = 1
    summary = "Babylon.js's exponential maps; `close`: its other one"
    source = "Babylon.js"
    fails = "what casts is dark itself; close: light near contacts, and wherever blurred depth is no depth"

    def defines(self) -> Mapping[str, int | str]:
        """Radius, scale and form."""
        return {**super().defines(), "GLS_EXPONENT": repr(self.depth_scale), "GLS_CLOSE": int(self.close)}

    def encoded(self, depth: Array) -> Array:
        """exp(-k metric), or the metric."""
        return (depth if self.close else np.exp(-np.minimum(MOST, self.depth_scale * depth)))[:, None]

    def lit(self, depth: Array, means: Array, deviation: Array, extent: Array) -> Array:
        """As there."""
        metric, stored = np.clip(depth, 0.0, 1.0), means[:, 0]
        if self.close:
            return np.clip(np.exp(np.minimum(MOST, -self.depth_scale * (metric - stored))), 0.0, 1.0)
        return 1.0 - np.clip(np.exp(np.minimum(MOST, self.depth_scale * metric)) * stored, 0.0, 1.0)

    @classmethod
    def variants(cls) -> tuple[Self, ...]:
        """Both forms."""
        return (cls(), cls(close=True))

    @classmethod
    def studied(cls) -> tuple[Self, ...]:
        """The one that is right somewhere."""
        return (cls(close=True),)
