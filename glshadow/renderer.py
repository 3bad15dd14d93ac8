"""Renderer: draws one frame: camera pass, each light's shadow, lighting, read-back. Also the visibility of lights from given points."""

from __future__ import annotations

from collections.abc import Generator, Iterable, Iterator, Sequence
from functools import partial
from typing import TypedDict, TypeVar, Unpack

import moderngl
import numpy as np
from numpy.typing import ArrayLike, NDArray

from glshadow.arguments import DEFAULT_SIZE, frame_arguments, frame_request
from glshadow.budget import Budget, Choices
from glshadow.core.cameras import Camera
from glshadow.core.outputs import NAMES, checked_outputs
from glshadow.core.sampling import DEFAULT_SAMPLES
from glshadow.core.setting import shown
from glshadow.core.tone import Exposure
from glshadow.derive.backdrop import place_before
from glshadow.derive.look import OWN_BACKGROUND, Ambient, look_of
from glshadow.errors import SettingsError
from glshadow.frame import Frame
from glshadow.gl.draw import draw_frame
from glshadow.gl.driver.context import Backend
from glshadow.gl.points import visibility_of_points
from glshadow.lifetime import Lifetime
from glshadow.lights import Light, Lights
from glshadow.point_arguments import Progress, point_request
from glshadow.scene.nodes import Scene
from glshadow.traced import drawn_part, with_traced

T = TypeVar("T")

DEFAULT_OUTPUTS = ("image", "visibility")


class RenderOptions(TypedDict, total=False):
    """Keyword arguments of `Renderer.render` except scene, camera, lights and size; described there."""

    ambient: Ambient | None
    background: ArrayLike | str | None
    exposure: Exposure
    tone: str
    outputs: str | Sequence[str]
    samples: int
    max_wrong: float | None
    max_ms: float | None


