"""Look: ambient light, background and antialiasing of an image."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from glshadow.core.sampling import IMAGE_SAMPLES
from glshadow.core.setting import Rule, as_float, optional, vector
from glshadow.core.spaces import Array
from glshadow.core.srgb import linear_from_srgb
from glshadow.lights.light import BRIGHTEST

Ambient = float | ArrayLike | Sequence[ArrayLike]
"""One number or a linear colour; or a pair of these, from above and from below."""

OWN_BACKGROUND = "look"
"""In place of a background: that of the scene's look."""

_AMBIENT, _BACKGROUND = vector(3, 0.0, BRIGHTEST), optional(vector(3, 0.0, 1.0), "transparent")


@dataclass(frozen=True, eq=False)
class Look:
    """Ambient light, background and samples, checked.

    Parameters
    ----------
    ambient : (2, 3) float64
        Linear, from above and from below.
    background : (3,) floats or None
        sRGB; None: transparent.
    samples : int
        Per pixel.
    """

    ambient: Array
    background: tuple[float, float, float] | None
    samples: int

    @property
    def linear_background(self) -> Array:
        """(3,) linear; black if transparent."""
        return np.zeros(3) if self.background is None else linear_from_srgb(self.background)


def background_rule(name: str, value: Any) -> Any:
    """Check a background: sRGB, None for a transparent one, or "look"."""
    return value if isinstance(value, str) and value == OWN_BACKGROUND else _rgb(_BACKGROUND, name, value)


def look_of(ambient: Any, background: Any, samples: Any, own_ambient: Any = 0.0, own_background: Any = None) -> Look:
    """Checks the look that `Renderer.render` is given; the scene's own ambient light and background are in place of what is left out.

    Raises
    ------
    SettingsError
        If one of the settings is invalid.
    """
    ambient = own_ambient if ambient is None else ambient
    background = background_rule("background", background)
    several = isinstance(ambient, tuple | list) or (isinstance(ambient, np.ndarray) and ambient.ndim > 0)
    pair = ambient if several and len(ambient) == 2 else (ambient, ambient)
    both = np.array([_rgb(_AMBIENT, "ambient", each) for each in pair])
    background = own_background if background == OWN_BACKGROUND else background
    return Look(both, background, IMAGE_SAMPLES("samples", samples))


def _rgb(rule: Rule, name: str, value: Any) -> Any:
    """One number for all three colour channels, or one each."""
    one = as_float(value)
    return rule(name, value if math.isnan(one) else (one, one, one))
