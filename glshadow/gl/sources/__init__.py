"""What there is to ask a light's shadow of, by what its filter needs and what the driver can do."""

from collections.abc import Callable

from glshadow.core.area import has_size
from glshadow.core.filters.filter import Needs
from glshadow.core.lights import Light, SkyLight
from glshadow.core.shadow import Settled
from glshadow.gl.context import Caps, GLContext
from glshadow.gl.geometry import GpuScene
from glshadow.gl.receiver import Receiver
from glshadow.gl.sources.accumulated import Accumulated
from glshadow.gl.sources.area import Area
from glshadow.gl.sources.listed import Listed
from glshadow.gl.sources.mapped import Mapped
from glshadow.gl.sources.numbered import Numbered
from glshadow.gl.sources.source import Source


def source_of(light: Light, shadow: Settled | None, context: GLContext) -> tuple[str, Callable[[], Source]]:
    """The source that a light with these settings is asked of: its name, and how it is made."""
    if shadow is None:
        return "", lambda: Source(context)
    kinds = {Needs.COMPARISON: Mapped, Needs.TRIANGLES: Listed if context.caps.compute else Numbered}
    kind: type[Source] = kinds[shadow.filter.needs]
    if shadow.filter.points_of_light and has_size(light):
        if kind is Listed and shadow.asked.faces is None and not isinstance(light, SkyLight):
            return "Area", lambda: Area(context)
        return f"{kind.__name__} many times", lambda: Accumulated(context, kind(context))
    return kind.__name__, lambda: kind(context)


def without_lists(scene: GpuScene, caps: Caps) -> str:
    """Why this driver has no lists of a scene's triangles, as far as is known; empty: it may have."""
    if caps.compute:
        return scene.unlisted
    return f"lists of triangles need OpenGL 4.3, {caps.renderer} has {caps.version_code / 100:.1f}"


__all__ = ["Accumulated", "Area", "Listed", "Mapped", "Numbered", "Receiver", "Source", "source_of", "without_lists"]
