"""What there is to ask a light's shadow of, by what its filter needs and what the driver can do."""

from __future__ import annotations

from collections.abc import Callable

from glshadow.core.decision import settle
from glshadow.core.filters.filter import Needs
from glshadow.core.shadow import Settled
from glshadow.core.used import Used
from glshadow.errors import ResourceError
from glshadow.gl.context import GLContext
from glshadow.gl.receiver import Receiver
from glshadow.gl.sources.accumulated import Accumulated
from glshadow.gl.sources.area import Area
from glshadow.gl.sources.listed import Listed
from glshadow.gl.sources.mapped import Mapped
from glshadow.gl.sources.prefiltered import Prefiltered
from glshadow.gl.sources.source import Source
from glshadow.gl.sources.uploaded import Uploaded
from glshadow.gl.work import Work
from glshadow.lights import Light


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


class Sources(dict[tuple[int, str], Source]):
    """What the lights are asked of, by their number and the source's name; kept from frame to frame."""

    def __init__(self, context: GLContext) -> None:
        super().__init__()
        self._context = context

    def claim(self, work: Work, lights: tuple[Light, ...]) -> tuple[list[Source], dict[int, Used]]:
        """The source of each light, and what was used by those that had to be made to know whether they can be.

        Where a light's lists do not fit, that light has a map, in this frame.
        """
        sources, ready = [], {}
        for number, light in enumerate(lights):
            settled = settle(light)
            source = self._claimed(work, number, light, settled)
            if settled is not None and settled.asked.filter is None and not settled.filter.has_map:
                try:
                    ready[number] = source.prepare(work)
                except ResourceError as error:
                    source = self._claimed(work, number, light, settle(light, str(error)))
            sources.append(source)
        return sources, ready

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
    "Accumulated", "Area", "Listed", "Mapped", "Prefiltered", "Receiver", "Source", "Sources", "Uploaded", "source_of",
]  # fmt: skip
