"""What `measure` needs of a frame and of a truth, and whether they are of the same picture."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from glshadow.core.cameras import Camera
from glshadow.core.lights import LIGHTS, Light
from glshadow.core.setting import refuse
from glshadow.core.spaces import Array, Bools
from glshadow.errors import GlshadowError, SettingsError
from glshadow.scene.arguments import checked_scene
from glshadow.scene.mesh import Scene


class Frame(Protocol):
    """What `measure` needs of a rendered frame."""

    @property
    def visibility(self) -> NDArray[np.float32]: ...  # (L, H, W)
    @property
    def scene(self) -> Scene: ...
    @property
    def camera(self) -> Camera: ...
    @property
    def lights(self) -> Sequence[Light]: ...


class Truth(Frame, Protocol):
    """What `measure` needs of the exact answer, and asks it."""

    @property
    def cosine(self) -> NDArray[np.float32]: ...  # (L, H, W)
    @property
    def reached(self) -> Bools: ...  # (L, H, W)
    @property
    def position(self) -> Array: ...  # (H, W, 3)
    @property
    def normal(self) -> Array: ...  # (H, W, 3)
    @property
    def triangle(self) -> NDArray[np.int32]: ...  # (H, W)
    @property
    def body(self) -> NDArray[np.int32]: ...  # (H, W)
    def near_edge(self, light: int, radius: Array | float, where: Bools | None = None) -> Bools: ...
    def near_foot(self, radius: Array | float, where: Bools) -> Bools: ...


FRAME_HAS = ("visibility", "scene", "camera", "lights")
TRUTH_HAS = (*FRAME_HAS, "cosine", "reached", "position", "normal", "triangle", "body", "near_edge", "near_foot")


def _check_has(name: str, given: object, parts: tuple[str, ...]) -> None:
    for part in parts:
        try:
            value = getattr(given, part)
        except GlshadowError:  # a frame says itself which output it lacks
            raise
        except Exception:
            raise refuse(name, f"what glshadow makes (it has no {part})", given) from None
        if part == "visibility" and not (isinstance(value, np.ndarray) and value.dtype.kind == "f"):
            raise refuse(f"{name}.visibility", "an array (L, H, W) of floats", value)
        if part == "lights":
            LIGHTS(f"{name}.lights", value)
        if part == "scene":
            checked_scene(value)


def check_same(frame: Frame, truth: Truth) -> None:
    """Refuse what is no frame, no truth, or not of one picture.

    Raises
    ------
    SettingsError
        Names what differs.
    """
    _check_has("frame", frame, FRAME_HAS)
    _check_has("truth", truth, TRUTH_HAS)
    if len(truth.lights) == 0:
        raise SettingsError("there is nothing to measure: the truth has no lights")
    if frame.visibility.shape != truth.visibility.shape:
        raise SettingsError(
            f"frame and truth must have the same lights and size: frame.visibility is {frame.visibility.shape}, "
            f"truth.visibility {truth.visibility.shape} (lights, height, width)"
        )
    if frame.scene is not truth.scene:
        raise SettingsError(
            f"frame and truth must be of the same Scene object: the frame shows {frame.scene.name!r}, "
            f"the truth {truth.scene.name!r}; trace the scene that was rendered"
        )
    if frame.camera != truth.camera:
        raise SettingsError(f"frame and truth must have the same camera: {frame.camera} is not {truth.camera}")
    for number, (ours, theirs) in enumerate(zip(frame.lights, truth.lights, strict=True)):
        if replace(ours, shadow=None) != replace(theirs, shadow=None) or (ours.shadow is None) != (
            theirs.shadow is None
        ):
            raise SettingsError(f"frame and truth must have the same lights: light {number} is {ours} and {theirs}")
