"""Renderer: the one place where a picture comes together: what the camera sees, each light's map, then light by light resolved."""

from __future__ import annotations

import contextlib
import math
import time
import weakref
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any, Self, get_args

import moderngl
import numpy as np
from numpy.typing import ArrayLike

from glshadow.core.cameras import Camera
from glshadow.core.decision import settle
from glshadow.core.lights import BRIGHTEST, DirectionalLight, Light, Lights
from glshadow.core.setting import Rule, as_float, as_path, instance, one_of, optional, several, shown, vector
from glshadow.core.shadow import Settled
from glshadow.core.spaces import Array
from glshadow.core.used import Used
from glshadow.errors import GlshadowError, ResourceError, SettingsError, warn
from glshadow.frame import OUTPUTS, Frame
from glshadow.gl.atlases import Atlases
from glshadow.gl.camera import Sight, draw_surface, look
from glshadow.gl.context import Backend, open_context
from glshadow.gl.geometry import GpuScene
from glshadow.gl.kept import Kept
from glshadow.gl.meshes import Meshes
from glshadow.gl.program import Programs
from glshadow.gl.queries import AnySamples
from glshadow.gl.readback import read
from glshadow.gl.resolve import Share, resolve
from glshadow.gl.screen import Samplers
from glshadow.gl.sources import Source, source_of, without_lists
from glshadow.gl.sources.refined import Refined
from glshadow.gl.sources.source import open_receiver
from glshadow.gl.targets import CameraTargets, clear_outputs
from glshadow.gl.work import Work
from glshadow.scene.arguments import picture_arguments
from glshadow.scene.mesh import Scene

AMBIENT, BACKGROUND = vector(3, 0.0, BRIGHTEST), vector(3, 0.0, 1.0)


