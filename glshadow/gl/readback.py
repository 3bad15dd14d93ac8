"""From textures to numpy: GL's rows are turned over here, once."""

from __future__ import annotations

from collections.abc import Collection
from typing import Any

import moderngl
import numpy as np
from numpy.typing import NDArray

from glshadow.core.metric import metric_range, projected_metric
from glshadow.gl.camera import Sight
from glshadow.gl.geometry import NOT_RECEIVING
from glshadow.gl.targets import CameraTargets


def read(outputs: Collection[str], sight: Sight, targets: CameraTargets) -> dict[str, Any]:
    """Those outputs that the camera's buffers hold, by name; row 0 at the top."""
    results: dict[str, Any] = {}
    if "image" in outputs:
        results["image"] = pixels(targets.image, np.uint8)[..., :3]
    if "visibility" in outputs:
        planes = np.zeros((len(targets.visibility), sight.size[1], sight.size[0]), dtype=np.float32)
        for plane, texture in zip(planes, targets.visibility, strict=True):
            plane[:] = pixels(texture, np.float32)[..., 0]
        results["visibility"] = planes
    if targets.linear is not None:
        results["linear"] = pixels(targets.linear, np.float32)[..., :3]
    if not {"depth", "depth_metric", "triangle"}.isdisjoint(outputs):
        results.update(_depths(outputs, sight, targets))
    return results


def pixels(texture: moderngl.Texture, dtype: Any) -> NDArray[Any]:
    """A texture's pixels (H, W, C)."""
    width, height = texture.size
    # not texture.read(): moderngl 5.13 does not check its own allocation, and without memory the process would end here
    data = np.zeros((height, width, texture.components), dtype=dtype)
    texture.read_into(data)
    return np.ascontiguousarray(data[::-1])


def _depths(outputs: Collection[str], sight: Sight, targets: CameraTargets) -> dict[str, Any]:
    window = pixels(targets.depth, np.float32)[..., 0]
    nothing = window == sight.clip.clear_depth
    depth = sight.depth(np.where(nothing, 0.5, window.astype(np.float64)))
    results: dict[str, Any] = {}
    if "depth" in outputs:
        results["depth"] = np.where(nothing, np.inf, depth).astype(np.float32)
    if "depth_metric" in outputs:
        matrix, kind = sight.view.clip_from_view, sight.view.kind
        metric = projected_metric(
            matrix[2, 3] - matrix[2, 2] * depth, sight.clip, *metric_range(kind, sight.clip, sight.near, sight.far)
        )
        results["depth_metric"] = np.where(nothing, 1.0, metric).astype(np.float32)
    if "triangle" in outputs:
        number = pixels(targets.surface, np.uint32)[..., 0].astype(np.int64)
        number &= NOT_RECEIVING - 1
        results["triangle"] = np.where(nothing, -1, number - 1).astype(np.int32)
    return results
