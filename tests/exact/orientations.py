"""Random orientations: no edge, normal or light direction of a test is a round number."""

from __future__ import annotations

import numpy as np

from glshadow.core.spaces import Array, unit, view_axes


def rotation(rng: np.random.Generator) -> Array:
    """A random rotation, (3, 3)."""
    axes = view_axes(unit("forward", rng.normal(size=3)))
    angle = rng.uniform(0.0, 2.0 * np.pi)
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]) @ axes
