"""render_distorted: the image of a lens with distortion, resampled from one wide pinhole image."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from os import PathLike
from typing import Any, Unpack

import numpy as np
from numpy.typing import NDArray

from glshadow.arguments import CAMERA, DEFAULT_SIZE, as_scene, pixels
from glshadow.core.cameras import Camera, IntrinsicsCamera
from glshadow.core.distortion import Distortion
from glshadow.core.outputs import OUTPUTS, Of, checked_outputs
from glshadow.core.setting import instance, optional, whole
from glshadow.core.spaces import Array
from glshadow.derive.look import BACKGROUND, look_of
from glshadow.errors import SettingsError
from glshadow.frame import Frame
from glshadow.image import frame_path
from glshadow.lights import Lights
from glshadow.renderer import DEFAULT_OUTPUTS, Renderer, RenderOptions

LARGEST_SIDE = 16384  # pixels of the wide image
OVERSAMPLING = whole(1, 8)
_MEANS = tuple(each.name for each in OUTPUTS if each.of is Of.MEAN)
_SMOOTH = ("linear", "alpha")  # means over samples that need not see a surface: interpolated
_NEEDS = {"image": ("linear", "alpha")}


def render_distorted(
    scene: Any,
    camera: Camera | None,
    distortion: Distortion,
    lights: Lights = None,
    size: tuple[int, int] = DEFAULT_SIZE,
    path: str | PathLike[str] | None = None,
    oversampling: int = 2,
    renderer: Renderer | None = None,
    **options: Unpack[RenderOptions],
) -> Frame:
    """Render the image of a lens with distortion.

    One pinhole image that covers the field of view is rendered, so finely that in each direction at least `oversampling` of its pixels
    fall on one pixel, and is resampled. Outputs of the pixel's centre (depth, node, position, ...) are those of the wide image's nearest
    pixel: exact values of a surface point that is at most sqrt(0.5) / oversampling pixels away from the pixel's centre. Image, linear
    and alpha are means of oversampling x oversampling bilinear samples in linear light, visibility of as many nearest ones.

    Parameters
    ----------
    scene
        As for `render`.
    camera : PerspectiveCamera or IntrinsicsCamera, optional
        Pose and intrinsics, without distortion; None: the scene's own.
    distortion : BrownDistortion or FisheyeDistortion
    lights, size
        As for `Renderer.render`; the size is that of the distorted image.
    path : optional
        Also save the image here, as `render` does.
    oversampling : int
        1 to 8. Time and memory grow with its square.
    renderer : Renderer, optional
        None: a temporary one.
    **options
        Further arguments of `Renderer.render`.

    Returns
    -------
    Frame
        Its camera is `camera`. Shadow maps and timings are those of the wide image.

    Raises
    ------
    SettingsError
        If the camera is not perspective, if a pixel sees no direction or more than one less than 90 degrees from the axis, or if the
        wide image would have more than 16384 pixels on a side.
    """
    target = optional(frame_path, "not saved")("path", path)
    scene, size = as_scene(scene), pixels("size", size)
    camera = CAMERA("camera", camera) or scene.camera
    distortion = instance(Distortion)("distortion", distortion)
    renderer = optional(instance(Renderer), "a temporary one")("renderer", renderer)
    names = checked_outputs(options.get("outputs", DEFAULT_OUTPUTS))
    grid = _grid(
        distortion, tuple(camera.K(size, 0.5).ravel().tolist()), size, OVERSAMPLING("oversampling", oversampling)
    )
    kept = {name: getattr(camera, name) for name in ("position", "target", "up", "near", "far")}
    wide = IntrinsicsCamera(grid.focal, grid.focal, *grid.principal, **kept)
    options["outputs"] = tuple(dict.fromkeys(part for name in names for part in _NEEDS.get(name, (name,))))
    if renderer is None:
        with Renderer() as temporary:
            frame = temporary.render(scene, wide, lights, grid.size, **options)
    else:
        frame = renderer.render(scene, wide, lights, grid.size, **options)
    look = replace(look_of(0.0, options.get("background", BACKGROUND), 1, None, frame.tone), scale=2.0**frame.exposure)
    found = {name: _resampled(grid, name, value) for name, value in frame.outputs.items()}
    if "image" in names:
        light = found["linear"]
        light = light if light.shape[2] == 4 else np.concatenate([light, found["alpha"][..., None]], axis=2)
        found["image"] = look.encoded(light)
    outputs = {name: found[name] for name in names}
    frame = replace(frame, camera=camera, size=size, outputs=outputs, distortion=distortion)
    if target is not None:
        frame.save(target)
    return frame


@dataclass(frozen=True)
class _Grid:
    """Where an image's pixels are in the wide one: its size, focal length and principal point, and positions in its pixels.

    `centres` is (H, W, 2), `parts` the positions of the samples of each pixel; (0, 0) is the corner of the wide image.
    """

    size: tuple[int, int]
    focal: float
    principal: tuple[float, float]
    centres: Array
    parts: tuple[Array, ...]


@lru_cache(maxsize=1)  # the frames of a data set share one lens
def _grid(distortion: Distortion, K: tuple[float, ...], size: tuple[int, int], oversampling: int) -> _Grid:
    focal = np.array([K[0], K[4]])
    principal = np.array([K[2], K[5]])
    corner = np.stack(np.meshgrid(np.arange(size[0]), np.arange(size[1])), axis=-1)

    def seen(dx: float, dy: float) -> Array:
        return distortion.undistorted((corner + np.array([dx, dy]) - principal) / focal)

    offsets = (np.arange(oversampling) + 0.5) / oversampling
    centres = seen(0.5, 0.5)
    parts = [centres] if oversampling == 1 else [seen(dx, dy) for dy in offsets for dx in offsets]
    fine = oversampling * float(_stretch(focal[:, None] * distortion.slopes(centres)).max())
    low = fine * np.min([each.min(axis=(0, 1)) for each in (centres, *parts)], axis=0)
    high = fine * np.max([each.max(axis=(0, 1)) for each in (centres, *parts)], axis=0)
    width, height = (int(each) for each in np.ceil(high - low) + 3)
    if max(width, height) > LARGEST_SIDE:
        angle = 2.0 * np.degrees(np.arctan(np.abs([low, high]).max() / fine))
        raise SettingsError(
            f"the field of view reaches {angle:.1f} degrees, for which the wide image would need {width} x {height} pixels, and at most "
            f"{LARGEST_SIDE} on a side are rendered: use a smaller size, or oversampling=1"
        )
    shift = 1.5 - low  # a pixel around the outermost samples, and the first of them at a pixel's centre
    placed = tuple(fine * each + shift for each in parts)
    return _Grid((width, height), fine, (float(shift[0]), float(shift[1])), fine * centres + shift, placed)


def _stretch(matrices: Array) -> Array:
    """The larger singular value of matrices (..., 2, 2)."""
    a, b, c, d = (matrices[..., i, j] for i in (0, 1) for j in (0, 1))
    half = 0.5 * (a * a + b * b + c * c + d * d)
    root = np.hypot(0.5 * (a * a + b * b - c * c - d * d), a * c + b * d)
    return np.asarray(np.sqrt(half + root))


def _resampled(grid: _Grid, name: str, value: Any) -> Any:
    if not isinstance(value, np.ndarray):
        return value
    if name in _SMOOTH:
        return _smooth(grid, value)
    layers = value.ndim == 4 or (value.ndim == 3 and value.shape[1:] == grid.size[::-1])
    planes = np.moveaxis(value, 0, -1) if layers else value
    found = _nearest_mean(grid, planes) if name in _MEANS else planes[_nearest(grid.centres)]
    return np.ascontiguousarray(np.moveaxis(found, -1, 0) if layers else found)


def _nearest(places: Array) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    column, row = np.moveaxis(np.floor(places).astype(np.int64), -1, 0)
    return row, column


def _nearest_mean(grid: _Grid, value: NDArray[Any]) -> NDArray[Any]:
    """Mean of the nearest pixels of all samples that are not NaN; NaN where all are."""
    total = np.zeros((*grid.centres.shape[:2], *value.shape[2:]))
    count = np.zeros_like(total)
    for places in grid.parts:
        read = value[_nearest(places)]
        there = np.isfinite(read)
        total += np.where(there, read, 0.0)
        count += there
    return np.where(count > 0, total / np.maximum(count, 1), np.nan).astype(value.dtype)


def _smooth(grid: _Grid, value: NDArray[Any]) -> NDArray[np.float32]:
    """Mean of bilinear reads at all samples."""
    planes = value if value.ndim == 3 else value[..., None]
    width, flat = planes.shape[1], planes.reshape(-1, planes.shape[2])
    total = np.zeros((*grid.centres.shape[:2], planes.shape[2]), dtype=np.float32)
    for places in grid.parts:
        column, row = np.moveaxis(np.floor(places - 0.5).astype(np.int64), -1, 0)
        x, y = np.moveaxis((places - 0.5 - np.floor(places - 0.5)).astype(np.float32), -1, 0)[..., None]
        first = row * width + column
        for step, weight in (
            (0, (1.0 - x) * (1.0 - y)),
            (1, x * (1.0 - y)),
            (width, (1.0 - x) * y),
            (width + 1, x * y),
        ):
            total += weight * np.take(flat, first + step, axis=0)
    result = (total / len(grid.parts)).astype(np.float32)
    return result if value.ndim == 3 else result[..., 0]
