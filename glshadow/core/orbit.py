"""Orbit: cameras on a circle around a camera's target."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, TypeVar, cast

import numpy as np

from glshadow.core.cameras import Camera
from glshadow.core.setting import instance, whole
from glshadow.core.spaces import Array

MOST = 100_000

C = TypeVar("C", bound=Camera)


def orbit(camera: C, count: int) -> tuple[C, ...]:
    """Cameras on a circle around a camera's target, about the vertical axis through it.

    Parameters
    ----------
    camera : PerspectiveCamera, IntrinsicsCamera or OrthographicCamera
        The first camera; all others keep its lens, height and distance.
    count : int
        Number of cameras, in equal steps of a full turn, counterclockwise seen from above (+y); 1 to 100,000.

    Returns
    -------
    tuple of cameras

    Raises
    ------
    SettingsError
        If an argument is not allowed, or the camera looks straight up or down.
    """
    camera = cast(C, instance(Camera)("camera", camera))
    count = whole(1, MOST)("count", count)
    given: Any = camera  # every kind of camera has a position, a target and an up
    offset = np.subtract(given.position, given.target)
    turned = []
    for k in range(count):
        turn = _about_y(2.0 * np.pi * k / count)
        place = given.position if k == 0 else tuple((np.asarray(given.target) + turn @ offset).tolist())
        up = given.up if k == 0 else tuple((turn @ np.asarray(given.up)).tolist())
        turned.append(replace(given, position=place, up=up))
    return tuple(turned)


def _about_y(angle: float) -> Array:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])
