"""Look: ambient light, background, antialiasing, exposure and tone map of an image."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from glshadow.core.sampling import IMAGE_SAMPLES
from glshadow.core.setting import Rule, as_float, optional, vector
from glshadow.core.spaces import Array
from glshadow.core.srgb import linear_from_srgb, srgb_from_linear
from glshadow.core.tone import EXPOSURE, TONE, Exposure, displayed
from glshadow.lights.light import BRIGHTEST

Ambient = float | ArrayLike | Sequence[ArrayLike]
"""One number or a linear colour; or a pair of these, from above and from below."""

# Chosen by eye on twelve models: shaded sides keep their shape, white does not burn out under one directional light, shadows stay dark
# enough to be read, and the background is darker than a lit white ground and lighter than any shadow.
AMBIENT = (0.27, 0.12)
BACKGROUND = (0.81, 0.82, 0.84)
WHITE = 0.8
"""The light on surfaces that face it which the default ambient light suits, and which is shown as it is: a scene's default light."""

_AMBIENT, _BACKGROUND = vector(3, 0.0, BRIGHTEST), optional(vector(3, 0.0, 1.0), "transparent")


@dataclass(frozen=True, eq=False)
class Look:
    """Ambient light, background, samples, exposure and tone map, checked.

    Parameters
    ----------
    ambient : (2, 3) float64
        Linear, from above and from below.
    background : (3,) floats or None
        sRGB; None: transparent.
    samples : int
        Per pixel.
    exposure : "scene", "auto", float or None
        As given.
    tone : str
        One of `core.tone.TONES`.
    own_ambient : bool
        Whether the ambient light was given, rather than the default.
    white : float
        What the image's ambient light and emission are multiplied by, so that they suit its lights: see `metered`.
    scale : float
        What linear light is multiplied by before the tone map.
    """

    ambient: Array
    background: tuple[float, float, float] | None
    samples: int
    exposure: Exposure = None
    tone: str = "none"
    own_ambient: bool = True
    white: float = 1.0
    scale: float = 1.0

    @property
    def linear_background(self) -> Array:
        """(3,) linear; black if transparent."""
        return np.zeros(3) if self.background is None else linear_from_srgb(self.background)

    @property
    def ev(self) -> float:
        """The exposure that was used, in stops: the base 2 logarithm of `scale`."""
        return math.log2(self.scale)

    def metered(self, level: float | None) -> Look:
        """The look for lights of some level: see `derive.exposure`. None: their intensities are relative to white, and stay as they are."""
        white = 1.0 if not level else level / WHITE
        if abs(white - 1.0) < 1e-9:  # rounding of float64
            white = 1.0
        stops = 0.0 if self.exposure is None else self.exposure
        scale = 1.0 / white if isinstance(stops, str) else 2.0**stops
        return replace(
            self, ambient=self.ambient if self.own_ambient else self.ambient * white, white=white, scale=scale
        )

    def encoded(self, light: ArrayLike) -> NDArray[np.uint8]:
        """The image (..., 3 or 4) of linear means with alpha (..., 4): sRGB, and straight alpha if the background is transparent."""
        light = np.asarray(light)
        background = None if self.background is None else self.linear_background
        display = srgb_from_linear(np.clip(displayed(light, background, self.scale, self.tone), 0.0, 1.0))
        if background is None:
            display = np.concatenate([display, np.clip(light[..., 3:], 0.0, 1.0)], axis=-1)
        return np.rint(255.0 * display).astype(np.uint8)


def look_of(ambient: Any, background: Any, samples: Any, exposure: Any = None, tone: Any = "none") -> Look:
    """Checks the look that `Renderer.render` is given; an ambient light of None is the default.

    Raises
    ------
    SettingsError
        If one of the settings is invalid.
    """
    own = ambient is not None
    ambient = ambient if own else AMBIENT
    several = isinstance(ambient, tuple | list) or (isinstance(ambient, np.ndarray) and ambient.ndim > 0)
    pair = ambient if several and len(ambient) == 2 else (ambient, ambient)
    both = np.array([_rgb(_AMBIENT, "ambient", each) for each in pair])
    return Look(
        both, _rgb(_BACKGROUND, "background", background), IMAGE_SAMPLES("samples", samples),
        EXPOSURE("exposure", exposure), TONE("tone", tone), own,
    )  # fmt: skip


def _rgb(rule: Rule, name: str, value: Any) -> Any:
    """One number for all three colour channels, or one each."""
    one = as_float(value)
    return rule(name, value if math.isnan(one) else (one, one, one))
