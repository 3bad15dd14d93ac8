"""sRGB's transfer curve, IEC 61966-2-1, and the luminance of its primaries. GLSL twin: glsl/lib/srgb.glsl"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from glshadow.core.spaces import Array

LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
"""Of linear red, green and blue: ITU-R BT.709."""


def linear_from_srgb(value: ArrayLike) -> Array:
    """Linear values of sRGB values in 0..1, any shape."""
    x = np.asarray(value, dtype=np.float64)
    return np.where(x <= 0.04045, x / 12.92, ((np.maximum(x, 0.0) + 0.055) / 1.055) ** 2.4)


def srgb_from_linear(value: ArrayLike) -> Array:
    """sRGB values of linear values in 0..1, any shape."""
    x = np.asarray(value, dtype=np.float64)
    return np.where(x <= 0.0031308, 12.92 * x, 1.055 * np.maximum(x, 1e-12) ** (1.0 / 2.4) - 0.055)
