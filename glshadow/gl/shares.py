"""Shares: each light's contribution to an image, with the receiver that finds its visibility."""

from __future__ import annotations

from collections.abc import Sequence

from glshadow.derive.look import Look
from glshadow.gl.frame_context import FrameContext
from glshadow.gl.passes.resolve import Share
from glshadow.gl.techniques import LightPass
from glshadow.gl.techniques.technique import open_receiver
from glshadow.lights import DirectionalLight


def shares_of(frame: FrameContext, lights: Sequence[LightPass], look: Look) -> tuple[Share, ...]:
    """Each light's contribution to the image; without lights that of a single black one."""
    if not lights:
        dark = DirectionalLight(intensity=0.0)
        return (Share(dark, open_receiver(frame, dark), 0, 1, look.ambient, look.linear_background),)
    several = frame.targets.samples > 1
    return tuple(
        Share(each.light, each.technique.marking_receiver(frame) if several else each.technique.receiver(frame),
              each.number, len(lights), look.ambient, look.linear_background, each.tint)
        for each in lights
    )  # fmt: skip
