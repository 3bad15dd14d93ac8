"""Looks: the default camera, lights, ambient light, background and ground of a scene, under one word."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from glshadow.core.cameras import Camera, PerspectiveCamera
from glshadow.core.spaces import Array
from glshadow.derive.backdrop import Sky
from glshadow.lights import DirectionalLight, Light, SkyLight
from glshadow.scene.box import default_camera, default_sun
from glshadow.scene.framing import framing_camera
from glshadow.shadows.filters import DirectionMaps
from glshadow.shadows.shadow import Shadow

Pair = tuple[float, float]

_KEY = Shadow(
    filter=DirectionMaps(64), resolution=512
)  # its time does not depend on the model's shape as that of Exact() does
_FILL = Shadow(
    filter=DirectionMaps(64)
)  # beside a key a quarter of the usual directions is smooth enough, in half the time

_TURNED = 1.25  # the key stays on the left unless the model's sides are brighter by this from the right


@dataclass(frozen=True)
class Look:
    """A look: what a scene is given that has no camera or lights of its own.

    Parameters
    ----------
    camera : function
        The camera, from points (N, 3) whose hull is the model's.
    lights : function
        The lights, from the camera and the model's bounds (2, 3).
    ambient : (2,) floats
        From above and from below, beside these lights.
    background : (3,) floats
        sRGB.
    white : float
        Linear reflectance of a model without materials.
    ground : float or None
        Linear reflectance of the ground. None: it has the background's colour and shows the shadow alone, so that both are one.
    ground_size : float
        Side of the ground over the diagonal of the model's bounds.
    stands : bool
        Whether a model whose file has neither a camera nor lights stands on a ground where nobody says so, in what is made to be looked at.
    sky : pair of (3,) floats, optional
        sRGB of the background at the horizon and at the zenith, in place of one colour.
    """

    camera: Callable[[Array], PerspectiveCamera]
    lights: Callable[[Camera, Array], tuple[Light, ...]]
    ambient: Pair
    background: tuple[float, float, float]
    white: float = 0.8
    ground: tuple[float, float, float] | None = None
    ground_size: float = 3.0
    stands: bool = True
    sky: Sky | None = None

    def ambient_beside(self, lights: Sequence[Light]) -> Pair:
        """Ambient light beside these lights: its own if they include light from all around, as its lights do; else the plain look's."""
        filled = any(light.wide and light.at_infinity for light in lights)
        return self.ambient if filled or self is PLAIN else PLAIN.ambient


def flatness(bounds: Array) -> float:
    """0 for a model that is at least 0.45 times as high as it is wide, 1 for one of at most 0.05, and between them."""
    size = bounds[1] - bounds[0]
    wide = max(float(np.hypot(size[0], size[2])), np.finfo(float).tiny)
    return float(np.clip((0.45 - size[1] / wide) / 0.4, 0.0, 1.0))


def _towards(azimuth: float, elevation: float) -> Array:
    """Unit vector from +z by an azimuth to +x and an elevation to +y, degrees."""
    a, e = np.radians(azimuth), np.radians(elevation)
    return np.array([np.sin(a) * np.cos(e), np.sin(e), np.cos(a) * np.cos(e)])


def _framed(points: Array) -> PerspectiveCamera:
    """35 degrees aside and 20 above, up to 45 of a flat model."""
    bounds = np.stack([points.min(axis=0), points.max(axis=0)])
    return framing_camera(points, _towards(35.0, 20.0 + 25.0 * flatness(bounds)))


def _outside(points: Array) -> PerspectiveCamera:
    """Lower, so that the horizon is in the image."""
    bounds = np.stack([points.min(axis=0), points.max(axis=0)])
    return framing_camera(points, _towards(35.0, 8.0 + 17.0 * flatness(bounds)))


