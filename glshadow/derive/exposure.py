"""Light metering: how bright a scene's lights are where they fall, from the lights and samples of the surfaces alone."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from glshadow.core.spaces import Array
from glshadow.core.srgb import LUMINANCE
from glshadow.lights import Light


def light_level(lights: Sequence[Light], points: Array, normals: Array) -> float:
    """Luminance of the light on white surfaces that face it, averaged over what the lights shine on; 0 if they reach nothing.

    An incident-light meter, turned to each light, without shadows. The average is geometric, and weighted by the light that falls on each
    surface: neither a wide dark ground nor a small surface close to a light decides. It depends neither on a camera nor on the order of
    lights, and is proportional to the lights' intensities.

    Parameters
    ----------
    points, normals : (N, 3) float64
        Samples of the surfaces, each for the same area: world positions and unit normals of front faces.
    """
    if not lights:
        return 0.0
    if all(light.at_infinity for light in lights):
        points, normals = points[:1], normals[:1]
    facing = _total(lights, points, None)
    if len(points) == 1:
        return float(facing[0])
    weights = facing * 0.0
    for side in (normals, -normals):  # back faces only where no front face is lit
        if not weights.any():
            weights = _total(lights, points, side)
    lit = (weights > 0.0) & np.isfinite(facing)
    if not lit.any():
        return 0.0
    weights = weights[lit] / weights[lit].max()
    return float(np.exp((weights * np.log(facing[lit])).sum() / weights.sum()))


def _total(lights: Sequence[Light], points: Array, normals: Array | None) -> Array:
    """Luminance of all lights at points (N, 3) on surfaces with these normals; None: on surfaces that face each light."""
    found = np.zeros((len(points), len(lights)))
    for number, light in enumerate(lights):
        towards = light.to_light(points)[0] if normals is None else normals
        share = light.irradiance(points, towards)
        color = np.asarray(light.color) * light.intensity
        found[:, number] = share * (color @ LUMINANCE) if share.ndim == 1 else (share * color) @ LUMINANCE
    return np.asarray(np.sort(found, axis=1).sum(axis=1))  # sorted: the sum does not depend on the lights' order
