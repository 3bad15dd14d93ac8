"""Renderer: the one place where a picture comes together: what the camera sees, each light's map, then light by light resolved."""

from __future__ import annotations

from collections.abc import Generator, Iterable, Sequence
from dataclasses import replace
from functools import partial
from typing import Any, Self

import moderngl
from numpy.typing import ArrayLike

from glshadow.budget import Budget, Choices
from glshadow.core.cameras import Camera
from glshadow.core.lights import DirectionalLight, Light, Lights
from glshadow.core.look import AMBIENT, BACKGROUND, Ambient, Look, look_of
from glshadow.core.sampling import grid
from glshadow.core.setting import as_path, instance, optional, shown
from glshadow.errors import GlshadowError, GlshadowWarning, ResourceError, SettingsError, unexpected, warn
from glshadow.frame import Frame, checked_outputs
from glshadow.gl.camera import draw_surface, nothing_in_view
from glshadow.gl.clock import Clock
from glshadow.gl.context import Backend, backend_of, open_context
from glshadow.gl.glass import Panes, untinted
from glshadow.gl.primary import find_primary
from glshadow.gl.resolve import Share, resolve
from glshadow.gl.sources import Source
from glshadow.gl.sources.source import open_receiver
from glshadow.gl.store import Store
from glshadow.gl.targets import clear_outputs
from glshadow.gl.work import Work
from glshadow.scene.arguments import as_scene, picture_arguments
from glshadow.scene.mesh import Scene

_EVERY_SAMPLE = "all {} samples of every pixel are shaded: collecting those that differ needs OpenGL 4.3, {} has {:.1f}"

_OF_NUMBERS = (ArithmeticError, LookupError, ValueError)
"""What formulas raise where they are wrong. What is kept gets its key once it is whole, so that they leave nothing half made."""
_DEFECTS = (AssertionError, AttributeError, TypeError, moderngl.Error)
"""What else only a defect raises; signal handlers may raise the rest, at any line."""


