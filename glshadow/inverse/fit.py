"""fit_light: the light whose shadow, or whose image, is a given one."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, Unpack

import numpy as np
from numpy.typing import ArrayLike

from glshadow.arguments import CAMERA, checked_scene
from glshadow.core.cameras import Camera
from glshadow.core.setting import instance, number, numbers_in, optional, refuse
from glshadow.core.spaces import Array
from glshadow.core.srgb import linear_from_srgb
from glshadow.errors import GlshadowError, SettingsError
from glshadow.inverse.drawing import check_options, drawn, exact_light
from glshadow.inverse.unknowns import Unknowns, turns_around
from glshadow.lights import Light
from glshadow.renderer import Renderer, RenderOptions
from glshadow.scene.nodes import Scene

LEAST_SIDE = 20  # pixels of the smallest image of the pyramid
BLUR = 10.0  # degrees: the sun of the search, whose shadows overlap from farther away
SEARCH = number(0.0, 90.0, unit="degrees")
_EVALUATIONS = 12  # steps at each size


@dataclass(frozen=True, eq=False)
class FittedLight:
    """A light found by `fit_light`.

    Attributes
    ----------
    light : Light
    error : float
        Root mean square difference to the target over its valid pixels: of visibility, or of linear light.
    start_error : float
        That of the light at the start.
    images : int
        Number of images that were rendered.
    """

    light: Light
    error: float
    start_error: float
    images: int


def fit_light(
    scene: Scene,
    camera: Camera | None,
    target: ArrayLike,
    light: Light,
    free: Any = ("direction", "angle"),
    search: float = 40.0,
    renderer: Renderer | None = None,
    **options: Unpack[RenderOptions],
) -> FittedLight:
    """Find the light whose visibility, or image, is the target, by least squares.

    The filter is `Exact()`: soft shadows without noise, so that central differences are gradients. First directions around the light's,
    every ten degrees, are tried in a small image; then scipy's least squares refines all that is free, at growing sizes of the image up to
    the target's. What is found is a local minimum: of several lights that explain the target, one; look at `error`.

    Parameters
    ----------
    scene : Scene
        Its own lights do not count.
    camera : Camera, optional
        None: the scene's own.
    target : (H, W) floats, (H, W, 3) floats or (H, W, 3) uint8
        Visibility of the light at the pixels' centres, NaN where it is unknown; or linear light as of `Frame.linear`; or an image in sRGB,
        exposed with None and without tone map.
    light : Light
        Where to begin: directional, spot, point or rectangular. All that is not free stays as it is.
    free : str or sequence of str
        What is to be found: "direction", "position", "angle", "radius", "width", "height"; of linear light also "intensity".
    search : float
        Degrees around the direction that are tried first, up to 90; 0: none.
    renderer : Renderer, optional
        None: a temporary one.
    **options
        Further arguments of `Renderer.render`: `ambient`, `background`, and `samples`, which is 1 here.

    Returns
    -------
    FittedLight

    Raises
    ------
    SettingsError
        For a target of another shape or without valid pixels, or a setting that the light has not.
    GlshadowError
        If scipy is not installed.
    """
    least_squares = _least_squares()
    scene = checked_scene(scene)
    camera = CAMERA("camera", camera) or scene.camera
    wanted = _target(target)
    light = exact_light(instance(Light)("light", light))
    low, high = scene.bounds
    unknowns = Unknowns.of(light, free, float(np.linalg.norm(high - low)))
    if wanted.ndim == 2 and "intensity" in unknowns.free:
        raise SettingsError("intensity does not change visibility: fit it to an image, or leave it out of free")
    check_options("fit_light", options)
    search = SEARCH("search", search)
    renderer = optional(instance(Renderer), "a temporary one")("renderer", renderer)
    if renderer is None:
        with Renderer() as temporary:
            return _fitted(_Images(temporary, scene, camera, wanted, options), unknowns, search, least_squares)
    return _fitted(_Images(renderer, scene, camera, wanted, options), unknowns, search, least_squares)


class _Images:
    """Differences between images of a light and the target."""

    def __init__(self, renderer: Renderer, scene: Scene, camera: Camera, target: Array, options: Any) -> None:
        self._renderer, self._scene, self._camera, self._options = renderer, scene, camera, options
        self.targets = _pyramid(target)
        self.count = 0

    def difference(self, light: Light, level: int) -> Array:
        """(N,) differences at the valid pixels of a level; 0 is the target itself."""
        target = self.targets[level]
        self.count += 1
        size = (target.shape[1], target.shape[0])
        output = "visibility" if target.ndim == 2 else "linear"
        image = drawn(self._renderer, self._scene, self._camera, [light], size, output, self._options)[0]
        difference = image.astype(np.float64) - target
        return np.asarray(np.where(np.isnan(difference), 0.0, difference).ravel())

    def error(self, light: Light) -> float:
        """Root mean square over the target's valid pixels."""
        valid = int((~np.isnan(self.targets[0])).sum())
        return float(np.sqrt((self.difference(light, 0) ** 2).sum() / valid))


