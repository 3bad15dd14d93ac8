"""The visibility of lights from given points: the passes of an image, over points in place of pixels."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from glshadow.derive.coherence import coherent_order
from glshadow.gl.passes.points import PointTargets
from glshadow.gl.passes.resolve import write_visibility
from glshadow.gl.resources import ResourceCache
from glshadow.gl.scene.geometry import NOT_RECEIVING, GpuScene
from glshadow.point_arguments import PointRequest
from glshadow.scene.faces import face_starts
from glshadow.scene.nodes import Scene

PART = 1 << 21
"""Points that are tested together: some 200 MB."""
_MANY = 4  # passes: for fewer, sorting points into a coherent order takes longer than it spares


def visibility_of_points(cache: ResourceCache, request: PointRequest) -> NDArray[np.float32]:
    """The visibility (L, N); the context must be current."""
    count, lights = len(request.points), request.lights
    seen = np.zeros((len(lights), count), dtype=np.float32)
    passes = sum(_MANY if light.has_size else 1 for light in lights)
    for first in range(0, count, PART):
        part = slice(first, min(first + PART, count))
        some = request.part(part)
        order = coherent_order(some.points) if passes >= _MANY else None
        if order is not None:
            some = some.part(order)
        normals = some.normals is not None
        targets = cache.point_targets(part.stop - part.start, normals)
        frame = cache.point_context(request.scene, targets)
        _upload(frame.scene, targets, some)
        if some.triangles is None:
            cache.point_techniques.locate(frame, targets.located)
            _mark(frame.scene, targets)
        for number, light in enumerate(lights):
            technique = cache.point_techniques.updated(frame, number, light)
            receiver = technique.receiver(frame)
            targets.seen.use()
            write_visibility(frame, light, receiver)
            if order is None:
                seen[number, part] = targets.read(part.stop - part.start)
            else:
                seen[number, part][order] = targets.read(part.stop - part.start)
            if request.progress is not None:
                done = len(lights) * first + (number + 1) * (part.stop - part.start)
                request.progress(done, len(lights) * count, f"light {number + 1} of {len(lights)}")
    cache.context.check_errors("testing points")
    return seen


def _upload(gpu: GpuScene, targets: PointTargets, part: PointRequest) -> None:
    count, size = len(part.points), targets.size[0] * targets.size[1]
    places = np.zeros((size, 4), dtype=np.float32)
    np.subtract(part.points, gpu.origin, out=places[:count, :3], casting="same_kind")
    places[:, 3] = 1.0
    surface = normals = None
    if part.normals is not None:
        normals = np.zeros((size, 4), dtype=np.float32)
        normals[:count, :3] = part.normals
    if part.triangles is not None:
        surface = np.zeros(size, dtype=np.uint32)
        surface[:count], places[:count, 3] = _numbers(gpu, part.scene, part.triangles)
    targets.write(places, surface, normals)


def _mark(gpu: GpuScene, targets: PointTargets) -> None:
    """Add the flags of their nodes to triangles that were found, and exchange the sides of mirrored ones."""
    if not gpu.selective and not any(gpu.mirrored):
        return
    numbers = targets.read_triangles().astype(np.int64)
    owners = np.searchsorted(gpu.first, numbers - 1, side="right") - 1
    marked = gpu.packed_first[owners, 0] + (numbers - 1 - gpu.first[owners]).astype(np.uint32)
    targets.surface.write(np.where(numbers > 0, marked, np.uint32(0)))
    places = targets.read_places()
    places[:, 3] = np.where((numbers > 0) & np.array(gpu.mirrored)[owners], np.float32(-1.0), np.float32(1.0))
    targets.write(places, None, None)


def _numbers(
    gpu: GpuScene, scene: Scene, triangles: NDArray[np.int64]
) -> tuple[NDArray[np.uint32], NDArray[np.float32] | float]:
    """Triangles (N,) by scene-wide number, -1 for none, as the surface buffer has them, and the side of their winding that is the front."""
    nodes, starts = scene.nodes, face_starts(scene)
    shift = np.zeros(len(nodes), dtype=np.int64)
    drawn, mirrored = np.zeros((2, len(nodes)), dtype=bool)
    shift[gpu.scene_numbers] = gpu.first + 1 - starts[gpu.scene_numbers]
    drawn[gpu.scene_numbers] = True
    mirrored[gpu.scene_numbers] = gpu.mirrored
    flags = np.array([0 if node.receives else NOT_RECEIVING for node in nodes], dtype=np.uint32)
    if drawn.all() and not flags.any() and not mirrored.any() and (shift == 1).all():
        return (triangles + 1).astype(np.uint32), 1.0
    free = triangles < 0
    owners = np.searchsorted(starts, np.maximum(triangles, 0), side="right") - 1
    numbers = np.where(free | ~drawn[owners], 0, triangles + shift[owners]).astype(np.uint32)
    side = np.where(mirrored[owners] & ~free, np.float32(-1.0), np.float32(1.0))
    return numbers | np.where(free, np.uint32(0), flags[owners]), side
