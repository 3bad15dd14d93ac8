"""What there is to ask a light's shadow of, by what its filter needs and what the driver can do."""

from glshadow.core.filters.filter import Needs
from glshadow.core.shadow import Settled
from glshadow.gl.context import Caps
from glshadow.gl.geometry import GpuScene
from glshadow.gl.sources.listed import Listed
from glshadow.gl.sources.mapped import Mapped
from glshadow.gl.sources.numbered import Numbered
from glshadow.gl.sources.source import Receiver, Source


def source_of(shadow: Settled | None, caps: Caps) -> type[Source]:
    """The source that a light with these settings is asked of."""
    if shadow is None:
        return Source
    return {Needs.COMPARISON: Mapped, Needs.TRIANGLES: Listed if caps.compute else Numbered}[shadow.filter.needs]


def without_lists(scene: GpuScene, caps: Caps) -> str:
    """Why this driver has no lists of a scene's triangles, as far as is known; empty: it may have."""
    if caps.compute:
        return scene.unlisted
    return f"lists of triangles need OpenGL 4.3, {caps.renderer} has {caps.version_code / 100:.1f}"


__all__ = ["Listed", "Mapped", "Numbered", "Receiver", "Source", "source_of", "without_lists"]
