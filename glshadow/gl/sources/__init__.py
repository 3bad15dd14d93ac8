"""What there is to ask a light's shadow of, by what its filter needs and what the driver can do."""

from glshadow.core.filters.filter import Needs
from glshadow.core.lights import Light
from glshadow.gl.context import Caps
from glshadow.gl.sources.listed import Listed
from glshadow.gl.sources.mapped import Mapped
from glshadow.gl.sources.numbered import Numbered
from glshadow.gl.sources.source import Receiver, Source


def source_of(light: Light, caps: Caps) -> type[Source]:
    """The source that a light with its settings is asked of."""
    if light.shadow is None:
        return Source
    return {Needs.COMPARISON: Mapped, Needs.TRIANGLES: Listed if caps.compute else Numbered}[light.shadow.filter.needs]


__all__ = ["Listed", "Mapped", "Numbered", "Receiver", "Source", "source_of"]
