"""Technique: how one light's shadow is found."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from glshadow.core.spaces import Array
from glshadow.derive.used import Used
from glshadow.gl.driver.context import GLContext
from glshadow.gl.frame_context import FrameContext
from glshadow.gl.passes.receiver import Receiver
from glshadow.lights import Light
from glshadow.shader.slots import open_slots
from glshadow.shadows.shadow import ResolvedShadow


class Technique:
    """Base class; itself the technique of a light without a shadow.

    In each frame the renderer calls `allocate` of all lights, then `update` of all, then `receiver` of each, then `finalize`.
    A subclass is instantiated once per light and context. It keeps what it drew until its inputs change.
    """

    marks_capsules = False
    """Whether its marking receiver also marks pixels whose samples see shadows of balls and tubes differently."""

    def __init__(self, context: GLContext) -> None:
        self.light: Light

    def allocate(self, frame: FrameContext, light: Light, shadow: ResolvedShadow | None) -> None:
        """Set the light and its settings, and allocate tiles of the shadow atlases; nothing is drawn yet."""
        self.light = light

    def expect(self, lights: tuple[Light, ...]) -> None:
        """Announce lights that will be allocated in turn, again and again: what is drawn for one may be kept until its next turn."""

    def update(self, frame: FrameContext) -> Used:
        """Draw what the light needs, unless it is kept. Returns what was really used."""
        return Used()

    def receiver(self, frame: FrameContext) -> Receiver:
        """The receiver that finds the light's visibility."""
        return open_receiver(frame, self.light)

    def marking_receiver(self, frame: FrameContext) -> Receiver:
        """The receiver for a multisampled frame: where it can, it marks pixels whose samples may differ."""
        return self.receiver(frame)

    def finalize(self, used: Used) -> Used:
        """Correct what was used by what was found out when the receiver was made."""
        return used

    def stored(self) -> NDArray[np.float32]:
        """The light's maps (V, R, R) as they are stored, row 0 at v = 1; (0, 0, 0) if it has none."""
        return np.zeros((0, 0, 0), dtype=np.float32)

    def release(self) -> None:
        """Free the GPU memory."""


def open_receiver(frame: FrameContext, light: Light) -> Receiver:
    """A receiver that is always lit."""
    return Receiver(open_slots(light), *frame_of(light.frame((), frame.scene.origin), frame.scene.origin),
                    dialect=fetching_dialect(frame.caps.texture_gather))  # fmt: skip


def fetching_dialect(gather: bool) -> str:
    """The dialect of receivers without needs of their own."""
    return "core330_gather" if gather else "core330"


def frame_of(lv_from_world: Array, origin: Array) -> tuple[Array, Array]:
    """Axes (3, 3) of a light's frame, and the position of the scene's origin in it."""
    axes = lv_from_world[:3, :3]
    return axes, lv_from_world[:3, 3] + axes @ origin
