"""What there is to ask a light's shadow of, by what its filter needs and what the driver can do."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from glshadow.derive.resolved import settle
from glshadow.derive.used import Used
from glshadow.errors import ResourceError
from glshadow.gl.driver.context import GLContext
from glshadow.gl.frame_context import Work
from glshadow.gl.passes.receiver import Receiver
from glshadow.gl.passes.translucent import Panes
from glshadow.gl.techniques.accumulated import Accumulated
from glshadow.gl.techniques.area import Area
from glshadow.gl.techniques.listed import Listed
from glshadow.gl.techniques.mapped import Mapped
from glshadow.gl.techniques.prefiltered import Prefiltered
from glshadow.gl.techniques.technique import Source
from glshadow.gl.techniques.uploaded import Uploaded
from glshadow.lights import Light
from glshadow.shadows.filters.filter import Needs
from glshadow.shadows.shadow import Settled


def source_of(light: Light, shadow: Settled | None, context: GLContext) -> tuple[str, Callable[[], Source]]:
    """The source that a light with these settings is asked of: its name, and how it is made.

    That of a light that has a size turns to others by itself where its lists do not fit.
    """
    if shadow is None:
        return "", lambda: Source(context)
    kinds: dict[Needs, type[Source]] = {
        Needs.COMPARISON: Mapped,
        Needs.MOMENTS: Prefiltered,
        Needs.TRIANGLES: Listed if context.caps.compute else Uploaded,
    }
    kind: type[Source] = kinds[shadow.filter.needs]
    if shadow.filter.points_of_light and light.has_size:
        if kind is Listed and shadow.asked.faces is None and light.penumbra is not None:
            return "Area", lambda: Area(context)
        return f"{kind.__name__} many times", lambda: Accumulated(context, kind(context), Mapped(context))
    return kind.__name__, lambda: kind(context)


@dataclass(eq=False)
class LightWork:
    """One light in one frame.

    Parameters
    ----------
    number : int
        Which light of the frame.
    light : Light
    technique : Source
    used : Used, optional
        None: not prepared yet.
    panes : Panes, optional
        The translucent casters that tint it.
    """

    number: int
    light: Light
    technique: Source
    used: Used | None = None
    panes: Panes | None = None


class Sources(dict[tuple[int, str], Source]):
    """What the lights are asked of, by their number and the source's name; kept from frame to frame."""

    def __init__(self, context: GLContext) -> None:
        super().__init__()
        self._context = context

    def claim(self, work: Work, lights: tuple[Light, ...]) -> list[LightWork]:
        """The technique of each light; where its lists do not fit, that light has a map, in this frame."""
        return [self._claim(work, number, light) for number, light in enumerate(lights)]

    def _claim(self, work: Work, number: int, light: Light) -> LightWork:
        settled = settle(light)
        source = self._claimed(work, number, light, settled)
        if settled is None or settled.asked.filter is not None or settled.filter.has_map:
            return LightWork(number, light, source)
        try:
            return LightWork(number, light, source, source.prepare(work))
        except ResourceError as error:
            return LightWork(number, light, self._claimed(work, number, light, settle(light, str(error))))

    def _claimed(self, work: Work, number: int, light: Light, settled: Settled | None) -> Source:
        name, make = source_of(light, settled, self._context)
        source = self.get((number, name))
        if source is None:
            source = self[number, name] = make()
        source.claim(work, light, settled)
        return source

    def release(self) -> None:
        """Free them all."""
        for source in self.values():
            source.release()


__all__ = [
    "Accumulated", "Area", "LightWork", "Listed", "Mapped", "Prefiltered", "Receiver", "Source", "Sources", "Uploaded", "source_of",
]  # fmt: skip
