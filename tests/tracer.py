"""A ray tracer of the tests' own: float64, no epsilon, no code in common with what it judges.

A tree of boxes over triangles; Moller, Trumbore 1997 in float64. A receiver's own triangle is left out by its number, so that shadow
rays need no offset. Compiled by numba on first use (some five seconds, then cached).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numba
import numpy as np
from numpy.typing import NDArray

from glshadow.scene.mesh import AlphaMode
from glshadow.scene.nodes import Scene

Array = NDArray[np.float64]
Ints = NDArray[np.int32]

_LEAF = 4  # triangles
_ROUNDED = 1e-14  # of a coordinate: boxes are grown by more than float64 rounds


@numba.njit(cache=True)
def _build(low, high, middle, order, box, child, count):  # type: ignore[no-untyped-def]
    """Split boxes at the middle of the longest side of their triangles' middles; returns the number of boxes."""
    stack = np.zeros((128, 3), np.int64)
    stack[0] = 0, 0, len(order)
    top, made = 1, 1
    while top:
        top -= 1
        node, first, last = stack[top]
        for k in range(3):
            box[node, k], box[node, 3 + k] = np.inf, -np.inf
        least, most = np.full(3, np.inf), np.full(3, -np.inf)
        for i in range(first, last):
            t = order[i]
            for k in range(3):
                box[node, k] = min(box[node, k], low[t, k])
                box[node, 3 + k] = max(box[node, 3 + k], high[t, k])
                least[k] = min(least[k], middle[t, k])
                most[k] = max(most[k], middle[t, k])
        axis = np.argmax(most - least)
        if last - first <= _LEAF or not most[axis] > least[axis]:
            child[node], count[node] = first, last - first
            continue
        border = 0.5 * (least[axis] + most[axis])
        i, j = first, last
        while i < j:
            if middle[order[i], axis] <= border:
                i += 1
            else:
                j -= 1
                order[i], order[j] = order[j], order[i]
        if i in (first, last) or top > 120:  # rounding, or a tree too deep: halves of any kind
            i = (first + last) // 2
        child[node], count[node] = made, 0
        stack[top] = made, first, i
        stack[top + 1] = made + 1, i, last
        top, made = top + 2, made + 2
    return made


@numba.njit(cache=True)
def _meets(a, b, c, o, d):  # type: ignore[no-untyped-def]
    """Distance in units of d at which a ray meets a triangle, its edges included; nan where it does not."""
    e1x, e1y, e1z = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    e2x, e2y, e2z = c[0] - a[0], c[1] - a[1], c[2] - a[2]
    px, py, pz = d[1] * e2z - d[2] * e2y, d[2] * e2x - d[0] * e2z, d[0] * e2y - d[1] * e2x
    det = e1x * px + e1y * py + e1z * pz
    if det == 0.0:
        return np.nan
    sx, sy, sz = o[0] - a[0], o[1] - a[1], o[2] - a[2]
    u = (sx * px + sy * py + sz * pz) / det
    if not (0.0 <= u <= 1.0):
        return np.nan
    qx, qy, qz = sy * e1z - sz * e1y, sz * e1x - sx * e1z, sx * e1y - sy * e1x
    v = (d[0] * qx + d[1] * qy + d[2] * qz) / det
    if not (v >= 0.0 and u + v <= 1.0):
        return np.nan
    return (e2x * qx + e2y * qy + e2z * qz) / det


@numba.njit(cache=True)
def _trace_one(corners, order, box, child, count, o, d, least, most, own, casts, stop):  # type: ignore[no-untyped-def]
    stack = np.zeros(128, np.int64)
    top, best, nearest = 1, -1, most
    while top:
        top -= 1
        node = stack[top]
        enter, leave = least, nearest
        for k in range(3):
            lo, hi = box[node, k], box[node, 3 + k]
            if d[k] == 0.0:
                if o[k] < lo or o[k] > hi:
                    leave = -np.inf
                continue
            x, y = (lo - o[k]) / d[k], (hi - o[k]) / d[k]
            if x > y:
                x, y = y, x
            enter, leave = max(enter, x - _ROUNDED * abs(x)), min(leave, y + _ROUNDED * abs(y))
        if enter > leave:
            continue
        if count[node] == 0:
            stack[top], stack[top + 1] = child[node], child[node] + 1
            top += 2
            continue
        for i in range(child[node], child[node] + count[node]):
            t = order[i]
            if t == own or not casts[t]:
                continue
            far = _meets(corners[t, 0], corners[t, 1], corners[t, 2], o, d)
            if far > least and far < nearest:
                best, nearest = t, far
                if stop:
                    return best, nearest
    return best, nearest


