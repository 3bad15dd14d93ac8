"""ResourceCache: GPU resources that a renderer keeps from frame to frame, and the context of each frame."""

from __future__ import annotations

import weakref
from typing import Any

from glshadow.arguments import FrameRequest
from glshadow.core.outputs import CENTRES
from glshadow.derive.look import Look
from glshadow.gl.driver.context import GLContext
from glshadow.gl.driver.kept import Kept
from glshadow.gl.driver.program import Programs
from glshadow.gl.driver.queries import AnySamples
from glshadow.gl.driver.targets import CameraTargets, SurfaceTargets, released_on_error
from glshadow.gl.frame_context import FrameContext
from glshadow.gl.layers import Layers, opaque_scene
from glshadow.gl.passes.atlases import Atlases
from glshadow.gl.passes.camera import CameraView, draw_surface, view_scene
from glshadow.gl.passes.points import ROW, PointTargets, PointView
from glshadow.gl.passes.primary import find_primary
from glshadow.gl.passes.readback import average_samples, read_centres, read_means
from glshadow.gl.passes.samples import Samples
from glshadow.gl.passes.screen import Samplers
from glshadow.gl.passes.translucent import TranslucentMaps
from glshadow.gl.passes.transmittance import Tinted, read_transmittance
from glshadow.gl.scene.cookies import Cookies
from glshadow.gl.scene.geometry import GpuScene
from glshadow.gl.scene.kept_meshes import Meshes
from glshadow.gl.techniques import Techniques
from glshadow.gl.techniques.of_points import PointTechniques
from glshadow.scene.nodes import Scene


