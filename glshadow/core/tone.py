"""Exposure and tone map: bring linear light into the range of a display. GLSL twin: glsl/lib/tone.glsl"""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from glshadow.core.setting import as_float, one_of, refuse
from glshadow.core.spaces import Array

Exposure = Literal["scene", "auto"] | float | None
"""How the light of an image is scaled: see `Renderer.render`."""
MOST_EV = 64.0

TONES = ("neutral", "none")
"""Names of the tone maps; none: values above 1 are clipped."""
TONE = one_of(*TONES)

START = 0.8
"""Colours whose largest channel is at most this stay as they are."""
DESATURATION = 0.15
"""How fast brighter colours lose their saturation."""


def EXPOSURE(name: str, value: Any) -> Exposure:
    """Rule: an exposure."""
    if value is None:
        return None
    if isinstance(value, str) and value in ("scene", "auto"):
        return "scene" if value == "scene" else "auto"
    stops = as_float(value)
    if not -MOST_EV <= stops <= MOST_EV:
        raise refuse(name, f'"scene", "auto", None or a number of stops in [-{MOST_EV:g}, {MOST_EV:g}]', value)
    return stops


def neutral(linear: ArrayLike) -> Array:
    """Khronos PBR Neutral, without its term for reflections: colours (..., 3) of any brightness in 0..1.

    The specification is KhronosGroup/ToneMapping, PBR_Neutral/README.md, with K_s = 0.8 - F_90 and K_d = 0.15. Its F_90, 0.04, which it
    subtracts from every colour, makes up for what a dielectric reflects of white surroundings. Here it is 0, since ambient light is not
    reflected: a colour up to 0.8 stays as it is.
    """
    color = np.asarray(linear, dtype=np.float64)
    peak = color.max(axis=-1, keepdims=True)
    over = np.maximum(peak, START)
    top = 1.0 - (1.0 - START) ** 2 / (over + 1.0 - 2.0 * START)
    grey = 1.0 - 1.0 / (DESATURATION * (over - top) + 1.0)
    return np.where(peak <= START, color, color * (top / over) * (1.0 - grey) + top * grey)


def displayed(light: ArrayLike, background: Array | None, scale: float = 1.0, tone: str = "none") -> Array:
    """Linear values for a display of linear light: surfaces are scaled and tone mapped, the background is unchanged.

    Parameters
    ----------
    light : (..., 4)
        Means of linear light with alpha: over the background, or premultiplied if there is none.
    background : (3,) float64 or None
        Linear display values.
    scale : float
        Factor of the light.
    tone : str
        One of `TONES`.

    Returns
    -------
    (..., 3) float64
        Over the background, or straight if there is none; not clipped.
    """
    mean = np.asarray(light, dtype=np.float64)
    color, alpha = mean[..., :3], mean[..., 3:]
    plain = scale == 1.0 and tone == "none"
    if background is not None and plain:
        return color
    behind = 0.0 if background is None else background * (1.0 - alpha)
    straight = scale * (color - behind) / np.maximum(alpha, 1e-6)
    shown = neutral(straight) if tone == "neutral" else straight
    if background is None:
        return shown
    unchanged = (straight.max(axis=-1, keepdims=True) <= START) & (
        scale == 1.0
    )  # to the bit what it is without a tone map
    return np.where(unchanged, color, alpha * shown + behind)