class Renderer:
    """Renders scenes with shadows in an OpenGL context of its own, or in a given one.

    Parameters
    ----------
    backend : {"auto", "egl", "osmesa", "window"}
        How to get a headless context; auto tries them in this order.
    context : moderngl.Context, optional
        A context of the calling program: never released, and given back the state it had.

    Raises
    ------
    ContextError
        If there is no usable context: names every attempt and its remedy.
    SettingsError
        For another backend, and what is no context.
    """

    def __init__(self, backend: Backend = "auto", context: moderngl.Context | None = None) -> None:
        backend = one_of(*get_args(Backend))("backend", backend)
        self._context = open_context(backend, optional(instance(moderngl.Context))("context", context))
        self._furnished = False
        with self._context.drawing():
            self._furnish()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.release()

    def release(self) -> None:
        """Free what the renderer owns on the GPU, and its context if it is its own. May be called twice."""
        if self._context.released:
            return
        if self._context.lost:  # and everything in it
            self._context.release()
            return
        with self._context.drawing():
            for thing in self._kept():
                thing.release()
        self._context.release()

    @property
    def info(self) -> dict[str, Any]:
        """Backend, driver and its limits."""
        return dict(vars(self._context.caps))

    def render(
        self,
        scene: Scene,
        camera: Camera | None = None,
        lights: Lights = None,
        size: tuple[int, int] = (1280, 720),
        ambient: float | ArrayLike = 0.1,
        background: ArrayLike = (0.0, 0.0, 0.0),
        outputs: Sequence[str] = ("image", "visibility"),
    ) -> Frame:
        """One picture.

        Parameters
        ----------
        scene : Scene
        camera, lights : optional
            None: the scene's own.
        size : (2,) ints
            Width and height in pixels.
        ambient : float or (3,) floats
            Linear light that reaches every surface from everywhere; 0 or more.
        background : (3,) floats
            sRGB, each from 0 to 1.
        outputs : sequence of str
            What to read back: "image", "visibility", "linear", "depth", "depth_metric", "triangle", "shadow_maps", "timings".

        Raises
        ------
        SettingsError, SceneError, ResourceError, ShaderError
            Named errors; never a blank picture.
        """
        if self._context.released:
            raise GlshadowError("this renderer was released: make a new one")
        camera, lights, size = picture_arguments(scene, camera, lights, size)
        outputs = _checked_outputs(outputs)
        ambient_rgb, background_rgb = (
            _rgb(AMBIENT, "ambient", ambient),
            _rgb(BACKGROUND, "background", background),
        )
        with self._context.drawing():
            if not self._furnished:
                self._furnish()
            try:
                return self._frame(scene, camera, lights, size, frozenset(outputs), ambient_rgb, background_rgb)
            except GlshadowError:
                raise
            except BaseException as error:
                self._start_over()
                if isinstance(error, MemoryError):
                    raise ResourceError(
                        f"there is not enough memory for {size[0]} x {size[1]} pixels of {', '.join(outputs)}; "
                        "use a smaller picture"
                    ) from error
                raise
            finally:
                # moderngl binds again what was bound before, also a framebuffer released meanwhile: leave one that stays
                self._idle.use()
                self._meshes.sweep()

    def _frame(
        self,
        scene: Scene,
        camera: Camera,
        lights: tuple[Light, ...],
        size: tuple[int, int],
        outputs: frozenset[str],
        ambient: Array,
        background: Array,
    ) -> Frame:
        work = self._work(scene, camera, size, len(lights), outputs)
        clock = _Clock(self._context.ctx, "timings" in outputs)
        with clock("shadow"):
            sources, ready = self._sources_of(work, lights)
        with clock("surface"), self._covered:
            draw_surface(self._context, self._programs, work.scene, work.sight, work.targets)
        with clock("shadow"):
            used = tuple(ready.get(number) or source.prepare(work) for number, source in enumerate(sources))
        with clock("resolve"):
            # here, so that tiles are cleared and drawn in one go
            clear_outputs(self._context, work.targets, background)
            for number, (light, source) in enumerate(zip(lights, sources, strict=True)):
                resolve(work, Share(light, source.receiver(work), True, number, len(lights), ambient))
            if not lights:
                dark = DirectionalLight()
                resolve(work, Share(dark, open_receiver(work, dark), False, 0, 1, ambient))
        with clock("read"):
            results = read(outputs, work.sight, work.targets)
            if "shadow_maps" in outputs:
                results["shadow_maps"] = tuple(source.stored() for source in sources)
        self._context.check_errors("rendering")
        sight = work.sight
        if not self._covered.passed:
            warn(_nothing_in_view(scene, sight))
        used = tuple(replace(each, fallbacks=each.fallbacks + sight.fallbacks) for each in used)
        if clock.times is not None:
            results["timings"] = clock.times
        return Frame(scene=scene, camera=camera, lights=lights, size=sight.size, near=sight.near, far=sight.far, used=used,
                     outputs=results)  # fmt: skip

    # What is kept from frame to frame

    def _furnish(self) -> None:
        """Everything that is kept, still empty."""
        context, ctx = self._context, self._context.ctx
        self._programs = Programs(context)
        self._meshes = Meshes(context)
        self._samplers = Samplers.make(ctx)
        self._covered = AnySamples(context.gl)
        self._idle_color = ctx.renderbuffer((1, 1))
        self._idle = ctx.framebuffer([self._idle_color])
        self._idle.use()
        self._atlases = Atlases(context)
        self._scene: Kept[GpuScene] = Kept()
        self._targets: Kept[CameraTargets] = Kept()
        self._refined: Kept[Refined] = Kept()
        self._sight: tuple[Any, Sight] | None = None
        self._sources: dict[tuple[int, type[Source]], Source] = {}
        self._furnished = True

    def _kept(self) -> tuple[Any, ...]:
        """Everything that is kept, in the order of its release."""
        passes = (self._scene, self._targets, self._refined, self._programs, self._meshes, self._samplers)
        return (*passes, self._covered, self._atlases, self._idle, self._idle_color, *self._sources.values())

    def _start_over(self) -> None:
        """After Ctrl-C, which may come at any line, and what else nobody expects: nothing half made is kept."""
        self._furnished, old = False, self._kept()
        self._context.recover()
        self._furnish()
        for thing in old:
            thing.release()

    def _work(self, scene: Scene, camera: Camera, size: tuple[int, int], lights: int, outputs: frozenset[str]) -> Work:
        context, programs = self._context, self._programs
        gpu = self._scene.get(weakref.ref(scene), lambda: GpuScene(context, self._meshes, scene))
        key = (camera, size, gpu.identity)
        if self._sight is None or self._sight[0] != key:
            self._sight = (key, look(scene, gpu, camera, size, context.caps.clip_control))
        channels = 4 if gpu.textured else 2 if gpu.smooth else 1
        shape = (size, channels, lights, "visibility" in outputs, "linear" in outputs)
        targets = self._targets.get(shape, lambda: CameraTargets(context, *shape))
        self._atlases.begin()
        return Work(context, programs, self._samplers, self._atlases, gpu, self._sight[1], targets, self._refined)

    def _sources_of(self, work: Work, lights: tuple[Light, ...]) -> tuple[list[Source], dict[int, Used]]:
        """What each light is asked of, and what was used by those that had to be made to know whether they can be."""
        sources, ready = [], {}
        for number, light in enumerate(lights):
            settled = settle(light, without_lists(work.scene, work.caps))
            source = self._source(number, settled)
            source.claim(work, light, settled)
            if settled is not None and settled.asked.filter is None and not settled.filter.has_map:
                try:
                    ready[number] = source.prepare(work)
                except ResourceError as error:
                    work.scene.unlisted = str(error)
                    settled = settle(light, work.scene.unlisted)
                    source = self._source(number, settled)
                    source.claim(work, light, settled)
            sources.append(source)
        return sources, ready

    def _source(self, number: int, settled: Settled | None) -> Source:
        kind = source_of(settled, self._context.caps)
        kept = self._sources.get((number, kind))
        if kept is None:
            kept = self._sources[number, kind] = kind(self._context)
        return kept


