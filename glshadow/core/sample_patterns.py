"""Fixed, evenly distributed points on shapes; being deterministic, they add no noise."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from glshadow.core.spaces import Array

GOLDEN_ANGLE = np.pi * (3.0 - np.sqrt(5.0))
GOLDEN_SHARE = (np.sqrt(5.0) - 1.0) / 2.0


def disc(count: int) -> Array:
    """Points (count, 2) of the unit disc, each for an equal area: a spiral (Vogel 1979)."""
    i = np.arange(count)
    radius, angle = np.sqrt((i + 0.5) / count), i * GOLDEN_ANGLE
    return np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=-1)


def square(count: int) -> Array:
    """Points (count, 2) of the square from -1 to 1, each for an equal area: a golden-ratio lattice."""
    i = np.arange(count)
    return np.stack([(2.0 * i + 1.0) / count, 2.0 * ((i + 0.5) * GOLDEN_SHARE % 1.0)], axis=-1) - 1.0


def disc_rings(count: int, samples: int, generator: np.random.Generator) -> Iterator[Array]:
    """Points (count, 2) of the unit disc, `samples` times: in rings of equal area, a golden angle apart (Vogel 1979), random in each."""
    turn = generator.uniform(0.0, 2.0 * np.pi, count)
    for ring in range(samples):
        radius = np.sqrt((ring + generator.uniform(size=count)) / samples)
        angle = turn + ring * GOLDEN_ANGLE
        yield radius[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=-1)


def hemisphere(count: int) -> Array:
    """Directions (count, 3) about z, each for an equal solid angle: a spiral."""
    i = np.arange(count)
    height, angle = (i + 0.5) / count, i * GOLDEN_ANGLE
    across = np.sqrt(1.0 - height**2)
    return np.stack([across * np.cos(angle), across * np.sin(angle), height], axis=-1)


def ball(count: int) -> Array:
    """Points (count, 3) of the unit ball whose projection fills the disc evenly from every side.

    The density is 1 / sqrt(1 - r^2): the only radial density with an even projection (the inverse Abel transform of a constant).
    Directions follow a spiral from pole to pole, radii the multiples of the square root of 2. The share of the disc beside a straight edge
    is off by at most 0.65 / sqrt(count), from every side (tests/unit/test_area.py).
    """
    i = np.arange(count)
    height = 1.0 - (2.0 * i + 1.0) / count
    across, angle = np.sqrt(1.0 - height**2), i * GOLDEN_ANGLE
    directions = np.stack([across * np.cos(angle), across * np.sin(angle), height], axis=-1)
    shares = (i * np.sqrt(2.0) + 0.5 / count) % 1.0
    return directions * _radius(shares)[:, None]


def _radius(share: Array) -> Array:
    """Radius that holds a share of the ball's points: the inverse of 2 / pi (asin t - t sqrt(1 - t^2))."""
    t = np.linspace(0.0, 1.0, 4097)
    within = 2.0 / np.pi * (np.arcsin(t) - t * np.sqrt(1.0 - t**2))
    return np.interp(share, within, t)
