"""Shares: each light's contribution to an image, with the receiver that finds its visibility."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from glshadow.derive.look import Look
from glshadow.gl.frame_context import FrameContext
from glshadow.gl.passes.receiver import Receiver
from glshadow.gl.passes.resolve import Share
from glshadow.gl.techniques import LightPass
from glshadow.gl.techniques.technique import Technique, open_receiver
from glshadow.lights import DirectionalLight


def every_sample(frame: FrameContext, lights: Sequence[LightPass]) -> bool:
    """Whether all samples of all surfaces are shaded, and no pixel as a whole: where a light cannot mark the shadows of balls and tubes."""
    several = frame.targets.samples > 1 and frame.scene.capsules > 0
    return several and not all(each.technique.marks_capsules for each in lights)


def shares_of(frame: FrameContext, lights: Sequence[LightPass], look: Look) -> tuple[Share, ...]:
    """Each light's contribution to the image; without lights that of a single black one."""
    shown = (look.tone, look.white, look.scale)
    if not lights:
        dark = DirectionalLight(intensity=0.0)
        return (Share(dark, open_receiver(frame, dark), 0, 1, look.ambient, look.linear_background, None, *shown),)
    several, every = frame.targets.samples > 1, every_sample(frame, lights)

    def receiver(technique: Technique) -> Receiver:
        if every:
            return replace(technique.receiver(frame), marks={}, collected={"GLS_EVERY": 1, "GLS_NEIGHBORS": 0})
        return technique.marking_receiver(frame) if several else technique.receiver(frame)

    return tuple(
        Share(each.light, receiver(each.technique),
              each.number, len(lights), look.ambient, look.linear_background, each.tint, *shown)
        for each in lights
    )  # fmt: skip
