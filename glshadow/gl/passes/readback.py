"""Read-back: textures to numpy arrays, with rows flipped to start at the top."""

from __future__ import annotations

from collections.abc import Collection
from typing import Any

import moderngl
import numpy as np
from numpy.typing import NDArray

from glshadow.core.spaces import Array
from glshadow.derive.look import Look
from glshadow.gl.driver.targets import CameraTargets, SurfaceTargets
from glshadow.gl.passes.camera import CameraView
from glshadow.gl.scene.capsules import surface_points
from glshadow.gl.scene.geometry import TRIANGLES, GpuScene
from glshadow.scene.capsules import Capsules
from glshadow.shadows.metric import metric_range, projected_metric


def read_means(outputs: Collection[str], targets: CameraTargets, lights: int, transparent: bool) -> dict[str, Any]:
    """Means over each pixel's samples, by output name; row 0 at the top."""
    results: dict[str, Any] = {}
    shown = 4 if transparent else 3
    if "image" in outputs:
        results["image"] = pixels(targets.image, np.uint8)[..., :shown]
    if "visibility" in outputs:
        planes = np.zeros((lights, targets.size[1], targets.size[0]), dtype=np.float32)
        for plane, texture in zip(planes, targets.visibility[:lights], strict=True):
            plane[:] = pixels(texture, np.float32)[..., 0]
        results["visibility"] = planes
    if targets.linear is not None:
        light = pixels(targets.linear, np.float32)
        if "linear" in outputs:
            results["linear"] = light[..., :shown]
        if "alpha" in outputs:
            results["alpha"] = np.ascontiguousarray(light[..., 3])
    return results


def average_samples(
    outputs: Collection[str], fine: dict[str, Any], block: tuple[int, int], look: Look
) -> dict[str, Any]:
    """What `read_means` gives, for an image whose samples were all drawn as pixels of a larger one; `fine` has linear and alpha."""
    light = _box_mean(np.concatenate([fine["linear"][..., :3], fine["alpha"][..., None]], axis=-1), block)
    shown = 4 if look.background is None else 3
    results: dict[str, Any] = {
        "image": look.encoded(light),
        "linear": light[..., :shown].astype(np.float32),
        "alpha": light[..., 3].astype(np.float32),
    }
    if "visibility" in outputs:
        seen = ~np.isnan(fine["visibility"])
        total = _box_mean(np.where(seen, fine["visibility"], 0.0)[..., None], block)[..., 0]
        share = _box_mean(seen.astype(np.float64)[..., None], block)[..., 0]
        results["visibility"] = np.where(share > 0.0, total / np.where(share > 0.0, share, 1.0), np.nan).astype(
            np.float32
        )
    return {name: value for name, value in results.items() if name in outputs}


def _box_mean(values: NDArray[Any], block: tuple[int, int]) -> Array:
    """Means over blocks of columns and rows, of (..., H, W, C)."""
    *front, height, width, channels = values.shape
    columns, rows = block
    shape = (*front, height // rows, rows, width // columns, columns, channels)
    return np.asarray(values.reshape(shape).mean(axis=(-4, -2), dtype=np.float64))


def pixels(texture: moderngl.Texture, dtype: Any) -> NDArray[Any]:
    """A texture's pixels (H, W, C)."""
    width, height = texture.size
    # not texture.read(): moderngl 5.13 does not check its own allocation and crashes the process if memory runs out
    data = np.zeros((height, width, texture.components), dtype=dtype)
    texture.read_into(data)
    return np.ascontiguousarray(data[::-1])


def read_centres(
    outputs: Collection[str], scene: GpuScene, camera_view: CameraView, targets: SurfaceTargets
) -> dict[str, Any]:
    """Outputs at each pixel's centre, by name; row 0 at the top."""
    window = pixels(targets.depth, np.float32)[..., 0]
    nothing = window == camera_view.clip.clear_depth
    depth = camera_view.depth(np.where(nothing, 0.5, window.astype(np.float64)))
    number = pixels(targets.surface, np.uint32)[..., 0].astype(np.int64)
    triangle = np.where(nothing, -1, (number & TRIANGLES) - 1).astype(np.int32)
    planes = None
    if not {"normal", "position"}.isdisjoint(outputs):
        planes = np.frombuffer(scene.planes.buffer.read(), np.float32).reshape(-1, 4)
    results: dict[str, Any] = {}
    if "depth" in outputs:
        results["depth"] = np.where(nothing, np.inf, depth).astype(np.float32)
    if "depth_metric" in outputs:
        matrix, kind = camera_view.view.clip_from_view, camera_view.view.projection
        metric = projected_metric(
            matrix[2, 3] - matrix[2, 2] * depth,
            camera_view.clip,
            *metric_range(kind, camera_view.clip, camera_view.near, camera_view.far),
        )
        results["depth_metric"] = np.where(nothing, 1.0, metric).astype(np.float32)
    seen = ~nothing
    if "triangle" in outputs:
        results["triangle"] = triangle
        added = scene.scene_triangles
        if added.any():  # some nodes of the scene are not drawn, or blend
            added = added[np.frombuffer(scene.owners.buffer.read(), np.uint32)]
            results["triangle"] = np.where(seen, triangle + added[triangle], -1).astype(np.int32)
    if "node" in outputs:
        owners = scene.scene_numbers[np.frombuffer(scene.owners.buffer.read(), np.uint32)]
        results["node"] = np.where(seen, owners[triangle], -1).astype(np.int32)
    if planes is not None:
        results.update(_surface(outputs, scene, camera_view, planes, triangle, depth, seen))
    return results


def _surface(
    outputs: Collection[str],
    scene: GpuScene,
    camera_view: CameraView,
    planes: NDArray[np.float32],
    triangle: NDArray[np.int32],
    depth: Array,
    seen: NDArray[np.bool_],
) -> dict[str, Any]:
    planes = planes[triangle[seen]].astype(np.float64)
    starts, directions = (each[seen] for each in camera_view.camera.rays(camera_view.size))
    normal, height = planes[:, :3], planes[:, 3]
    point = starts - scene.origin + depth[seen][:, None] * directions
    # depth was interpolated between snapped vertices: project back onto the plane, as pass/resolve.frag does
    point += normal * (height - np.einsum("ij,ij->i", normal, point))[:, None]
    point += scene.origin
    if scene.capsules:
        normal = normal.copy()
        number = triangle[seen]
        for node in np.flatnonzero(scene.round).tolist():
            mesh = scene.nodes[node].mesh
            mine = np.flatnonzero((number >= scene.first[node]) & (number < scene.first[node] + mesh.count))
            if isinstance(mesh, Capsules) and len(mine):
                near = starts[mine] + depth[seen][mine, None] * directions[mine]
                element = number[mine] - scene.first[node]
                point[mine], normal[mine] = surface_points(mesh, scene.world_from_mesh[node], element, near)
    results: dict[str, Any] = {}
    if "normal" in outputs:
        away = np.einsum("ij,ij->i", normal, directions) > 0.0
        results["normal"] = _placed(np.where(away[:, None], -normal, normal), seen, np.float32)
    if "position" in outputs:
        results["position"] = _placed(point, seen, np.float64)
    return results


def _placed(values: Array, seen: NDArray[np.bool_], dtype: Any) -> NDArray[Any]:
    """Scatter the values of visible pixels into an image; NaN elsewhere."""
    image = np.full((*seen.shape, values.shape[-1]), np.nan, dtype=dtype)
    image[seen] = values
    return image
