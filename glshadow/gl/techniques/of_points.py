"""Triangle lists for given points, kept from call to call: those of the lights, within a limit of memory, and those that find the points'
own triangles."""

from __future__ import annotations

from collections.abc import Callable

import moderngl

from glshadow.derive.resolved import resolve_shadow
from glshadow.gl.driver.context import GLContext
from glshadow.gl.driver.targets import release
from glshadow.gl.frame_context import FrameContext
from glshadow.gl.passes.screen import camera_uniforms, draw_over
from glshadow.gl.techniques import technique_of
from glshadow.gl.techniques.listed import Listed
from glshadow.gl.techniques.technique import Technique
from glshadow.gl.techniques.uploaded import Uploaded
from glshadow.lights import DirectionalLight, Light
from glshadow.shadows.filters import Exact
from glshadow.shadows.shadow import Faces, Shadow

_KEPT = 1 << 29  # bytes
_MOST = 256  # lights whose lists are kept
_LIST_BYTES, _GRID_BYTES = 128, 1 << 21  # estimates of a light's lists: for each triangle, and in any case
_SOFT_BYTES = 24  # for each point, of a light that has a size
_ACROSS = DirectionalLight(direction=(-0.547, -0.743, -0.385), shadow=Shadow(filter=Exact(), faces=Faces.BOTH))
"""Points are looked up in lists along a direction to which the faces of few models are parallel: edge-on triangles are in no list."""


class PointTechniques:
    """Techniques by number of the light and name.

    The lists of as many lights as fit into the limit are kept; those of the others are built again in each call.
    """

    def __init__(self, context: GLContext) -> None:
        self._context = context
        self._made: dict[tuple[int, str], Technique] = {}
        self._finding: Listed | Uploaded | None = None

    def updated(self, frame: FrameContext, number: int, light: Light) -> Technique:
        """The technique of a light, whose filter tests triangles, with lists for the frame's scene.

        Raises
        ------
        ResourceError
            If they do not fit into the driver's buffers.
        """
        resolved = resolve_shadow(light)
        name, make = technique_of(light, resolved, self._context, frame.scene.capsules > 0)
        points = frame.targets.size[0] * frame.targets.size[1]
        size = _GRID_BYTES + _LIST_BYTES * frame.scene.count + _SOFT_BYTES * points * light.has_size
        slots = min(max(_KEPT // size, 1), _MOST)
        technique = self._technique(min(number, slots - 1), name, make)
        technique.allocate(frame, light, resolved)
        technique.update(frame)
        return technique

    def _technique(self, slot: int, name: str, make: Callable[[], Technique]) -> Technique:
        if (slot, name) not in self._made:
            self._made[slot, name] = make()
        return self._made[slot, name]

    def locate(self, frame: FrameContext, framebuffer: moderngl.Framebuffer) -> None:
        """Write into a framebuffer the triangle that each point is on.

        Raises
        ------
        ResourceError
            If the lists of all triangles do not fit into the driver's buffers.
        """
        if self._finding is None:
            self._finding = (Listed if self._context.caps.compute else Uploaded)(self._context)
        self._finding.list_all(frame, _ACROSS)
        receiver = self._finding.receiver(frame)
        defines = {
            **receiver.defines,
            "GLS_POINTS": frame.targets.points,
            "GLS_CAPSULES": frame.scene.capsules,
        }
        program = frame.programs.get("pass/resolve.vert", "pass/locate.frag", receiver.dialect, None, defines)
        program.set(**camera_uniforms(frame.scene, frame.camera_view, receiver.axes, receiver.offset))
        program.set(**receiver.uniforms)
        program.bind(**frame.targets.given, **receiver.textures)
        framebuffer.use()
        draw_over(self._context, program, frame.camera_view)
        program.unbind()

    def release(self) -> None:
        """Free the GPU memory."""
        release(*self._made.values(), self._finding)