class Renderer(Lifetime):
    """Renders scenes with shadows, in an OpenGL context of its own or in a given one.

    Parameters
    ----------
    backend : {"auto", "egl", "osmesa", "window"}
        How to create a headless context; auto tries egl, osmesa, window in this order.
    context : moderngl.Context, optional
        A context of the calling program. It is never released, and its state is restored after each call.
    device : int, optional
        Index of the EGL device, as listed by `glshadow doctor`; None: the first one, a GPU if there is one.

    Raises
    ------
    ContextError
        If there is no usable context; the message lists every attempt and its remedy.
    SettingsError
        For an unknown backend, or if `context` is not a context.
    """

    def __init__(
        self, backend: Backend = "auto", context: moderngl.Context | None = None, device: int | None = None
    ) -> None:
        self._choices = Choices()
        super().__init__(backend, context, device)

    def render(
        self,
        scene: Scene,
        camera: Camera | None = None,
        lights: Lights = None,
        size: tuple[int, int] = DEFAULT_SIZE,
        ambient: Ambient | None = None,
        background: ArrayLike | str | None = OWN_BACKGROUND,
        outputs: str | Sequence[str] = DEFAULT_OUTPUTS,
        samples: int = DEFAULT_SAMPLES,
        max_wrong: float | None = None,
        max_ms: float | None = None,
        exposure: Exposure = "scene",
        tone: str = "neutral",
    ) -> Frame:
        """Render one frame.

        Parameters
        ----------
        scene : Scene
        camera, lights : optional
            None: the scene's own.
        size : (2,) ints
            Width and height in pixels.
        ambient : float, (3,) floats or a pair of these, optional
            Linear light that reaches every surface from all directions; 0 or more. In a pair, the first comes from above, the second from
            below, blended by the normal's height. None: that of the scene's look with lights from all around; with others (0.27, 0.12),
            times the light that the exposure shows as white.
        background : (3,) floats, "look" or None
            sRGB, each in 0..1; "look": that of the scene's look, see `load`; None: transparent.
        outputs : str or sequence of str
            Outputs to read back: names of properties of `Frame`, or "all" for those that the GPU draws: not `blocker` and
            `blocker_distance`, which need embreex.
        samples : int
            Samples per pixel in a grid: 1, 4, 8 or 16. Image, linear and alpha are their mean in linear light, visibility the mean of those
            that see a surface; all other outputs are those of the pixel's centre. A pixel is shaded once if all its samples see one smooth
            surface and its neighbours have the same visibility for every light.
        max_wrong, max_ms : float, optional
            Share of wrong pixels, and milliseconds, that shadows may cost. Lights whose settings are derived then use the cheapest
            settings that are accurate enough, or the most accurate that are fast enough. Candidates are tried on the first such image of a
            scene, about fifty frames; the choice is cached per scene, size and the lights' kinds and settings. `used[i].why` reports it.
        exposure : "scene", "auto", float or None
            Scale of the light in `image`. A number: 2 to its power, that many stops brighter. "auto": metered, so that the scene's lights
            come out as bright as the default light, however strong they are; it depends on the scene and its lights, not on the camera.
            "scene": "auto" where lights are `photometric`, as those of glTF files are, None elsewhere. None: not scaled.
        tone : {"neutral", "none"}
            Tone map of `image`: Khronos PBR Neutral, which leaves colours up to 0.8 as they are, or none, which clips at 1.

        Raises
        ------
        SettingsError, SceneError, ResourceError, ShaderError
            Named errors; never a blank image.
        """
        self._check_alive()
        sky = scene.defaults.sky if isinstance(scene, Scene) and isinstance(background, str) else None
        behind = None if sky and background == OWN_BACKGROUND else background
        request = frame_request(scene, camera, lights, size, outputs, ambient, behind, samples, exposure, tone)
        budget = Budget(max_wrong=max_wrong, max_ms=max_ms)
        if budget.given:

            def draw(lights: Sequence[Light], outputs: tuple[str, ...], samples: int = 1) -> Frame:
                return self.render(
                    scene, request.camera, lights, request.size, ambient, background, outputs, samples,
                    exposure=exposure, tone=tone,
                )  # fmt: skip

            last = partial(draw, samples=samples)
            names = tuple(each for each in NAMES if each in request.outputs)
            return self._choices.render(draw, last, scene, request.lights, request.size, budget, names)
        no_memory = (
            f"there is not enough memory for {request.size[0]} x {request.size[1]} pixels of "
            f"{', '.join(sorted(request.outputs))}; use a smaller image"
        )
        with self._drawing(request, no_memory) as cache:
            drawn = draw_frame(cache, drawn_part(request))
        if sky:
            place_before(sky, request.camera, drawn.outputs)
        return Frame(scene=scene, camera=request.camera, lights=request.lights, size=request.size, near=drawn.near, far=drawn.far,
                     used=drawn.used, outputs=with_traced(request, drawn.outputs), samples=request.look.samples, exposure=request.look.ev,
                     tone=request.look.tone)  # fmt: skip

    def visibility(
        self,
        scene: Scene,
        points: ArrayLike,
        lights: Lights = None,
        normals: ArrayLike | None = None,
        triangles: ArrayLike | None = None,
        light_samples: int | None = None,
        progress: Progress | None = None,
    ) -> NDArray[np.float32]:
        """The share of each light that given points see, as `glshadow.visibility` describes it.

        Triangle lists depend on the scene and the light alone, and are kept for the next call.

        Parameters
        ----------
        scene, points, lights, normals, triangles, light_samples, progress
            As for `glshadow.visibility`.

        Returns
        -------
        (L, N) float32

        Raises
        ------
        SettingsError, SceneError, ResourceError
        """
        self._check_alive()
        request = point_request(scene, points, lights, normals, triangles, light_samples, progress)
        no_memory = f"there is not enough memory for {len(request.points)} points and {len(request.lights)} lights"
        with self._drawing(request, f"{no_memory}; give fewer at a time") as cache:
            return visibility_of_points(cache, request)

    def sequence(
        self,
        scene: Scene,
        cameras: Iterable[Camera],
        lights: Lights = None,
        size: tuple[int, int] = DEFAULT_SIZE,
        **options: Unpack[RenderOptions],
    ) -> Generator[Frame]:
        """Frames of one scene, each as `render` gives it. Work that does not depend on the camera is done once.

        Parameters
        ----------
        scene : Scene
        cameras : iterable of cameras
            Cameras, taken one by one when the next frame is needed.
        lights, size, **options
            As for `render`.

        Yields
        ------
        Frame

        Raises
        ------
        SettingsError, SceneError
            Raised immediately; a bad camera is reported with its index when it is reached.
        """
        _check_options("sequence", options)
        _, lights, size = frame_arguments(scene, None, lights, size)
        views = _each("cameras", "cameras", cameras)

        def frames() -> Generator[Frame]:
            for number, camera in enumerate(views):
                if not isinstance(camera, Camera):
                    raise SettingsError(f"cameras[{number}] must be a camera, got {shown(camera)}")
                yield self.render(scene, camera, lights, size, **options)

        return frames()

    def animation(
        self,
        scene: Scene,
        times: Iterable[float],
        camera: Camera | None = None,
        lights: Lights = None,
        size: tuple[int, int] = DEFAULT_SIZE,
        **options: Unpack[RenderOptions],
    ) -> Generator[Frame]:
        """Frames of a scene at several times of its animation, each as `render` gives it of `scene.at(time)`. Only what moves is uploaded.

        Parameters
        ----------
        scene : Scene
            As `gs.load` gives it. `scene.framed(times)` keeps all of its motion in view.
        times : iterable of floats
            Seconds, taken one by one when the next frame is needed.
        camera, lights : optional
            For all frames; None: the scene's own, which may follow the file's animation.
        size, **options
            As for `render`. `max_wrong` and `max_ms` try settings again for each frame, and are refused.

        Yields
        ------
        Frame

        Raises
        ------
        SettingsError, SceneError
            Raised immediately; a bad time is reported with its index when it is reached.
        """
        _check_options("animation", options)
        if options.get("max_wrong") is not None or options.get("max_ms") is not None:
            raise SettingsError("animation takes no max_wrong and no max_ms: find settings with render for one time")
        frame_arguments(scene, camera, lights, size)
        moments = _each("times", "seconds", times)

        def frames() -> Generator[Frame]:
            for number, seconds in enumerate(moments):
                try:
                    now = scene.at(seconds)
                except SettingsError:
                    raise SettingsError(
                        f"times[{number}] must be a finite number of seconds, got {shown(seconds)}"
                    ) from None
                yield self.render(now, camera, lights, size, **options)

        return frames()


def _check_options(name: str, options: RenderOptions) -> None:
    """Check the keyword arguments of a method that takes those of `render`."""
    if unknown := set(options) - set(RenderOptions.__annotations__):
        raise SettingsError(f"{name} has no argument {', '.join(sorted(map(repr, unknown)))}: it takes those of render")
    look_of(
        options.get("ambient"),
        options.get("background", OWN_BACKGROUND),
        options.get("samples", DEFAULT_SAMPLES),
        options.get("exposure", "scene"),
        options.get("tone", "neutral"),
    )
    checked_outputs(options.get("outputs", DEFAULT_OUTPUTS))


def _each(name: str, what: str, given: Iterable[T]) -> Iterator[T]:
    """An iterator over an argument, or a SettingsError."""
    try:
        return iter(given)
    except Exception:  # an error in a foreign __iter__, or no __iter__
        raise SettingsError(f"{name} must be a sequence of {what}, got {shown(given)}") from None
