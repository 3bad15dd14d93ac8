"""Depth range of a camera: as given, otherwise derived from the scene and the precision of the depth buffer."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from glshadow.core.cameras import Camera
from glshadow.core.spaces import Array
from glshadow.geometry.fitting import frustum_of, visible_corners

# Shares of far. A derived near plane is at USUAL_SHARE or, if surfaces are nearer, well in front of them, but no nearer than
# NEAREST_SHARE: 10 micrometres for 10 km. Reversed 0..1 float depth is near / depth, whose relative rounding does not depend on
# near. But a triangle is clipped there to 2^-24 of its length, which must not be visible: hence BEFORE of the nearest depth.
USUAL_SHARE, NEAREST_SHARE, BEFORE = 1e-5, 2.0**-30, 0.25
SMALL = 1e-3  # share of the smallest body: if the eye is inside a larger body, a near plane closer than that clips nothing that matters
# Without reversed 0..1 depth, values are densest at the near plane and 2^-24 apart everywhere else. Rounding in clip space, in the
# division by w and in the window adds up to two of them (2.1 measured on llvmpipe). With d(window) / d(depth) = near / depth^2 that is
# 2^-23 depth^2 / near of depth: an eighth of a pixel, which is depth * (tangent of a pixel), if near is 2^-20 depth / tangent.
COARSE_STEP = 2.0**-20
MOST_CUT = 1e-3  # share of the deepest visible depth: however small pixels are, nothing beyond it is clipped for them


@dataclass(frozen=True)
class DepthRange:
    """Near and far plane, distances along the view; `fallbacks`: the cost of the driver's limits, a sentence each."""

    near: float
    far: float
    fallbacks: tuple[str, ...] = ()


def depth_range(
    camera: Camera, size: tuple[int, int], boxes: tuple[Array, Array], corners: Array, clip_control: bool
) -> DepthRange:
    """The depth range of an image.

    Parameters
    ----------
    size : (2,) ints
        Width and height in pixels.
    boxes : (N, 2, 3), (N, 4, 4) float64
        Bounds and matrices of all bodies.
    corners : (N, 8, 3) float64
        Their world corners.
    clip_control : bool
        Whether the buffer holds reversed 0..1 depth, which float32 resolves equally well near and far; otherwise -1..1.
    """
    depth = view_depth(camera, corners)
    nearest, farthest = float(depth.min()), float(depth.max())
    if not camera.is_perspective:
        _, _, bottom, top = camera.window(size)
        return _linear(camera, size, nearest, farthest, top - bottom)
    far = camera.far if camera.far is not None else 1.001 * farthest
    if far <= 0.0 or (camera.near is not None and far <= camera.near):
        far = 2.0 * (camera.near or 1.0)
    near = camera.near if camera.near is not None else max(0.999 * nearest, USUAL_SHARE * far)
    if clip_control:
        cut: tuple[str, ...] = ()
        if camera.near is None and near == USUAL_SHARE * far:
            near = min(near, max(BEFORE * _nearest_seen(camera, size, boxes, far), NEAREST_SHARE * far))
            smallest = float(np.linalg.norm(np.ptp(corners, axis=1), axis=1).min())
            if near == NEAREST_SHARE * far and near > SMALL * smallest:
                cut = (
                    f"the camera is inside the scene, which extends to {far:g}: nothing nearer than {near:.2g} is drawn",
                )
        return DepthRange(min(near, 0.999 * far), far, cut)
    return _coarse(camera, size, boxes, min(near, 0.999 * far), far)


def _nearest_seen(camera: Camera, size: tuple[int, int], boxes: tuple[Array, Array], far: float) -> float:
    """Least view depth of all visible boxes; infinite if none is visible."""
    frustum = frustum_of(camera.window(size), NEAREST_SHARE * far, far, camera.view_from_world)
    points = np.concatenate(visible_corners(*boxes, frustum))
    return float(view_depth(camera, points).min()) if len(points) else np.inf


def view_depth(camera: Camera, points: Array) -> Array:
    """View depths (...) of world points (..., 3)."""
    row = camera.view_from_world[2]
    return np.asarray(-(points @ row[:3] + row[3]))


def _linear(camera: Camera, size: tuple[int, int], nearest: float, farthest: float, height: float) -> DepthRange:
    """Depth range of an orthographic camera: geometry behind its position is not visible, unless the given near plane is there."""
    pad = max(1e-3 * (farthest - nearest), 1e-6 * max(abs(nearest), abs(farthest), height))
    near = camera.near if camera.near is not None else max(nearest - pad, 0.0)
    far = camera.far if camera.far is not None else farthest + pad
    if far <= near:  # the whole scene is behind the given plane: any range works
        near, far = (near, near + max(pad, abs(near))) if camera.far is None else (far - max(pad, abs(far)), far)
    step = 2.0**-23 * (far - near)  # error of interpolation and storage
    if step > height / size[1]:
        coarse = f"an orthographic camera's depth is off by up to {step:.2g} if it reaches from {near:g} to {far:g}; give near and far"
        return DepthRange(near, far, (coarse,))
    return DepthRange(near, far)


def _coarse(camera: Camera, size: tuple[int, int], boxes: tuple[Array, Array], near: float, far: float) -> DepthRange:
    """The farthest near plane that clips nothing visible; if boxes around the eye leave it open, one that resolves the deepest point."""
    window = camera.window(size)
    start = near if camera.near is not None else NEAREST_SHARE * far
    points = np.concatenate(visible_corners(*boxes, frustum_of(window, start, far, camera.view_from_world)))
    if len(points) == 0:
        return DepthRange(near, far)
    depth = view_depth(camera, points)
    nearest, deepest = float(depth.min()), float(depth.max())
    pixel = min((window[1] - window[0]) / size[0], (window[3] - window[2]) / size[1])
    needed = min(COARSE_STEP / pixel, MOST_CUT) * deepest
    why = "this driver has no glClipControl, and -1..1 depth is coarse far away"
    if camera.near is None and 2.0 * start < 0.999 * nearest < needed:
        near = 0.999 * nearest
        return DepthRange(near, far, (f"{why}: a depth of {deepest:g} is off by up to {_step(deepest, near):.2g}",))
    if camera.near is None:
        cut = () if nearest >= needed else (f"{why}: surfaces nearer than {needed:g} to the camera are not drawn",)
        return DepthRange(min(max(near, 0.999 * nearest, needed), 0.999 * far), far, cut)
    if near >= needed:
        return DepthRange(near, far)
    lost = f"{why}: with near={near:g} a depth of {deepest:g} is off by up to {_step(deepest, near):.2g}"
    return DepthRange(near, far, (f"{lost}; leave near out, or give at least {needed:g}",))


def _step(depth: float, near: float) -> float:
    """Largest error of -1..1 depth at a depth, at most the depth itself."""
    return min(2.0**-23 * depth**2 / near, depth)
