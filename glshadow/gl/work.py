"""Work: all that the passes of one frame share."""

from __future__ import annotations

from dataclasses import dataclass

from glshadow.gl.atlases import Atlases
from glshadow.gl.camera import Sight
from glshadow.gl.context import Caps, GLContext
from glshadow.gl.cookies import Cookies
from glshadow.gl.geometry import GpuScene
from glshadow.gl.program import Programs
from glshadow.gl.screen import Samplers
from glshadow.gl.targets import CameraTargets


@dataclass(frozen=True, eq=False)
class Work:
    """One frame's scene, camera and buffers, and what the context keeps from frame to frame."""

    context: GLContext
    programs: Programs
    samplers: Samplers
    atlases: Atlases
    cookies: Cookies
    scene: GpuScene
    sight: Sight
    targets: CameraTargets

    @property
    def caps(self) -> Caps:
        """What the driver can do."""
        return self.context.caps