def _fitted(images: _Images, unknowns: Unknowns, search: float, least_squares: Callable[..., Any]) -> FittedLight:
    start_error = images.error(unknowns.light)
    light, coarse = unknowns.light, len(images.targets) - 1
    if "direction" in unknowns.free and search >= 10.0:
        light = _searched(images, light, coarse, search)
    for level in range(coarse, -1, -1):
        here = replace(unknowns, light=light)
        steps = here.steps * min(2.0**level, 4.0)

        def residuals(x: Array, here: Unknowns = here, level: int = level) -> Array:
            return images.difference(here.at(x), level)

        def slopes(x: Array, here: Unknowns = here, level: int = level, steps: Array = steps) -> Array:
            moves = np.diag(steps)
            pairs = [
                (images.difference(here.at(x + m), level), images.difference(here.at(x - m), level)) for m in moves
            ]
            return np.stack([(up - down) / (2.0 * h) for (up, down), h in zip(pairs, steps, strict=True)], axis=1)

        found = least_squares(
            residuals, np.zeros(len(steps)), jac=slopes, x_scale=steps, xtol=1e-4, ftol=1e-4, max_nfev=_EVALUATIONS
        )
        light = here.at(found.x)
    return FittedLight(light, images.error(light), start_error, images.count)


def _searched(images: _Images, light: Light, level: int, search: float) -> Light:
    """The light turned to the best of the directions around."""
    wide = light
    if light.sized_by == "angle":
        wide = replace(light, angle=max(light.angle, BLUR))  # type: ignore[attr-defined,call-arg]
    turns = np.array(turns_around(search))
    around, own = (Unknowns(each, ("direction",), 1.0) for each in (wide, light))
    errors = [float((images.difference(around.at(turn), level) ** 2).sum()) for turn in turns]
    return own.at(turns[int(np.argmin(errors))])


def _pyramid(target: Array) -> list[Array]:
    """The target and its halves, means of the valid pixels, down to LEAST_SIDE."""
    levels = [target]
    while min(levels[-1].shape[:2]) // 2 >= LEAST_SIDE:
        last = levels[-1]
        height, width = last.shape[0] // 2, last.shape[1] // 2
        blocks = last[: 2 * height, : 2 * width].reshape(height, 2, width, 2, *last.shape[2:])
        valid = ~np.isnan(blocks)
        total, count = np.where(valid, blocks, 0.0).sum(axis=(1, 3)), valid.sum(axis=(1, 3))
        levels.append(np.where(count > 0, total / np.maximum(count, 1), np.nan))
    return levels


def _target(value: Any) -> Array:
    array = numbers_in(value)
    if array is None or array.ndim not in (2, 3) or (array.ndim == 3 and array.shape[2] != 3) or 0 in array.shape:
        raise refuse("target", "an array (H, W) of visibility or (H, W, 3) of light", value)
    if array.dtype == np.uint8:
        if array.ndim == 2:
            raise refuse("target", "an array (H, W) of floats, 1 lit and 0 dark, or an image (H, W, 3)", value)
        return np.asarray(linear_from_srgb(array / 255.0))
    wanted = array.astype(np.float64)
    if np.isnan(wanted).all() or np.isinf(wanted).any():
        raise SettingsError("target must have valid pixels, and no infinite ones: NaN stands for an unknown pixel")
    if array.ndim == 2 and (np.nanmin(wanted) < 0.0 or np.nanmax(wanted) > 1.0):
        raise SettingsError(
            f"target must be visibility from 0 to 1, got {np.nanmin(wanted):.4g} to {np.nanmax(wanted):.4g}: give light as (H, W, 3)"
        )
    return wanted


def _least_squares() -> Callable[..., Any]:
    try:
        from scipy.optimize import least_squares
    except ImportError as error:
        raise GlshadowError(
            f"fit_light needs scipy ({error}); install it with: pip install 'glshadow[reference]'"
        ) from error
    found: Callable[..., Any] = least_squares
    return found