@numba.njit(cache=True, parallel=True)
def _trace(corners, order, box, child, count, o, d, least, most, own, casts, stop, found, far):  # type: ignore[no-untyped-def]
    for i in numba.prange(len(d)):
        found[i], far[i] = _trace_one(
            corners, order, box, child, count, o[i], d[i], least[i], most[i], own[i], casts, stop
        )


class Tracer:
    """Rays against triangles.

    Parameters
    ----------
    corners : (T, 3, 3) float64
    """

    def __init__(self, corners: Array) -> None:
        self.corners = np.ascontiguousarray(corners, dtype=np.float64)
        count = len(corners)
        low, high = self.corners.min(axis=1), self.corners.max(axis=1)
        self._order = np.arange(count, dtype=np.int64)
        self._box = np.zeros((2 * count + 1, 6))
        self._child, self._count = np.zeros((2, 2 * count + 1), dtype=np.int64)
        _build(low, high, self.corners.mean(axis=1), self._order, self._box, self._child, self._count)
        grown = _ROUNDED * np.abs(self._box)
        self._box[:, :3] -= grown[:, :3]
        self._box[:, 3:] += grown[:, 3:]
        normals = np.cross(self.corners[:, 1] - self.corners[:, 0], self.corners[:, 2] - self.corners[:, 0])
        length = np.linalg.norm(normals, axis=1, keepdims=True)
        self.normals = normals / np.where(length > 0.0, length, 1.0)

    def trace(
        self,
        origins: Array,
        directions: Array,
        least: Any = 0.0,
        most: Any = np.inf,
        own: Any = -1,
        casts: NDArray[np.bool_] | None = None,
        any_hit: bool = False,
    ) -> tuple[Ints, Array]:
        """The nearest triangle, or any, that each ray meets between two distances, in units of its direction.

        Parameters
        ----------
        origins, directions : (N, 3) float64
        least, most : (N,) or float
        own : (N,) ints or int
            A triangle that each ray leaves out.
        casts : (T,) bool, optional
            Which triangles there are; all if None.

        Returns
        -------
        triangle : (N,) int32
            -1: none.
        distance : (N,) float64
        """
        n = len(directions)
        each = [np.ascontiguousarray(np.broadcast_to(v, (n, 3)), dtype=np.float64) for v in (origins, directions)]
        ends = [np.ascontiguousarray(np.broadcast_to(v, (n,)), dtype=np.float64) for v in (least, most)]
        skipped = np.ascontiguousarray(np.broadcast_to(own, (n,)), dtype=np.int64)
        casts = np.ones(len(self.corners), dtype=bool) if casts is None else casts
        found, far = np.full(n, -1, dtype=np.int32), np.zeros(n)
        _trace(
            self.corners,
            self._order,
            self._box,
            self._child,
            self._count,
            *each,
            *ends,
            skipped,
            casts,
            any_hit,
            found,
            far,
        )
        return found, far


def scene_triangles(scene: Scene) -> tuple[Array, NDArray[np.int64], NDArray[np.bool_]]:
    """World corners (T, 3, 3), nodes (T,) of a scene's triangles, and which of these cast: not those of blended materials."""
    corners, nodes, casts = [], [], []
    for number, node in enumerate(scene.nodes):
        matrix, mesh = np.asarray(node.world_from_mesh, dtype=np.float64), node.mesh
        placed = np.asarray(mesh.positions, dtype=np.float64) @ matrix[:3, :3].T + matrix[:3, 3]
        corners.append(placed[mesh.triangles])
        nodes.append(np.full(len(mesh.triangles), number))
        casts.append(np.full(len(mesh.triangles), node.casts and mesh.material.alpha_mode is not AlphaMode.BLEND))
    return np.concatenate(corners), np.concatenate(nodes), np.concatenate(casts)


