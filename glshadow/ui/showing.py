"""Showing: the state of an interactive view, and how user input changes it; nothing here draws."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any, Self, cast

import numpy as np

from glshadow.arguments import frame_arguments
from glshadow.core.cameras import Camera, IntrinsicsCamera, OrthographicCamera
from glshadow.core.spaces import Array
from glshadow.lights import Light, Lights
from glshadow.scene.nodes import Scene
from glshadow.shadows.bias import Bias
from glshadow.shadows.filters import Filter
from glshadow.shadows.shadow import Shadow

STEEPEST = 89.0  # degrees: a camera or a light straight above has no azimuth
NEAREST = 1e-3  # share of the scene's size, from the target
BESIDE = 1e-6  # share of a direction within which it is vertical


@dataclass(frozen=True, eq=False)
class Showing:
    """The state of an interactive view.

    Parameters
    ----------
    scene, camera, lights
        As given; the settings below replace those of all lights that cast shadows.
    light : int
        Index of the selected light.
    filter, resolution, bias : optional
        None: the light's own setting.
    samples : int
        Samples per pixel.
    overlays : tuple of str
        Names from `overlay.OVERLAYS`.
    error : bool
        Whether wrong pixels are highlighted once nothing moves.
    """

    scene: Scene
    camera: Camera
    lights: tuple[Light, ...]
    light: int = 0
    filter: Filter | None = None
    resolution: int | None = None
    bias: Bias | None = None
    samples: int = 1
    overlays: tuple[str, ...] = field(default=())
    error: bool = False

    @classmethod
    def of(cls, scene: Scene, camera: Camera | None = None, lights: Lights = None) -> Self:
        """A scene with the given camera and lights, by default its own."""
        camera, lit, _ = frame_arguments(scene, camera, lights, (1, 1))
        return cls(scene, camera, lit)

    @property
    def shadowed(self) -> tuple[Light, ...]:
        """The lights with the chosen settings."""
        return tuple(
            each if each.shadow is None else replace(each, shadow=self._shadow(each.shadow)) for each in self.lights
        )

    def _shadow(self, own: Shadow) -> Shadow:
        if self.filter is None and self.resolution is None and self.bias is None:
            return own
        chosen: dict[str, Any] = {"filter": self.filter, "resolution": self.resolution, "bias": self.bias}
        kept = {name: value for name, value in chosen.items() if value is not None}
        if self.filter is not None and not self.filter.has_map:
            kept = {"filter": self.filter}  # map settings do not apply without a map
            own = Shadow(strength=own.strength)
        return replace(own, **kept, channel=None)

    @property
    def size(self) -> float:
        """Size of the scene: the diagonal of its box."""
        low, high = self.scene.extent
        return float(np.linalg.norm(high - low)) or 1.0

    # -- camera

    def turned(self, azimuth: float, elevation: float) -> Self:
        """Orbit the camera around its target by degrees: to the right, and up to at most `STEEPEST`."""
        target = np.asarray(self.camera.target)
        offset = np.asarray(self.camera.position) - target
        distance = float(np.linalg.norm(offset))
        old = angles_of(offset)
        there = direction_of(old[0] + azimuth, float(np.clip(old[1] + elevation, -STEEPEST, STEEPEST)))
        return self._seen_from(target + distance * there, target)

    def panned(self, right: float, up: float) -> Self:
        """Move camera and target across the view, in units of the target's distance."""
        axes = self.camera.view_from_world[:3, :3]
        distance = np.linalg.norm(np.subtract(self.camera.position, self.camera.target))
        step = distance * (right * axes[0] + up * axes[1])
        return self._seen_from(np.asarray(self.camera.position) + step, np.asarray(self.camera.target) + step)

    def zoomed(self, factor: float) -> Self:
        """Approach the target by a factor. An orthographic camera shows less by the same factor, an intrinsics camera moves too."""
        target = np.asarray(self.camera.target)
        if isinstance(self.camera, OrthographicCamera):
            return replace(self, camera=replace(self.camera, height=self.camera.height / factor))
        offset = (np.asarray(self.camera.position) - target) / factor
        least = NEAREST * self.size / float(np.linalg.norm(offset))
        return self._seen_from(target + offset * max(least, 1.0), target)

    def _seen_from(self, place: Array, target: Array) -> Self:
        camera = cast(Any, self.camera)  # every kind of camera has a position, a target and an up
        up = (0.0, 1.0, 0.0)
        more = {"near": None, "far": None} if not isinstance(camera, IntrinsicsCamera) else {}
        moved = replace(camera, position=tuple(place.tolist()), target=tuple(target.tolist()), up=up, **more)
        return replace(self, camera=moved)

    # -- light

    @property
    def aim(self) -> tuple[float, float]:
        """Azimuth and elevation in degrees of the direction to the light, from the middle of the scene."""
        return angles_of(self._offset)

    def lit_from(self, azimuth: float, elevation: float) -> Self:
        """Move the selected light to these angles. A local light keeps its distance to the middle; its orientation turns with it."""
        if self.lights[self.light].fixed:
            return self
        there = direction_of(azimuth, float(np.clip(elevation, -STEEPEST, STEEPEST)))
        return self._lit(self.lights[self.light].turned(_rotation(self._offset, there), self._middle))

    def sized(self, size: float) -> Self:
        """Set the light's size: degrees at infinity, otherwise a share of the scene's size; 0: a point."""
        light = self.lights[self.light]
        if not light.sized_by:
            return self
        chosen: dict[str, Any] = {light.sized_by: size if light.at_infinity else size * self.size}
        return self._lit(replace(light, **chosen))

    @property
    def light_size(self) -> float:
        """The value that `sized` would set; 0 if the light's size cannot be set."""
        light = self.lights[self.light]
        given: float = getattr(light, light.sized_by) if light.sized_by else 0.0
        return given if light.at_infinity else given / self.size

    def _lit(self, light: Light) -> Self:
        lights = tuple(light if number == self.light else each for number, each in enumerate(self.lights))
        return replace(self, lights=lights)

    @property
    def _middle(self) -> Array:
        return np.asarray(0.5 * (self.scene.bounds[0] + self.scene.bounds[1]))

    @property
    def _offset(self) -> Array:
        """Vector from the middle of the scene to the light, or towards it."""
        *place, w = self.lights[self.light].place
        return np.asarray(np.asarray(place) - w * self._middle)