def _rgb(rule: Rule, name: str, value: Any) -> Array:
    """One strength for all three colours, or one each."""
    one = as_float(value)
    return np.array(rule(name, value if math.isnan(one) else (one, one, one)))


def _checked_outputs(outputs: Sequence[str]) -> tuple[str, ...]:
    try:
        names: tuple[str, ...] = several(one_of(*OUTPUTS), "outputs")("outputs", outputs)
    except SettingsError:
        names = ()
    if not names:
        raise SettingsError(f"outputs must be some of {', '.join(OUTPUTS)}, got {shown(outputs)}")
    return names


class _Clock:
    """Seconds per stage, waiting for the GPU before and after; not wanted: costs nothing."""

    def __init__(self, ctx: moderngl.Context, wanted: bool) -> None:
        self._ctx = ctx
        self.times: dict[str, float] | None = {} if wanted else None

    @contextlib.contextmanager
    def __call__(self, name: str) -> Iterator[None]:
        if self.times is None:
            yield
            return
        self._ctx.finish()
        start = time.perf_counter()
        yield
        self._ctx.finish()
        self.times[name] = self.times.get(name, 0.0) + time.perf_counter() - start


def _nothing_in_view(scene: Scene, sight: Sight) -> str:
    low, high = ("(" + ", ".join(f"{x:.6g}" for x in point) + ")" for point in scene.bounds)
    return (
        f"nothing is in view: {scene.name} lies between {low} and {high}, and the camera {sight.camera}, "
        f"near {sight.near:g}, far {sight.far:g}"
    )


def render(
    scene: Any,
    camera: Camera | None = None,
    lights: Lights = None,
    size: tuple[int, int] = (1280, 720),
    path: Any = None,
    **options: Any,
) -> Frame:
    """One picture by a renderer of its own.

    Parameters
    ----------
    scene : Scene, path, trimesh.Trimesh, trimesh.Scene or pyrender.Scene
        Whatever `glshadow.load` takes.
    camera, lights, size
        As in Renderer.render.
    path : optional
        Also save it there.
    **options
        Further arguments of Renderer.render.
    """
    path = optional(as_path, "it is not saved")("path", path)
    if not isinstance(scene, Scene):
        from glshadow.scene.load import load

        scene = load(scene)
    with Renderer() as renderer:
        frame = renderer.render(scene, camera, lights, size, **options)
    if path is not None:
        frame.save(path)
    return frame
