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


def every_sample(frame: FrameContext) -> bool:
    """Whether all samples of all surfaces are shaded, and no pixel as a whole."""
    return frame.targets.samples > 1 and frame.scene.capsules > 0


def _every(receiver: Receiver) -> Receiver:
    """The receiver of a frame of which every sample is shaded: balls and tubes have no edges to mark."""
    return replace(receiver, marks={}, collected={"GLS_EVERY": 1, "GLS_NEIGHBORS": 0})


def _marked(frame: FrameContext, technique: Technique) -> Receiver:
    """The receiver of a multisampled frame."""
    return _every(technique.receiver(frame)) if every_sample(frame) else technique.marking_receiver(frame)


def shares_of(frame: FrameContext, lights: Sequence[LightPass], look: Look) -> tuple[Share, ...]:
    """Each light's contribution to the image; without lights that of a single black one."""
    shown = (look.tone, look.white, look.scale)
    if not lights:
        dark = DirectionalLight(intensity=0.0)
        receiver = open_receiver(frame, dark)
        receiver = _every(receiver) if every_sample(frame) else receiver
        return (Share(dark, receiver, 0, 1, look.ambient, look.linear_background, None, *shown),)
    several = frame.targets.samples > 1
    return tuple(
        Share(each.light, _marked(frame, each.technique) if several else each.technique.receiver(frame),
              each.number, len(lights), look.ambient, look.linear_background, each.tint, *shown)
        for each in lights
    )  # fmt: skip