class Renderer:
    """Renders scenes with shadows in an OpenGL context of its own, or in a given one.

    Parameters
    ----------
    backend : {"auto", "egl", "osmesa", "window"}
        How to get a headless context; auto tries them in this order.
    context : moderngl.Context, optional
        A context of the calling program: never released, and given back the state it had.
    device : int, optional
        Which of EGL's devices, as `glshadow doctor` lists them; None: the first, a GPU where there is one.

    Raises
    ------
    ContextError
        If there is no usable context: names every attempt and its remedy.
    SettingsError
        For another backend, and what is no context.
    """

    def __init__(
        self, backend: Backend = "auto", context: moderngl.Context | None = None, device: int | None = None
    ) -> None:
        backend = backend_of(backend, device)
        self._choices = Choices()
        self._context = open_context(backend, optional(instance(moderngl.Context))("context", context))
        self._store: Store | None = None
        with self._context.drawing():
            self._store = Store(self._context)

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
        if self._store is not None:
            with self._context.drawing():
                self._store.release()
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
        ambient: Ambient = AMBIENT,
        background: ArrayLike | None = BACKGROUND,
        outputs: Sequence[str] = ("image", "visibility"),
        samples: int = 1,
        max_wrong: float | None = None,
        max_ms: float | None = None,
    ) -> Frame:
        """One picture.

        Parameters
        ----------
        scene : Scene
        camera, lights : optional
            None: the scene's own.
        size : (2,) ints
            Width and height in pixels.
        ambient : float, (3,) floats or a pair of these
            Linear light that reaches every surface from everywhere; 0 or more. Of a pair the first comes from above, the second
            from below, blended by the height of the normal.
        background : (3,) floats or None
            sRGB, each from 0 to 1; None: transparent.
        outputs : sequence of str
            What to read back: see `Frame`.
        samples : int
            1, 4, 8 or 16 in each pixel, a grid. Image, linear and alpha are their mean in linear light, visibility the mean of those
            that see a surface; the other outputs are those of the pixel's middle. Pixels whose samples all see one smooth surface,
            and whose neighbours are as visible to every light, are shaded once.
        max_wrong, max_ms : float, optional
            Share of wrong pixels, and milliseconds, that shadows may cost: settings that lights leave to be derived are then the
            cheapest that are so good, or the best that are so fast. They are tried on the first such picture of a scene, some fifty
            frames, and kept while scene, size and the lights' kinds and settings stay; `used[i].why` says what was found.

        Raises
        ------
        SettingsError, SceneError, ResourceError, ShaderError
            Named errors; never a blank picture.
        """
        if self._context.released:
            raise GlshadowError("this renderer was released: make a new one")
        camera, lights, size = picture_arguments(scene, camera, lights, size)
        outputs = checked_outputs(outputs)
        look = look_of(ambient, background, samples)
        budget = Budget(max_wrong=max_wrong, max_ms=max_ms)
        if budget.given:

            def draw(lights: Sequence[Light], outputs: tuple[str, ...], samples: int = 1) -> Frame:
                return self.render(scene, camera, lights, size, ambient, background, outputs, samples)

            last = partial(draw, samples=samples)
            return self._choices.render(draw, last, scene, lights, size, budget, tuple(outputs))
        with self._context.drawing():
            if self._store is None:  # making it was interrupted
                self._store = Store(self._context)
            try:
                return self._frame(self._store, scene, camera, lights, size, frozenset(outputs), look)
            except (GlshadowError, GlshadowWarning):
                self._context.recover()
                raise
            except _OF_NUMBERS as error:
                self._context.recover()
                raise unexpected(error, f"scene {scene.name}, {camera}, lights {list(lights)}, size {size}") from error
            except BaseException as error:
                self._start_over()
                if isinstance(error, MemoryError):
                    raise ResourceError(
                        f"there is not enough memory for {size[0]} x {size[1]} pixels of {', '.join(outputs)}; "
                        "use a smaller picture"
                    ) from error
                if isinstance(error, _DEFECTS):
                    raise unexpected(
                        error, f"scene {scene.name}, {camera}, lights {list(lights)}, size {size}"
                    ) from error
                raise
            finally:
                if self._context.gl.failed:
                    self._start_over()
                if self._store is not None:
                    self._store.rest()

    def sequence(
        self,
        scene: Scene,
        cameras: Iterable[Camera],
        lights: Lights = None,
        size: tuple[int, int] = (1280, 720),
        **options: Any,
    ) -> Generator[Frame]:
        """One picture after another of the same scene: each as `render` gives it. What does not depend on the camera is made once.

        Parameters
        ----------
        scene : Scene
        cameras : iterable of cameras
            Taken one by one, when the next picture is asked for.
        lights, size, **options
            As in `render`.

        Yields
        ------
        Frame

        Raises
        ------
        SettingsError, SceneError
            At once, but for a camera that is none: when its turn comes, with its number.
        """
        if unknown := set(options) - {"ambient", "background", "outputs", "samples", "max_wrong", "max_ms"}:
            raise SettingsError(f"sequence has no {', '.join(sorted(map(repr, unknown)))}: it takes what render takes")
        _, lights, size = picture_arguments(scene, None, lights, size)
        look_of(options.get("ambient", AMBIENT), options.get("background", BACKGROUND), options.get("samples", 1))
        checked_outputs(options.get("outputs", ("image",)))
        try:
            views = iter(cameras)
        except TypeError:
            raise SettingsError(f"cameras must be a sequence of cameras, got {shown(cameras)}") from None

        def frames() -> Generator[Frame]:
            for number, camera in enumerate(views):
                if not isinstance(camera, Camera):
                    raise SettingsError(f"cameras[{number}] must be a camera, got {shown(camera)}")
                yield self.render(scene, camera, lights, size, **options)

        return frames()

    def _start_over(self) -> None:
        """After Ctrl-C, which may come at any line, and where memory was short: nothing half made is kept."""
        old, self._store = self._store, None
        self._context.recover()
        self._context.gl.failed = False
        self._store = Store(self._context)
        if old is not None:
            old.release()

    def _frame(
        self,
        store: Store,
        scene: Scene,
        camera: Camera,
        lights: tuple[Light, ...],
        size: tuple[int, int],
        outputs: frozenset[str],
        look: Look,
    ) -> Frame:
        caps = self._context.caps
        # without atomics every sample is shaded, as a pixel of a larger picture
        spread = (1, 1) if caps.compute else grid(look.samples)
        work = store.work(scene, camera, size, spread, len(lights), outputs, look.samples)
        clock = Clock(self._context, "timings" in outputs)
        with clock("shadow"):
            sources, ready = store.sources.claim(work, lights)
        targets, sight = work.targets, work.sight
        self._see(store, work, look.samples, clock)
        with clock("shadow"):
            used = tuple(ready.get(number) or source.prepare(work) for number, source in enumerate(sources))
            panes = store.glasses.panes(work, lights)
        with clock("resolve"):
            # here, so that tiles are cleared and drawn in one go
            clear_outputs(self._context, targets, look.linear_background, look.background is None)
            shares = self._shares(work, lights, sources, panes, look)
            used = tuple(source.amended(each) for source, each in zip(sources, used, strict=True))
            for share in shares:
                resolve(work, share)
        if targets.samples > 1:
            with clock("samples"):
                store.several(work).shade(
                    work, shares, look.linear_background, look.background is None, "visibility" in outputs
                )
        with clock("read"):
            results = store.read(work, outputs, len(lights), look, spread)
            if "shadow_maps" in outputs:
                results["shadow_maps"] = tuple(source.stored() for source in sources)
        self._context.check_errors("rendering")
        if not store.something:
            warn(nothing_in_view(scene, sight))
        fallbacks = sight.fallbacks + ((store.missed,) if store.missed else ())
        if spread != (1, 1):
            fallbacks += (_EVERY_SAMPLE.format(look.samples, caps.renderer, caps.version_code / 100),)
        used = tuple(
            replace(each, fallbacks=each.fallbacks + untinted(work.scene, light) + fallbacks)
            for each, light in zip(used, lights, strict=True)
        )
        if clock.wanted:
            results["timings"] = clock.times()
        return Frame(scene=scene, camera=camera, lights=lights, size=size, near=sight.near, far=sight.far, used=used,
                     outputs=results, samples=look.samples, origin=work.scene.origin)  # fmt: skip

    def _see(self, store: Store, work: Work, samples: int, clock: Clock) -> None:
        """Draw what the camera sees, unless it is there from the last frame."""
        key = (work.sight, work.targets.identity, samples)
        if store.seen == key:
            return
        store.seen = None
        with clock("surface"), store.covered:
            draw_surface(work.context, work.programs, work.scene, work.sight, work.targets.fine.framebuffer, samples)
        with clock("surface"):
            store.missed = find_primary(work, work.targets.fine, work.targets.samples)
        if work.targets.samples > 1:
            with clock("samples"):
                store.several(work).fill(work)
        store.something = store.covered.passed
        store.seen = key

    def _shares(
        self,
        work: Work,
        lights: tuple[Light, ...],
        sources: Sequence[Source],
        panes: Sequence[Panes | None],
        look: Look,
    ) -> tuple[Share, ...]:
        if not lights:
            dark = DirectionalLight(intensity=0.0)
            return (Share(dark, open_receiver(work, dark), 0, 1, look.ambient, look.linear_background),)
        several = work.targets.samples > 1
        receivers = [source.marking_receiver(work) if several else source.receiver(work) for source in sources]
        return tuple(
            Share(light, receiver, number, len(lights), look.ambient, look.linear_background, tint)
            for number, (light, receiver, tint) in enumerate(zip(lights, receivers, panes, strict=True))
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
    scene = as_scene(scene)
    with Renderer() as renderer:
        frame = renderer.render(scene, camera, lights, size, **options)
    if path is not None:
        frame.save(path)
    return frame