def pixel_rays(camera: Any, size: tuple[int, int], offset: tuple[float, float] = (0.5, 0.5)) -> tuple[Array, Array]:
    """Origins and directions (H * W, 3) of the rays through every pixel of a perspective or orthographic camera, row 0 at the top."""
    width, height = size
    forward = np.subtract(camera.target, camera.position)
    forward /= np.linalg.norm(forward)
    right = np.cross(forward, camera.up)
    right /= np.linalg.norm(right)
    up = np.cross(right, forward)
    high = camera.height if hasattr(camera, "height") else 2.0 * np.tan(np.radians(0.5 * camera.fov_y))
    wide = high * width / height * camera.pixel_aspect
    x = ((np.arange(width) + offset[0]) / width - camera.principal[0]) * wide
    y = (camera.principal[1] - (np.arange(height) + offset[1]) / height) * high
    across = (x[None, :, None] * right + y[:, None, None] * up).reshape(-1, 3)
    eye = np.asarray(camera.position, dtype=np.float64)
    if hasattr(camera, "height"):
        return eye + across, np.broadcast_to(forward, across.shape)
    return np.broadcast_to(eye, across.shape), across + forward


@dataclass(eq=False)
class View:
    """What the exact ray through each pixel meets, and what it sees of lights that have no size.

    Parameters
    ----------
    scene, camera, size
    triangle : (H * W,) ints, optional
        Surfaces to take instead of those that rays meet first: where the ray meets their planes.
    tracer : Tracer, optional
        Of the same scene, so that it need not be built again.
    """

    scene: Scene
    camera: Any
    size: tuple[int, int]
    offset: tuple[float, float] = (0.5, 0.5)
    triangle: Any = None
    tracer: Tracer | None = None

    def __post_init__(self) -> None:
        corners, self.node, self.casts = scene_triangles(self.scene)
        self.tracer = self.tracer or Tracer(corners)
        self.origins, self.directions = pixel_rays(self.camera, self.size, self.offset)
        if self.triangle is None:
            self.triangle, _ = self.tracer.trace(self.origins, self.directions)
        self.triangle = np.asarray(self.triangle, dtype=np.int32).reshape(-1)
        self.rows = np.flatnonzero(self.triangle >= 0)
        own, o, d = self.triangle[self.rows], self.origins[self.rows], self.directions[self.rows]
        normal, corner = self.tracer.normals[own], self.tracer.corners[own, 0]
        with np.errstate(all="ignore"):
            along = np.einsum("ij,ij->i", corner - o, normal) / np.einsum("ij,ij->i", d, normal)
        self.points = o + along[:, None] * d
        away = np.einsum("ij,ij->i", normal, d) > 0.0
        self.normals = np.where(away[:, None], -normal, normal)

    @cached_property
    def _tolerance(self) -> float:
        """Distance below which a ray meets what touches its start; of the scene's coordinates, some hundred roundings of float64."""
        assert self.tracer is not None
        return 1e-13 * float(np.abs(self.tracer.corners).max())

    def visibility(self, towards: Any = None, position: Any = None) -> NDArray[np.float32]:
        """1 where a light is seen, 0 where not, nan where there is no surface (H, W); of a direction to a sun, or of a place."""
        assert self.tracer is not None
        own = self.triangle[self.rows]
        if towards is not None:
            rays = np.broadcast_to(np.asarray(towards, dtype=np.float64), self.points.shape)
            most: Any = np.inf
        else:
            rays, most = np.asarray(position, dtype=np.float64) - self.points, 1.0 - 1e-13
        length = np.linalg.norm(rays, axis=1)
        self.blocker, _ = self.tracer.trace(self.points, rays, self._tolerance / length, most, own, self.casts)
        lit = (np.einsum("ij,ij->i", self.normals, rays) > 0.0) & (self.blocker < 0)
        result = np.full(len(self.triangle), np.nan, dtype=np.float32)
        result[self.rows] = lit
        return result.reshape(self.size[::-1])