def angles_of(offset: Array) -> tuple[float, float]:
    """(azimuth, elevation) in degrees of a direction: from +z towards +x, and above the ground."""
    x, y, z = np.asarray(offset) / (float(np.linalg.norm(offset)) or 1.0)
    azimuth = np.degrees(np.arctan2(x, z)) if np.hypot(x, z) > BESIDE else 0.0
    return float(azimuth), float(np.degrees(np.arcsin(np.clip(y, -1.0, 1.0))))


def direction_of(azimuth: float, elevation: float) -> Array:
    """Unit vector (3,) of these angles."""
    a, e = np.radians(azimuth), np.radians(elevation)
    return np.array([np.sin(a) * np.cos(e), np.sin(e), np.cos(a) * np.cos(e)])


def _rotation(old: Array, new: Array) -> Array:
    """(3, 3) rotation about the vertical and then a horizontal axis, from one direction to another; upright things stay upright."""
    (a0, e0), (a1, e1) = angles_of(old), angles_of(new)
    return _about(a1, e1) @ _about(a0, e0).T


def _about(azimuth: float, elevation: float) -> Array:
    """(3, 3) matrix with columns right, up and towards of a direction."""
    towards = direction_of(azimuth, elevation)
    a = np.radians(azimuth)
    right = np.array([np.cos(a), 0.0, -np.sin(a)])
    return np.stack([right, np.cross(towards, right), towards], axis=1)
