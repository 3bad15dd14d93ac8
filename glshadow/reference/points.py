"""Counts by tracing how many of a light's sample points each pixel sees: the float64 reference of `Exact(light_samples=)`."""

from __future__ import annotations

import numpy as np

from glshadow.core.spaces import Array
from glshadow.lights import Light
from glshadow.reference.aimed import AimedLight
from glshadow.reference.truth import Truth


def count_points(truth: Truth, light: Light, count: int) -> Array:
    """The counts (H, W) of points that are seen and above the receiver's horizon, where the light shines; NaN where there is no surface.

    Parameters
    ----------
    truth : Truth
        Of the same scene and camera. If it was traced with `surface=frame.triangle`, its points are those of the frame.
    light : Light
        A light that has a size.
    count : int
        Number of points.
    """
    known = truth.triangle >= 0
    rays, own = truth.rays, truth.triangle[known]
    source = AimedLight(light, rays.origin)
    receivers = source.receivers(rays, own, truth.position[known] - rays.origin, truth.normal[known])
    places = receivers.points + rays.origin
    asked = rays.receives[own]
    aims = light.to_points(places, count)
    seen, shone = np.zeros(len(own)), light.shines_on(places)
    for k in range(count):
        length = np.linalg.norm(aims[:, k], axis=1)
        aim = aims[:, k] / length[:, None]
        far = np.full(len(own), np.inf) if light.at_infinity else length
        open_to = receivers.open_to(aim)
        rows = np.flatnonzero(open_to & asked)
        open_to[rows] = ~receivers.blocked(rays, aim[rows], far[rows], rows)
        seen += open_to
    counts = np.full(known.shape, np.nan)
    counts[known] = seen * shone  # of a cone, the border is that of the middle
    return counts
