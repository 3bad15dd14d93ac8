"""LightFunction: the image of a light as a function of its settings, with the product of a vector and its Jacobian."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from contextlib import nullcontext
from dataclasses import dataclass, fields, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from glshadow.arguments import CAMERA, checked_scene, pixels
from glshadow.core.cameras import Camera
from glshadow.core.setting import instance, number, optional, refuse, shown
from glshadow.core.spaces import Array
from glshadow.errors import SettingsError
from glshadow.inverse.drawing import check_options, drawn, exact_light
from glshadow.inverse.unknowns import FREE, LEAST_ANGLE, MOST_ANGLE, SIZES, STEP_SIZE, Unknowns
from glshadow.lights import Light
from glshadow.renderer import Renderer
from glshadow.scene.nodes import Scene

STRENGTHS = ("intensity", "color")
"""Settings in which an image is linear, and on which visibility does not depend."""
NAMES = (*(each for each in FREE if each not in STRENGTHS), *STRENGTHS)
STEP = number(0.0, 4.0, above=True)
Values = Mapping[str, Array]


@dataclass(frozen=True)
class _Pair:
    """Two lights whose images' difference over `width` is a derivative."""

    up: Light
    down: Light
    width: float


class LightFunction:
    """The visibility, or the image, of a light as a function of some of its settings.

    Parameters
    ----------
    renderer : Renderer, optional
        None: a temporary one for each call.
    scene : Scene
    camera : Camera, optional
        None: the scene's own.
    light : Light
        Directional, spot, point or rectangular: what its other settings are. The filter is `Exact()`.
    output : {"visibility", "linear"}
    size : (2,) ints
        Width and height in pixels.
    options : mapping
        Further arguments of `Renderer.render`.
    step : float
        Factor of the half steps of `Unknowns.steps`.

    Raises
    ------
    SettingsError, SceneError
    """

    def __init__(
        self,
        renderer: Renderer | None,
        scene: Scene,
        camera: Camera | None,
        light: Light,
        output: Literal["visibility", "linear"],
        size: tuple[int, int],
        options: Mapping[str, Any] | None = None,
        step: float = 1.0,
    ) -> None:
        self._renderer = optional(instance(Renderer), "a temporary one")("renderer", renderer)
        self._scene = checked_scene(scene)
        self._camera = CAMERA("camera", camera) or self._scene.camera
        light = instance(Light)("light", light)
        if light.wide and light.at_infinity:
            raise SettingsError(f"a light from all around cannot be differentiated, got {type(light).__name__}")
        self._light = exact_light(light)
        self._output, self._size = output, pixels("size", size)
        self._options = dict(options or {})
        check_options("a gradient", self._options)
        self._step = STEP("step", step)
        low, high = self._scene.bounds
        self._extent = float(np.linalg.norm(high - low))

    def at(self, values: Values) -> NDArray[np.float32]:
        """The image of the light with these settings.

        Parameters
        ----------
        values : mapping of str to arrays
            (3,) for direction, of any length, position and color; one number for all others.

        Returns
        -------
        (H, W) or (H, W, 3) float32
            Visibility is NaN where there is no surface.

        Raises
        ------
        SettingsError
        """
        image: NDArray[np.float32] = self._images([self._light_at(values)])[0]
        return image

    def pulled_back(self, values: Values, cotangent: Array, names: Iterable[str] | None = None) -> dict[str, Array]:
        """The derivatives of sum(cotangent * image) by the settings, by central differences.

        Parameters
        ----------
        values : mapping of str to arrays
            As for `at`.
        cotangent : (H, W) or (H, W, 3)
            Pixels without a surface do not count, whatever stands there.
        names : iterable of str, optional
            The settings whose derivatives are wanted; None: all of `values`.

        Returns
        -------
        dict of str to float64 arrays
            Each of its value's shape. A direction's is perpendicular to it, as its length does not matter.

        Raises
        ------
        SettingsError
            For a size whose step would leave what is allowed: an angle below 0.06 or above 80 degrees, a size of 0.
        """
        light = self._light_at(values)
        wanted = list(values if names is None else names)
        moved = Unknowns(light, tuple(each for each in wanted if each not in STRENGTHS), self._extent)
        pairs = self._moved(moved)
        strong = {name: self._scaled(light, name) for name in wanted if name in STRENGTHS}
        if self._output == "visibility":
            strong = {name: [] for name in strong}
        every = [*pairs, *(pair for each in strong.values() for pair in each)]
        slopes = iter(self._slopes(every, np.asarray(cotangent, dtype=np.float64)))
        found = moved.gradient(np.array([next(slopes) for _ in pairs]))
        for name, each in strong.items():
            found[name] = np.array([next(slopes) for _ in each] or np.zeros(np.size(values[name])))
        if "direction" in found:
            given = np.asarray(values["direction"], dtype=np.float64)
            found["direction"] = found["direction"] / np.linalg.norm(given)
        return {name: np.asarray(found[name], dtype=np.float64).reshape(np.shape(values[name])) for name in wanted}

    def _light_at(self, values: Values) -> Light:
        own = {each.name for each in fields(self._light)}
        allowed = [each for each in NAMES if each in own]
        if not isinstance(values, Mapping) or not values or not set(allowed).issuperset(values):
            given = list(values) if isinstance(values, Mapping) else values
            raise refuse(
                "parameters", f"by name, settings of {type(self._light).__name__}: {', '.join(allowed)}", given
            )
        settings: dict[str, Any] = {}
        for name, value in values.items():
            array = np.asarray(value, dtype=np.float64)
            settings[name] = array.reshape(()) if name in SIZES and array.size == 1 else array
        return replace(self._light, **settings)

    def _images(self, lights: list[Light]) -> NDArray[np.float32]:
        with Renderer() if self._renderer is None else nullcontext(self._renderer) as renderer:
            return drawn(renderer, self._scene, self._camera, lights, self._size, self._output, self._options)

    def _moved(self, moved: Unknowns) -> list[_Pair]:
        """Pairs of the light turned, moved and resized by the half steps that fits have."""
        grown = float(np.exp(STEP_SIZE * self._step))
        for name in moved.free:
            size = getattr(moved.light, name) if name in SIZES else 1.0
            if size == 0.0:
                raise SettingsError(f"{name} must be above 0 for its derivative, got {shown(size)}")
            if name == "angle" and not LEAST_ANGLE * grown <= size <= MOST_ANGLE / grown:
                span = f"[{LEAST_ANGLE * grown:.2g}, {MOST_ANGLE / grown:.2g}]"
                raise SettingsError(f"angle must be in {span} degrees for its derivative, got {shown(size)}")
        steps = moved.steps * self._step
        return [_Pair(moved.at(x), moved.at(-x), 2.0 * h) for x, h in zip(np.diag(steps), steps, strict=True)]

    @staticmethod
    def _scaled(light: Light, name: str) -> list[_Pair]:
        """Pairs of the light brighter and darker, in each channel; an image is linear in them, so that any step is exact."""
        base = np.atleast_1d(np.asarray(getattr(light, name), dtype=np.float64))
        pairs = []
        for channel, value in enumerate(base):
            low, high = (0.5 * value, 1.5 * value) if value > 0.0 else (0.0, 1.0)
            lights = []
            for level in (high, low):
                levels = base.copy()
                levels[channel] = level
                given: dict[str, Any] = {name: levels if name == "color" else float(level)}
                lights.append(replace(light, **given))
            pairs.append(_Pair(lights[0], lights[1], float(high - low)))
        return pairs

    def _slopes(self, pairs: list[_Pair], cotangent: Array) -> list[float]:
        """The derivative of sum(cotangent * image) of each pair."""
        if not pairs:
            return []
        images = self._images([light for pair in pairs for light in (pair.up, pair.down)]).astype(np.float64)
        if cotangent.shape != images.shape[1:]:
            raise refuse("cotangent", f"an array {images.shape[1:]}", cotangent)
        found = []
        for pair, up, down in zip(pairs, images[::2], images[1::2], strict=True):
            difference = up - down
            valid = ~np.isnan(difference)
            found.append(float((cotangent[valid] * difference[valid]).sum() / pair.width))
        return found
