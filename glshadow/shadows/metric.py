"""What a shadow map stores: window depth or the depth metric, its format and its quantum.

The metric grows away from the light in every clip convention::

    orthographic, perspective    (s z + min_z) / (min_z + max_z)      z = clip z before the division, s = -1 if reversed
    cube                         (distance + near) / (near + far)

and above 1 it is clamped, since packed values would wrap.

References
----------
Babylon.js documentation, "Mathematics of the depth metric when generating shadow maps", summary table.
GLSL twins: glsl/metric/*.glsl, glsl/lib/packing.glsl
"""

from __future__ import annotations

from enum import Enum

import numpy as np
from numpy.typing import ArrayLike

from glshadow.core.spaces import Array, ClipSpace
from glshadow.errors import SettingsError


class Target(Enum):
    """Format of a shadow map: a depth texture (window depth) or a colour target (depth metric)."""

    DEPTH16 = "depth16"
    DEPTH24 = "depth24"
    DEPTH32F = "depth32f"
    R32F = "r32f"
    R16F = "r16f"
    R8 = "r8"
    RGBA8 = "rgba8"

    @property
    def is_depth(self) -> bool:
        """Whether it is a depth texture, read by a comparison sampler."""
        return self in (Target.DEPTH16, Target.DEPTH24, Target.DEPTH32F)

    @property
    def quantum(self) -> float:
        """Largest step between neighbouring stored values in 0..1.

        UNORM: 1 / (2^bits - 1). Floats: one ulp just below 1. RGBA8 packs four bytes, but a float32 shader feeds them.
        """
        return {
            Target.DEPTH16: 1.0 / 65535.0,
            Target.DEPTH24: 1.0 / 16777215.0,
            Target.DEPTH32F: 2.0**-24,
            Target.R32F: 2.0**-24,
            Target.R16F: 2.0**-11,
            Target.R8: 1.0 / 255.0,
            Target.RGBA8: 2.0**-23,
        }[self]


def metric_range(projection: str, clip: ClipSpace, near: float, far: float) -> tuple[float, float]:
    """(min_z, max_z) of the metric for views of a `projection`: "orthographic", "perspective" or "cube".

    Raises
    ------
    SettingsError
        For an unknown projection, and in perspective with near = 0 in 0..1 reversed, where the metric would be 0 / 0.
    """
    if projection == "orthographic":
        return ((0.0, 1.0), (1.0, 0.0))[clip.reversed] if clip.zero_to_one else (1.0, 1.0)
    if projection == "cube" or (projection == "perspective" and not clip.zero_to_one):
        return near, far
    if projection != "perspective":
        raise SettingsError(f'projection must be "orthographic", "perspective" or "cube", got {projection!r}')
    if not clip.reversed:
        return 0.0, far
    if near == 0.0:
        raise SettingsError("the 0..1 reversed metric in perspective needs near > 0, got near=0")
    return near, 0.0


def projected_metric(clip_z: ArrayLike, clip: ClipSpace, min_z: float, max_z: float) -> Array:
    """Metric of orthographic and perspective views from clip z before the division; any shape, 0..1 between near and far."""
    return np.asarray((clip.sign * np.asarray(clip_z, dtype=np.float64) + min_z) / (min_z + max_z))


def radial_metric(distance: ArrayLike, near: float, far: float) -> Array:
    """Metric of cubes from the distance to the light; any shape, 1 at far."""
    return np.asarray((np.asarray(distance, dtype=np.float64) + near) / (near + far))


def pack(metric: ArrayLike) -> Array:
    """Metric as four bytes (..., 4) in 0..1, the last one the coarsest; clamped to [0, 1 - 2^-24]: 1 would wrap to 0.

    References
    ----------
    The inverse of `unpack`; digits to base 255, so that each is exact in UNORM8. GLSL twin: glsl/lib/packing.glsl
    """
    value = np.clip(np.asarray(metric, dtype=np.float64), 0.0, 1.0 - 2.0**-24)[..., None]
    digits = value * np.array([255.0**3, 255.0**2, 255.0, 1.0])
    fraction = digits - np.floor(digits)
    fraction[..., 1:] -= fraction[..., :-1] / 255.0  # already held by the finer digits
    return np.asarray(fraction)


def unpack(packed: ArrayLike) -> Array:
    """Metric from four bytes (..., 4) given in 0..1: dot with 255^(-3, -2, -1, 0)."""
    return np.asarray(np.asarray(packed, dtype=np.float64) @ np.array([255.0**-3, 255.0**-2, 1 / 255.0, 1.0]))


def window_depth(clip_zw: ArrayLike, clip: ClipSpace) -> Array:
    """Window depth from clip (..., 2) = (z, w)."""
    zw = np.asarray(clip_zw, dtype=np.float64)
    ndc = zw[..., 0] / zw[..., 1]
    return np.asarray(ndc if clip.zero_to_one else 0.5 * ndc + 0.5)