class ResourceCache:
    """All cached resources of a renderer, empty at first.

    Attributes
    ----------
    programs, meshes, techniques, translucent_maps, covered, points, point_techniques
        Created once, filled by frames.
    scene : Kept
        The scene of the last frame.
    seen : (CameraView, identity of its targets, samples), optional
        Cache key of the surface buffer's content.
    any_surface : bool
        Whether any surface is in view.
    primary_fallback : str
        Why the surface buffer shows what GL rasterised and not what the pixels' rays meet; empty: it shows what the rays meet.
    """

    def __init__(self, context: GLContext) -> None:
        ctx = context.ctx
        self.context = context
        self.programs = Programs(context)
        self.meshes = Meshes(context)
        self.covered = AnySamples(context.gl)
        self.techniques = Techniques(context)
        self.translucent_maps = TranslucentMaps(context)
        self.points: Kept[PointTargets] = Kept()
        self.point_techniques = PointTechniques(context)
        self.scene: Kept[GpuScene] = Kept()
        self.seen: tuple[CameraView, int, int] | None = None
        self.any_surface = False
        self.primary_fallback = ""
        self._samplers = Samplers.make(ctx)
        self.atlases = Atlases(context)
        self.cookies = Cookies(context)
        self.layers = Layers(context, self.meshes)
        self._targets: Kept[CameraTargets] = Kept()
        self._samples: Kept[Samples] = Kept()
        self.camera_view: tuple[Any, CameraView] | None = None
        self._idle_color = ctx.renderbuffer((1, 1))
        self._idle = ctx.framebuffer([self._idle_color])
        self._idle.use()

    def frame_context(self, request: FrameRequest, pattern: tuple[int, int]) -> FrameContext:
        """The context of one frame; `pattern`: columns and rows of pixels that are drawn for each pixel of the image."""
        context, scene, camera, size = self.context, request.scene, request.camera, request.size
        lights, samples, outputs = len(request.lights), request.look.samples, request.outputs
        gpu = self._opaque(scene)
        key = (camera, size, gpu.identity)
        if self.camera_view is None or self.camera_view[0] != key:
            self.camera_view = (key, view_scene(gpu, camera, size, context.caps.clip_control))
        several = samples > 1
        shape = (
            (size[0] * pattern[0], size[1] * pattern[1]),
            1 if pattern != (1, 1) else samples,
            gpu.channels,
            max(lights, 1) if several else lights,
            several or "visibility" in outputs,
            pattern != (1, 1) or not outputs.isdisjoint(("linear", "alpha")),
            gpu.features.emits,
        )
        targets = self._targets.get(shape, lambda: CameraTargets(context, *shape))
        self.atlases.begin()
        camera_view = self.camera_view[1]
        return FrameContext(
            context, self.programs, self._samplers, self.atlases, self.cookies, gpu, camera_view, targets
        )

    def _opaque(self, scene: Scene) -> GpuScene:
        """The scene without what blends, kept until another one is drawn."""
        before = self.scene.thing.leave() if self.scene.thing and self.scene.differs(weakref.ref(scene)) else None
        with released_on_error([before] if before else []):
            return self.scene.get(weakref.ref(scene), lambda: opaque_scene(self.context, self.meshes, scene, before))

    def point_targets(self, count: int, normals: bool) -> PointTargets:
        """Textures for so many points, kept while others have the same size."""
        shape = (min(count, ROW), -(-count // ROW), normals)
        if self.points.differs(shape):
            self._idle.use()
        return self.points.get(shape, lambda: PointTargets(self.context, count, normals))

    def point_context(self, scene: Scene, targets: PointTargets) -> FrameContext:
        """The context in which given points receive light."""
        gpu = self._opaque(scene)
        view = PointView.of(gpu, targets.size)
        self.atlases.begin()
        return FrameContext(
            self.context, self.programs, self._samplers, self.atlases, self.cookies, gpu, view, targets, measured=False
        )

    def samples(self, frame: FrameContext) -> Samples:
        """The per-sample resources of a multisampled frame."""
        return self._samples.get(frame.targets.identity, lambda: Samples(frame))

    def read(
        self, frame: FrameContext, outputs: frozenset[str], lights: Tinted, look: Look, pattern: tuple[int, int]
    ) -> dict[str, Any]:
        """A frame's outputs except maps and timings. Outputs that only a pixel's centre has are drawn for it."""
        targets, transparent = frame.targets, look.background is None
        if pattern == (1, 1):
            results = read_means(outputs, targets, len(lights), transparent)
        else:
            fine = read_means(outputs | {"linear", "alpha"}, targets, len(lights), transparent)
            results = average_samples(outputs, fine, pattern, look)
        if outputs.isdisjoint(CENTRES):
            return results
        if look.samples == 1:
            return results | self._centres(frame, outputs, lights, targets.fine)
        # no sample lies at the centre of a pixel
        middle = SurfaceTargets(self.context, frame.camera_view.size, targets.surface.components, "the pixels' middles")
        draw_surface(self.context, frame.programs, frame.scene, frame.camera_view, middle.framebuffer)
        find_primary(frame, middle)
        results |= self._centres(frame, outputs, lights, middle)
        self.rest()
        middle.release()
        return results

    @staticmethod
    def _centres(
        frame: FrameContext, outputs: frozenset[str], lights: Tinted, surface: SurfaceTargets
    ) -> dict[str, Any]:
        results = read_centres(outputs, frame.scene, frame.camera_view, surface)
        if "transmittance" in outputs:
            results["transmittance"] = read_transmittance(frame, surface, lights)
        return results

    def rest(self) -> None:
        """Called between frames. moderngl restores the previous framebuffer even if it was released meanwhile: bind one that stays."""
        self._idle.use()
        self.meshes.sweep()
        self.cookies.sweep()

    def release(self) -> None:
        """Free the GPU memory, dependent resources first."""
        for thing in (self.scene, self._targets, self._samples, self.programs, self.meshes, self._samplers, self.covered,
                      self.atlases, self.cookies, self._idle, self._idle_color, self.techniques, self.layers,
                      self.translucent_maps, self.points, self.point_techniques):  # fmt: skip
            thing.release()
