"""Tolerances by kind of test, and their reasons."""

from __future__ import annotations

from .model import Precision

UNIT = 2.0**-24
"""Relative rounding of one float32 operation."""

RTOL_FLOAT64 = 1e-12
"""Closed forms in float64: a few thousand roundings of 2^-53."""

WEIGHT = 1e-6
"""Weights of a filter are float32 products of a position in texels: 16 roundings. Hardware filtering: 1 / 256."""

POSITION_ROUNDINGS = 16.0
"""Roundings from pixel to light view: ray x depth, plus the eye, back on the plane, one matrix product."""

PICTURE_CHANNELS = 1
"""Two ways to compute the same image may round an 8-bit channel to either side."""

PICTURE_SHARE = 1e-3
"""Share of pixels that may differ more: where vertices are rounded differently, edges move over pixel centres."""


def depth_tolerance(texels: int, perspective: bool) -> float:
    """Stored and compared depths of a map `texels` wide, in stored units.

    A depth is interpolated over the map from vertices that are rounded to UNIT and moved by a fraction of a texel: the
    error grows with the number of texels that one interpolation spans; under perspective the division by w enters too.
    """
    return (16.0 if perspective else 4.0) * texels * UNIT


def precision(texels: int, perspective: bool, reach: float) -> Precision:
    """Error bounds that the float64 twin grants llvmpipe, for a scene of size `reach` in world units."""
    return Precision(
        stored=depth_tolerance(texels, perspective),
        texels=depth_tolerance(texels, perspective) * texels,
        world=POSITION_ROUNDINGS * UNIT * reach,
    )


PATIENCE_S = 900.0
"""How long a test waits for what another process or thread does, before it says that this hangs. A test that passes waits for the event
alone; where ten processes share two processors, that comes after a minute or two."""
