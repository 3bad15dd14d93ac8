"""Filters: how many texels answer for one receiver, and with which weights."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from glshadow.core.spaces import Array
from glshadow.errors import SettingsError

MAX_RADIUS = 4


@dataclass(frozen=True)
class Hard:
    """One nearest texel, lit or not."""

    radius = 0

    @property
    def slack_texels(self) -> float:
        """How far, in texels per axis, the map's sample may lie from where the plane is evaluated."""
        return 0.5

    @property
    def reach_texels(self) -> float:
        """How far from the receiver's own position the filter reads, in texels per axis."""
        return 0.5


@dataclass(frozen=True)
class Pcf:
    """Percentage closer filtering: the mean of (2 radius + 1)^2 bilinear comparisons, a texel apart.

    radius 0 is the hardware's 2 x 2 comparison (Luna's four taps); 1 the default.

    References
    ----------
    Reeves, Salesin, Cook 1987, "Rendering Antialiased Shadows with Depth Maps", SIGGRAPH.
    """

    radius: int = 1

    def __post_init__(self) -> None:
        radius = self.radius
        if isinstance(radius, bool) or not isinstance(radius, int) or not 0 <= radius <= MAX_RADIUS:
            raise SettingsError(f"filter radius must be an integer in [0, {MAX_RADIUS}] texels, got {self.radius!r}")

    @property
    def slack_texels(self) -> float:
        """One texel: a bilinear comparison reads texel centres up to one texel from where the plane is evaluated."""
        return 1.0

    @property
    def reach_texels(self) -> float:
        """The bilinear footprint of the outermost tap."""
        return self.radius + 1.0


SAMPLES = (1, 4, 8, 16)


@dataclass(frozen=True)
class Exact:
    """No map: each receiver asks the triangles themselves, sorted by where they lie seen from the light. Needs no bias.

    Exact hard shadows where OpenGL 4.3 is; elsewhere the triangles nearest in a map of their numbers are asked, which misses those
    that no texel saw (`Used.fallbacks` says so).

    Parameters
    ----------
    samples : int
        1, 4, 8 or 16 points in each pixel near a shadow's edge.

    References
    ----------
    Wyman, Hoetzlein, Lefohn 2015, "Frustum-Traced Raster Shadows: Revisiting Irregular Z-Buffers", I3D; Story 2015, "Hybrid
    Ray-Traced Shadows", GDC.
    """

    samples: int = 1

    radius = 0

    def __post_init__(self) -> None:
        if isinstance(self.samples, bool) or self.samples not in SAMPLES:
            raise SettingsError(f"Exact samples must be one of {', '.join(map(str, SAMPLES))}, got {self.samples!r}")

    @property
    def slack_texels(self) -> float:
        """Nothing depends on texels."""
        return 0.0

    @property
    def reach_texels(self) -> float:
        """Texels of the map of numbers that the fallback reads to each side."""
        return 2.0


def sample_offsets(samples: int) -> Array:
    """Where in a pixel Exact's points lie: (samples, 2) from its middle, right and up, in pixels.

    16: a 4 x 4 grid. 4 and 8: one point in each row and column of a 4 x 4 or 8 x 8 grid.
    """
    if samples == 16:
        steps = (np.arange(4) + 0.5) / 4.0 - 0.5
        return np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2)
    columns = {1: (0,), 4: (1, 3, 0, 2), 8: (2, 5, 7, 1, 4, 0, 6, 3)}[samples]
    return np.stack([np.asarray(columns), np.arange(samples)], axis=-1) / samples + 0.5 / samples - 0.5


Filter = Hard | Pcf | Exact


def box_weights(fraction: ArrayLike, radius: int) -> Array:
    """Weights of the 2 radius + 2 texels that a row of bilinear taps reads; sum 1.

    Parameters
    ----------
    fraction : (...) array_like
        Position of the receiver between the centres of its two nearest texels, in [0, 1).

    Returns
    -------
    (..., 2 radius + 2) float64
        1 - f, 1, ..., 1, f over 2 radius + 1: bilinear taps a texel apart overlap to a box with ramps at its ends.
    """
    f = np.asarray(fraction, dtype=np.float64)
    weights = np.ones((*f.shape, 2 * radius + 2))
    weights[..., 0] = 1.0 - f
    weights[..., -1] = f
    return np.asarray(weights / (2 * radius + 1))


def pcf(lit: ArrayLike, position_texels: ArrayLike, radius: int) -> Array:
    """Percentage closer filter of a comparison image.

    Parameters
    ----------
    lit : (H, W) array_like
        Outcome of the comparison at each texel, 1 = lit; row 0 is v = 0.
    position_texels : (N, 2) array_like
        Receivers (x, y) in texels from the map's corner: (0.5, 0.5) is the centre of texel [0, 0].

    Returns
    -------
    (N,) float64
        Visibility. Texels outside the image count as the nearest one inside.
    """
    image = np.asarray(lit, dtype=np.float64)
    position = np.asarray(position_texels, dtype=np.float64) - 0.5
    base = np.floor(position).astype(np.int64)
    weights = box_weights(position - base, radius)
    taps = np.arange(-radius, radius + 2)
    x = np.clip(base[:, 0, None] + taps, 0, image.shape[1] - 1)
    y = np.clip(base[:, 1, None] + taps, 0, image.shape[0] - 1)
    window = image[y[:, :, None], x[:, None, :]]
    x_weights, y_weights = weights[:, 0], weights[:, 1]
    seen, whole = (np.einsum("nj,ni,nji->n", y_weights, x_weights, part) for part in (window, np.ones_like(window)))
    return np.asarray(seen / whole)  # the same sum in the same order: the lit plateau is 1 to the last bit
