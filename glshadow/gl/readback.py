"""From textures to numpy: GL's rows are turned over here, once."""

from __future__ import annotations

from collections.abc import Collection
from typing import Any

import moderngl
import numpy as np
from numpy.typing import NDArray

from glshadow.core.metric import Target, metric_range, projected_metric, unpack
from glshadow.gl.camera import Sight
from glshadow.gl.caster import Map
from glshadow.gl.geometry import NOT_RECEIVING
from glshadow.gl.targets import CameraTargets


def read(outputs: Collection[str], sight: Sight, targets: CameraTargets, maps: list[Map | None]) -> dict[str, Any]:
    """The outputs that were asked for, by name; row 0 at the top."""
    results: dict[str, Any] = {}
    if "image" in outputs:
        results["image"] = _pixels(targets.image, np.uint8)[..., :3]
    if "visibility" in outputs:
        planes = np.zeros((len(maps), sight.size[1], sight.size[0]), dtype=np.float32)
        for plane, texture in zip(planes, targets.visibility, strict=True):
            plane[:] = _pixels(texture, np.float32)[..., 0]
        results["visibility"] = planes
    if targets.linear is not None:
        results["linear"] = _pixels(targets.linear, np.float32)[..., :3]
    if not {"depth", "depth_metric", "triangle"}.isdisjoint(outputs):
        results.update(_depths(outputs, sight, targets))
    if "shadow_maps" in outputs:
        results["shadow_maps"] = tuple(_stored(shadow_map) for shadow_map in maps)
    return results


def _pixels(texture: moderngl.Texture, dtype: Any) -> NDArray[Any]:
    """A texture's pixels (H, W, C)."""
    width, height = texture.size
    # not texture.read(): moderngl 5.13 does not check its own allocation, and without memory the process would end here
    data = np.zeros((height, width, texture.components), dtype=dtype)
    texture.read_into(data)
    return np.ascontiguousarray(data[::-1])


def _depths(outputs: Collection[str], sight: Sight, targets: CameraTargets) -> dict[str, Any]:
    window = _pixels(targets.depth, np.float32)[..., 0]
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
        number = _pixels(targets.surface, np.uint32)[..., 0].astype(np.int64)
        number &= NOT_RECEIVING - 1
        results["triangle"] = np.where(nothing, -1, number - 1).astype(np.int32)
    return results


def _stored(shadow_map: Map | None) -> NDArray[np.float32]:
    """A light's views (V, R, R) as they are stored, row 0 at v = 1; RGBA8 is unpacked."""
    if shadow_map is None:
        return np.zeros((0, 0, 0), dtype=np.float32)
    texture, target = shadow_map.atlas.texture, shadow_map.settings.target
    if target is Target.RGBA8:
        values = np.minimum(unpack(_pixels(texture, np.uint8) / 255.0), 1.0)
    elif target is Target.R8:
        values = _pixels(texture, np.uint8)[..., 0] / 255.0
    else:
        values = _pixels(texture, np.float16 if target is Target.R16F else np.float32)[..., 0]
    height = len(values)
    tiles = []
    for view in shadow_map.views:
        x, y = view.tile
        tiles.append(values[height - y - view.resolution : height - y, x : x + view.resolution])
    return np.stack(tiles).astype(np.float32)
