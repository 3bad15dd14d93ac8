"""FrameContext: what all passes of one frame share."""

from __future__ import annotations

from dataclasses import dataclass

from glshadow.gl.driver.context import Caps, GLContext
from glshadow.gl.driver.program import Programs
from glshadow.gl.driver.targets import CameraTargets
from glshadow.gl.passes.atlases import Atlases
from glshadow.gl.passes.camera import CameraView
from glshadow.gl.passes.screen import Samplers
from glshadow.gl.scene.cookies import Cookies
from glshadow.gl.scene.geometry import GpuScene


@dataclass(frozen=True, eq=False)
class FrameContext:
    """One frame's scene, camera and render targets, and the caches that outlive the frame.

    Parameters
    ----------
    measured : bool
        Whether maps may be fitted to the camera's depth buffer; not for blended layers, of which it shows one at a time.
    """

    context: GLContext
    programs: Programs
    samplers: Samplers
    atlases: Atlases
    cookies: Cookies
    scene: GpuScene
    camera_view: CameraView
    targets: CameraTargets
    measured: bool = True

    @property
    def caps(self) -> Caps:
        """The driver's capabilities."""
        return self.context.caps
