"""Renderer: the one place where a picture comes together: what the camera sees, each light's map, then light by light resolved."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any, Self

import moderngl
import numpy as np
from numpy.typing import ArrayLike

from glshadow.core.cameras import PerspectiveCamera
from glshadow.core.kernels import Exact
from glshadow.core.lights import DirectionalLight, Light, PointLight, SpotLight
from glshadow.core.metric import Target
from glshadow.core.spaces import Array, finite_vector
from glshadow.core.used import Used
from glshadow.errors import GlshadowError, ResourceError, SceneError, SettingsError
from glshadow.frame import OUTPUTS, Frame
from glshadow.gl.camera import Sight, draw_surface, look
from glshadow.gl.caster import Map, draw_casters
from glshadow.gl.context import Backend, open_context
from glshadow.gl.entry_points import AnySamples
from glshadow.gl.geometry import GpuScene
from glshadow.gl.lists import Lists
from glshadow.gl.maps import place, plan
from glshadow.gl.meshes import Meshes
from glshadow.gl.numbers import Numbers
from glshadow.gl.program import Programs
from glshadow.gl.readback import read
from glshadow.gl.receiver import Asked
from glshadow.gl.refine import Refined
from glshadow.gl.resolve import Samplers, Share, resolve
from glshadow.gl.targets import Atlas, CameraTargets, clear_outputs
from glshadow.scene.mesh import Scene, warn


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
    """

    def __init__(self, backend: Backend = "auto", context: moderngl.Context | None = None) -> None:
        self._context = open_context(backend, context)
        with self._context.drawing():
            ctx = self._context.ctx
            self._programs = Programs(self._context)
            self._meshes = Meshes(self._context)
            self._samplers = Samplers.make(ctx)
            self._covered = AnySamples(self._context.gl)
            self._idle_color = ctx.renderbuffer((1, 1))
            self._idle = ctx.framebuffer([self._idle_color])
            self._idle.use()
        self._scene: GpuScene | None = None
        self._sight: Sight | None = None
        self._targets: CameraTargets | None = None
        self._atlases: dict[Target, Atlas] = {}
        self._refined: Refined | None = None
        self._lists: dict[int, Lists | Numbers] = {}

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.release()

    def release(self) -> None:
        """Free what the renderer owns on the GPU, and its context if it is its own. May be called twice."""
        if self._context.released:
            return
        with self._context.drawing():
            owned = (
                self._programs,
                self._meshes,
                self._samplers,
                self._covered,
                self._idle,
                self._idle_color,
                self._scene,
                self._refined,
                self._targets,
            )
            for thing in (*owned, *self._atlases.values(), *self._lists.values()):
                if thing is not None:
                    thing.release()
        self._atlases.clear()
        self._lists.clear()
        self._context.release()

    @property
    def info(self) -> dict[str, Any]:
        """Backend, driver and its limits."""
        return dict(vars(self._context.caps))

    def render(
        self,
        scene: Scene,
        camera: PerspectiveCamera | None = None,
        lights: Sequence[Light] | None = None,
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
            Linear light that reaches every surface from everywhere.
        background : (3,) floats
            sRGB, 0..1.
        outputs : sequence of str
            What to read back: "image", "visibility", "linear", "depth", "depth_metric", "triangle", "shadow_maps", "timings".

        Raises
        ------
        SettingsError, SceneError, ResourceError, ShaderError
            Named errors; never a blank picture.
        """
        if self._context.released:
            raise GlshadowError("this renderer was released: make a new one")
        camera, lights = _checked(scene, camera, lights, size, outputs)
        ambient_rgb = finite_vector("ambient", np.broadcast_to(np.asarray(ambient, dtype=np.float64), (3,)))
        background_rgb = finite_vector("background", background)
        with self._context.drawing():
            try:
                return _Frame(self, scene, camera, lights, size, outputs).run(ambient_rgb, background_rgb)
            except MemoryError as error:
                raise ResourceError(
                    f"there is not enough memory for {size[0]} x {size[1]} pixels of {', '.join(outputs)}; use a smaller picture"
                ) from error
            finally:
                # moderngl binds again what was bound before, also a framebuffer released meanwhile: leave one that stays
                self._idle.use()
                self._meshes.sweep()


def _checked(
    scene: Scene,
    camera: PerspectiveCamera | None,
    lights: Sequence[Light] | None,
    size: tuple[int, int],
    outputs: Sequence[str],
) -> tuple[PerspectiveCamera, tuple[Light, ...]]:
    if not isinstance(scene, Scene):
        raise SceneError(f"render needs a glshadow.Scene (see glshadow.load), got {type(scene).__name__}")
    if camera is not None and not isinstance(camera, PerspectiveCamera):
        raise SettingsError(f"camera must be a glshadow.PerspectiveCamera or None, got {camera!r}")
    if isinstance(lights, DirectionalLight | SpotLight | PointLight):
        lights = (lights,)
    lights = scene.lights if lights is None else tuple(lights)
    for light in lights:
        if not isinstance(light, DirectionalLight | SpotLight | PointLight):
            raise SettingsError(f"lights must be DirectionalLight, SpotLight or PointLight, got {light!r}")
    if len(size) != 2 or not all(isinstance(n, int | np.integer) and n >= 1 for n in size):
        raise SettingsError(f"size must be two positive integers (width, height), got {size!r}")
    unknown = set(outputs) - set(OUTPUTS)
    if unknown or not outputs:
        raise SettingsError(f"outputs must be some of {', '.join(OUTPUTS)}, got {list(outputs)!r}")
    return scene.camera if camera is None else camera, lights


class _Frame:
    """The work of one frame, and its clock."""

    def __init__(
        self,
        renderer: Renderer,
        scene: Scene,
        camera: PerspectiveCamera,
        lights: tuple[Light, ...],
        size: tuple[int, int],
        outputs: Sequence[str],
    ) -> None:
        self.r, self.context = renderer, renderer._context
        self.scene, self.lights, self.outputs = scene, lights, frozenset(outputs)
        self.timings: dict[str, float] = {}
        self.gpu = self._gpu_scene()
        self.sight = self._sight(camera, (int(size[0]), int(size[1])))

    def run(self, ambient: Array, background: Array) -> Frame:
        context, programs, samplers = self.context, self.r._programs, self.r._samplers
        whole = [self._whole(light) for light in self.lights]
        plans = [
            plan(light, self.scene, self.gpu, self.sight, context.caps, every)
            for light, every in zip(self.lights, whole, strict=True)
        ]
        maps = place(context, self.r._atlases, plans, whole)
        targets = self._targets()
        with self._clock("surface"), self.r._covered:
            draw_surface(context, programs, self.gpu, self.sight, targets)
        used: list[Used] = []
        shadows: list[Map | Lists | Numbers | None] = list(maps)
        with self._clock("shadow"):
            for i, (each, light, shadow_map) in enumerate(zip(plans, self.lights, maps, strict=True)):
                if isinstance(each.filter, Exact):
                    shadows[i] = lists = self._candidates(i)
                    used.append(replace(each, draws=int(lists.update(programs, self.gpu, light)), links=lists.links))
                    continue
                draws = draw_casters(context, programs, self.gpu, light, shadow_map) if shadow_map else 0
                used.append(replace(each, views=shadow_map.views if shadow_map else (), draws=draws))
        with self._clock("resolve"):
            clear_outputs(context, targets, background)  # here, so that tiles are cleared and drawn in one go
            for i, light in enumerate(self.lights):
                share = Share(light, self._asked(targets, light, shadows[i]), i, len(self.lights), ambient)
                resolve(context, programs, samplers, self.gpu, self.sight, targets, share)
            if not self.lights:
                resolve(context, programs, samplers, self.gpu, self.sight, targets, Share(None, None, 0, 1, ambient))
        with self._clock("read"):
            results = read(self.outputs, self.sight, targets, maps)
        context.check_errors("rendering")
        if not self.r._covered.passed:
            warn(_nothing_in_view(self.scene, self.sight))
        return self._result(used, results)

    def _result(self, used: list[Used], results: dict[str, Any]) -> Frame:
        sight = self.sight
        return Frame(
            scene=self.scene,
            camera=sight.camera,
            lights=self.lights,
            size=sight.size,
            near=sight.near,
            far=sight.far,
            used=tuple(used),
            timings=self.timings if "timings" in self.outputs else None,
            **results,
        )

    @contextlib.contextmanager
    def _clock(self, name: str) -> Iterator[None]:
        if "timings" not in self.outputs:
            yield
            return
        self.context.ctx.finish()
        start = time.perf_counter()
        yield
        self.context.ctx.finish()
        self.timings[name] = self.timings.get(name, 0.0) + time.perf_counter() - start

    def _whole(self, light: Light) -> bool:
        """Whether casters that darken nothing are drawn too: where the map itself is looked at, or a bias is tried out."""
        return "shadow_maps" in self.outputs or (light.shadow is not None and light.shadow.bias is not None)

    # What is kept from frame to frame

    def _asked(self, targets: CameraTargets, light: Light, shadow: Map | Lists | Numbers | None) -> Asked:
        """What the resolve pass asks: the visibility itself, where an exact filter wants several points in a pixel."""
        kind = light.shadow.filter if light.shadow else None
        if not isinstance(shadow, Lists) or not isinstance(kind, Exact) or kind.samples == 1:
            return shadow
        kept = self.r._refined
        if kept is None or kept.targets is not targets or kept.samples != kind.samples:
            if kept is not None:
                self.r._refined = None
                kept.release()
            self.r._refined = kept = Refined(self.context, targets, kind.samples)
        return kept.draw(self.r._programs, self.r._samplers, self.gpu, self.sight, light, shadow)

    def _candidates(self, light: int) -> Lists | Numbers:
        kept = self.r._lists.get(light)
        if kept is None:
            kept = self.r._lists[light] = Lists(self.context) if self.context.caps.compute else Numbers(self.context)
        return kept

    def _gpu_scene(self) -> GpuScene:
        kept = self.r._scene
        if kept is None or kept.scene() is not self.scene:
            if kept is not None:
                self.r._scene = self.r._sight = None
                kept.release()
            self.r._scene = kept = GpuScene(self.context, self.r._meshes, self.scene)
        return kept

    def _sight(self, camera: PerspectiveCamera, size: tuple[int, int]) -> Sight:
        kept = self.r._sight
        if kept is None or (kept.camera, kept.size) != (camera, size):
            self.r._sight = kept = look(self.scene, self.gpu, camera, size, self.context.caps.clip_control)
        return kept

    def _targets(self) -> CameraTargets:
        channels = 4 if self.gpu.textured else 2 if self.gpu.smooth else 1
        key = (self.sight.size, channels, len(self.lights), "visibility" in self.outputs, "linear" in self.outputs)
        kept = self.r._targets
        if kept is None or kept.key != key:
            if kept is not None:
                self.r._targets = None
                kept.release()
            self.r._targets = kept = CameraTargets(self.context, *key)
        return kept


def _nothing_in_view(scene: Scene, sight: Sight) -> str:
    camera = sight.camera
    low, high, position, target = (
        "(" + ", ".join(f"{x:.6g}" for x in point) + ")" for point in (*scene.bounds, camera.position, camera.target)
    )
    return (
        f"nothing is in view: {scene.name} lies between {low} and {high}, and the camera at {position} looks at {target} "
        f"with fov {camera.fov_y:g}, near {sight.near:g}, far {sight.far:g}"
    )


def render(
    scene: Any,
    camera: PerspectiveCamera | None = None,
    lights: Sequence[Light] | None = None,
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
    if not isinstance(scene, Scene):
        from glshadow.scene.load import load

        scene = load(scene)
    with Renderer() as renderer:
        frame = renderer.render(scene, camera, lights, size, **options)
    if path is not None:
        frame.save(path)
    return frame