def _beside(camera: Camera, azimuth: float, elevation: float) -> tuple[float, float, float]:
    """Direction in which light travels that comes from an azimuth, to the left of the camera's view, and an elevation, degrees."""
    right, up, _ = camera.view_from_world[:3, :3]
    level = np.array([right[0], 0.0, right[2]])
    if np.linalg.norm(level) < 1e-3:  # the camera is tilted by 90 degrees about its axis
        level = np.array([up[0], 0.0, up[2]])
    level /= np.linalg.norm(level)
    towards = np.array([-level[2], 0.0, level[0]])  # from the model to the camera
    a, e = np.radians(azimuth), np.radians(elevation)
    from_light = np.cos(e) * (np.cos(a) * towards - np.sin(a) * level) + np.sin(e) * np.array([0.0, 1.0, 0.0])
    return tuple((-from_light).tolist())


def lit_share(camera: Camera, bounds: Array, direction: tuple[float, float, float]) -> float:
    """How bright the upright faces of a model's box are that a camera sees, in its image, in light along a direction."""
    eye, light = camera.view_from_world[2, :3], -np.asarray(direction)
    across, high, deep = bounds[1] - bounds[0]
    areas = np.sign(eye[[0, 2]]) * (deep * high, across * high) * eye[[0, 2]]
    return float((areas * np.maximum(np.sign(eye[[0, 2]]) * light[[0, 2]], 0.0)).sum())


def _key_direction(camera: Camera, bounds: Array) -> tuple[float, float, float]:
    """From the left of the camera, or from its right if a model's larger side is to be seen there, and would be dark."""
    left, right = (_beside(camera, azimuth, 48.0 - 18.0 * flatness(bounds)) for azimuth in (65.0, -65.0))
    return right if lit_share(camera, bounds, right) > _TURNED * lit_share(camera, bounds, left) else left


def _studio(camera: Camera, bounds: Array) -> tuple[Light, ...]:
    flat = flatness(bounds)
    # a flat model faces the sky and the key at once: less of both
    key = DirectionalLight(
        direction=_key_direction(camera, bounds),
        intensity=1.1 - 0.2 * flat,
        angle=3.0,
        color=(1.0, 0.98, 0.95),
        shadow=_KEY,
    )
    return key, SkyLight(intensity=0.42 - 0.06 * flat, color=(0.95, 0.98, 1.0), shadow=_FILL)


def _outdoor(camera: Camera, bounds: Array) -> tuple[Light, ...]:
    sun = DirectionalLight(direction=_beside(camera, 50.0, 40.0), intensity=1.0, angle=0.53, color=(1.0, 0.93, 0.82))
    return sun, SkyLight(intensity=0.35, color=(0.68, 0.84, 1.0), shadow=_FILL)


def _box(points: Array) -> PerspectiveCamera:
    return default_camera(np.stack([points.min(axis=0), points.max(axis=0)]))


# Ambient light and background chosen by eye on twelve models: shaded sides keep their shape, white does not burn out under one directional
# light, shadows stay dark enough to be read, and the background is darker than a lit white ground and lighter than any shadow.
PLAIN = Look(
    _box,
    lambda camera, bounds: (default_sun(),),
    ambient=(0.27, 0.12),
    background=(0.81, 0.82, 0.84),
    white=1.0,
    ground=(0.7, 0.7, 0.7),
    stands=False,
)
STUDIO = Look(_framed, _studio, ambient=(0.04, 0.16), background=(0.94, 0.94, 0.94))
OUTDOOR = Look(
    _outside,
    _outdoor,
    ambient=(0.02, 0.12),
    background=(0.73, 0.83, 0.93),
    ground=(0.42, 0.40, 0.36),
    ground_size=2000.0,
    sky=((0.87, 0.92, 0.96), (0.30, 0.51, 0.80)),
)
LOOKS = {"studio": STUDIO, "plain": PLAIN, "outdoor": OUTDOOR}
"""By the word of `load(look=)` and `--look`."""
