"""Technique: what a light's shadow is asked of."""

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
    """Base: a light that casts nothing. A frame calls `claim` of all lights, then `prepare` of all, then asks light by light.

    An heir is made once per light and context, and keeps what it drew for as long as that is still right.
    """

    def __init__(self, context: GLContext) -> None:
        self.light: Light

    def allocate(self, frame: FrameContext, light: Light, shadow: ResolvedShadow | None) -> None:
        """Take the light with its settings, and say what room its maps need; nothing is drawn yet."""
        self.light = light

    def expect(self, lights: tuple[Light, ...]) -> None:
        """These lights are claimed in turn, again and again: what is drawn for one may be kept until its next turn."""

    def update(self, frame: FrameContext) -> Used:
        """Draw what the light needs, unless it is kept; what was really used."""
        return Used()

    def receiver(self, frame: FrameContext) -> Receiver:
        """How the light is asked."""
        return open_receiver(frame, self.light)

    def marking_receiver(self, frame: FrameContext) -> Receiver:
        """The same for a picture with several samples in a pixel: where it can, it marks pixels whose samples may differ."""
        return self.receiver(frame)

    def finalize(self, used: Used) -> Used:
        """What was used, as it turned out where it was asked."""
        return used

    def stored(self) -> NDArray[np.float32]:
        """Its maps (V, R, R) as they are stored, row 0 at v = 1; none: (0, 0, 0)."""
        return np.zeros((0, 0, 0), dtype=np.float32)

    def release(self) -> None:
        """Free the GPU memory."""


def open_receiver(frame: FrameContext, light: Light) -> Receiver:
    """A receiver that is lit."""
    return Receiver(open_slots(light), *frame_of(light.frame((), frame.scene.origin), frame.scene.origin),
                    dialect=fetching_dialect(frame.caps.texture_gather))  # fmt: skip


def fetching_dialect(gather: bool) -> str:
    """The dialect of receivers without demands of their own."""
    return "core330_gather" if gather else "core330"


def frame_of(lv_from_world: Array, origin: Array) -> tuple[Array, Array]:
    """Axes (3, 3) of a light's frame, and where the scene's origin lies in it."""
    axes = lv_from_world[:3, :3]
    return axes, lv_from_world[:3, 3] + axes @ origin
