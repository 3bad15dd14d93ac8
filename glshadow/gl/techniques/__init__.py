"""Chooses and keeps the technique that finds each light's shadow, by what its filter needs and what the driver supports."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from glshadow.derive.resolved import resolve_shadow
from glshadow.derive.used import Used
from glshadow.errors import ResourceError
from glshadow.gl.driver.context import GLContext
from glshadow.gl.frame_context import FrameContext
from glshadow.gl.passes.receiver import Receiver
from glshadow.gl.passes.translucent import Tint
from glshadow.gl.techniques.accumulated import Accumulated
from glshadow.gl.techniques.area import Area
from glshadow.gl.techniques.directions import Directions
from glshadow.gl.techniques.listed import Listed
from glshadow.gl.techniques.mapped import Mapped
from glshadow.gl.techniques.prefiltered import Prefiltered
from glshadow.gl.techniques.technique import Technique
from glshadow.gl.techniques.uploaded import Uploaded
from glshadow.lights import Light
from glshadow.shadows.filters.filter import Needs
from glshadow.shadows.shadow import ResolvedShadow


def technique_of(
    light: Light, shadow: ResolvedShadow | None, context: GLContext, capsules: bool = False
) -> tuple[str, Callable[[], Technique]]:
    """Name and factory of the technique for a light with these settings.

    An area light's technique switches to another one by itself if its triangle lists do not fit. `capsules`: the scene has points or lines,
    which are tested against one ray at a time.
    """
    if shadow is None:
        return "", lambda: Technique(context)
    kinds: dict[Needs, type[Technique]] = {
        Needs.COMPARISON: Mapped,
        Needs.MOMENTS: Prefiltered,
        Needs.DIRECTIONS: Directions,
        Needs.TRIANGLES: Listed if context.caps.compute else Uploaded,
    }
    kind: type[Technique] = kinds[shadow.filter.needs]
    if shadow.filter.points_of_light and light.has_size and kind is not Directions:
        if kind is Listed and not capsules and shadow.requested.faces is None and light.penumbra is not None:
            return "Area", lambda: Area(context)
        return f"{kind.__name__} many times", lambda: Accumulated(context, kind(context), Mapped(context))
    return kind.__name__, lambda: kind(context)


@dataclass(eq=False)
class LightPass:
    """What one frame does for one light: its technique and what this used.

    Parameters
    ----------
    number : int
        Which light of the frame.
    light : Light
    technique : Technique
    used : Used, optional
        None: not updated yet.
    tint : Tint, optional
        The translucent casters that colour the light.
    """

    number: int
    light: Light
    technique: Technique
    used: Used | None = None
    tint: Tint | None = None


class Techniques(dict[tuple[int, str], Technique]):
    """The techniques of all lights, by light number and technique name; kept from frame to frame."""

    def __init__(self, context: GLContext) -> None:
        super().__init__()
        self._context = context

    def allocate(self, frame: FrameContext, lights: tuple[Light, ...]) -> list[LightPass]:
        """Choose and allocate each light's technique. A light whose triangle lists do not fit gets a shadow map in this frame."""
        return [self._allocate(frame, number, light) for number, light in enumerate(lights)]

    def _allocate(self, frame: FrameContext, number: int, light: Light) -> LightPass:
        resolved = resolve_shadow(light)
        technique = self._allocated(frame, number, light, resolved)
        if resolved is None or resolved.filter.has_map:
            return LightPass(number, light, technique)
        if resolved.requested.filter is not None and not resolved.filter.interpolates:
            return LightPass(number, light, technique)
        try:
            return LightPass(number, light, technique, technique.update(frame))
        except ResourceError as error:
            return LightPass(number, light, self._allocated(frame, number, light, resolve_shadow(light, str(error))))

    def _allocated(self, frame: FrameContext, number: int, light: Light, resolved: ResolvedShadow | None) -> Technique:
        name, make = technique_of(light, resolved, self._context, frame.scene.capsules > 0)
        technique = self.get((number, name))
        if technique is None:
            technique = self[number, name] = make()
        technique.allocate(frame, light, resolved)
        return technique

    def release(self) -> None:
        """Release all techniques."""
        for technique in self.values():
            technique.release()


__all__ = [
    "Accumulated", "Area", "Directions", "LightPass", "Listed", "Mapped", "Prefiltered", "Receiver", "Technique", "Techniques", "Uploaded",
    "technique_of",
]  # fmt: skip
