"""Rays through a scene with Embree: first hits, and whether a segment is blocked.

Embree works in float32: every decision about a shadow is checked again in float64. It gets geometry relative to a float64 origin near the
eye and scaled to about 1.
"""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshadow.core.spaces import Array, Bools, cofactors, world_positions
from glshadow.errors import SceneError
from glshadow.geometry.smooth import sides, unit_vectors
from glshadow.geometry.welding import welded
from glshadow.reference.embree import Embree, Ints, dot
from glshadow.reference.masks import texture_alpha
from glshadow.scene.mesh import AlphaMode, Mesh
from glshadow.scene.nodes import Scene

MAX_PASSED = 64  # surfaces on one ray that do not block: its own triangle, coplanar copies, texels removed by alpha
U = 2.0**-24  # float32's unit roundoff
# Half the thickness of the slab around a plane in which a point is on the plane, in U * (largest coordinate): rounding of the point, the
# vertices and the plane distance, with a safety factor of 4.
PLANE_BOUND = 8.0 * U
# How far an origin is lifted off the plane that it must not hit again: rounding of origin and vertices, sqrt(3) U each.
LIFT = 4.0 * U


class Rays:
    """A scene's triangles in float64 and in Embree; a scene with points or lines needs `reference.capsules.CapsuleRays`.

    Triangles are numbered in the order of nodes, then of each mesh's triangles. Positions are relative to `origin`.

    Parameters
    ----------
    scene : Scene
    origin : (3,) float64
        World point that becomes zero: precision is highest near it.
    """

    def __init__(self, scene: Scene, origin: Array) -> None:
        self.scene = scene
        self.origin = np.asarray(origin, dtype=np.float64)
        nodes = scene.nodes
        self.corners = np.concatenate(
            [world_positions(n.mesh.positions, n.world_from_mesh, self.origin)[self._vertices(n.mesh)] for n in nodes]
        )
        counts = [node.mesh.count for node in nodes]
        self.node = np.repeat(np.arange(len(nodes), dtype=np.int32), counts)
        self.first = np.cumsum([0, *counts])[:-1]  # index of each node's first triangle
        self.reach = np.abs(self.corners).max(axis=(1, 2))
        self.size = float(self.reach.max())
        a, b, c = (self.corners[:, k] / self.size for k in range(3))
        normals = np.cross(b - a, c - a)
        length = np.linalg.norm(normals, axis=1)
        self.solid = length > 0.0
        self.normals = normals / np.where(self.solid, length, 1.0)[:, None]
        self.normals[~self.solid] = (0.0, 1.0, 0.0)
        self._check()

    def _vertices(self, mesh: Mesh) -> NDArray[np.integer]:
        return mesh.triangles

    def _check(self) -> None:
        if not self.solid.any():
            raise SceneError(f"{self.scene.name}: nothing to trace, every triangle has zero area")

    def facing(self, own: Ints, points: Array) -> Array:
        """Unit normals (N, 3) of triangles (N,) at points (N, 3) of them."""
        return np.asarray(self.normals[own])

    def tangent_distance(self, own: Ints, points: Array, moved: Array) -> Array:
        """Signed distances (N,) of other points (N, 3) to the tangent planes at points (N, 3) of triangles (N,)."""
        return self.plane_distance(own, moved)

    def shown(self, own: Ints, eye: Array, directions: Array, points: Array, normals: Array) -> tuple[Array, Array]:
        """Points and normals of surfaces that an image shows, where they are not those of triangles."""
        return points, normals

    def __getstate__(self) -> dict[str, Any]:
        return {k: v for k, v in self.__dict__.items() if k not in ("_drawn", "_casting")}  # Embree's cannot be pickled

    @cached_property
    def round_normals(self) -> Array | None:
        """Unit vertex normals (T, 3, 3) of smooth triangles, on the triangle's side; zero for others. None: no normals."""
        nodes = self.scene.nodes
        if all(node.mesh.normals is None for node in nodes):
            return None
        found = np.zeros_like(self.corners)
        for node, first in zip(nodes, self.first, strict=True):
            mesh = node.mesh
            if mesh.normals is not None and len(mesh.triangles):
                here = slice(first, first + len(mesh.triangles))
                normals = unit_vectors(mesh.normals @ cofactors(node.world_from_mesh[:3, :3]).T)[mesh.triangles]
                found[here] = normals * sides(self.normals[here], normals)[:, None, None]
        found[~self.solid] = 0.0
        return found

    @cached_property
    def round(self) -> Bools:
        """Triangles (T,) that are shaded as parts of a smooth surface, see `geometry.smooth`."""
        normals = self.round_normals
        return np.zeros(len(self.node), dtype=bool) if normals is None else np.asarray(normals.any(axis=(1, 2)))

    @cached_property
    def masked(self) -> Bools:
        """Triangles (T,) whose material has alpha-tested texels."""
        return np.array([n.mesh.material.alpha_mode is AlphaMode.MASK for n in self.scene.nodes])[self.node]

    @cached_property
    def culls(self) -> NDArray[np.int8]:
        """(T,) 1 where the camera sees through triangles from behind, -1 there if the node mirrors them, 0 elsewhere."""
        nodes = self.scene.nodes
        sides = [
            n.mesh.material.cull_back_faces * (-1 if np.linalg.det(n.world_from_mesh[:3, :3]) < 0.0 else 1)
            for n in nodes
        ]
        return np.array(sides, dtype=np.int8)[self.node]

    @cached_property
    def _box(self) -> Array:
        """(2, 3) corners of the scene's box, with a margin above float32's rounding."""
        flat = self.corners.reshape(-1, 3)
        return np.stack([flat.min(axis=0) - 1e-3 * self.size, flat.max(axis=0) + 1e-3 * self.size])

    @cached_property
    def _drawn(self) -> Embree:
        return Embree(self.corners, np.flatnonzero(self.seen), self.size)

    @cached_property
    def seen(self) -> Bools:
        """Triangles (T,) that cameras see: with a non-zero area, of a node that is drawn and does not blend."""
        return np.asarray(self.solid & np.array([n.drawn and not n.blends for n in self.scene.nodes])[self.node])

    @cached_property
    def receives(self) -> Bools:
        """Triangles (T,) that can be in shadow."""
        return np.array([node.receives for node in self.scene.nodes])[self.node]

    @cached_property
    def casts(self) -> Bools:
        """Triangles (T,) that block light: with a non-zero area, not blended, of a node that casts."""
        return np.asarray(self.seen & self.casting[self.node])

    @cached_property
    def casting(self) -> Bools:
        """Nodes that cast shadows."""
        return np.array([node.casts for node in self.scene.nodes])

    @cached_property
    def _casting(self) -> Embree | None:
        casting = np.flatnonzero(self.casts)
        if len(casting) == self.seen.sum():
            return self._drawn
        return Embree(self.corners, casting, self.size) if len(casting) else None

    @cached_property
    def _dual(self) -> Array:
        """(T, 2, 3): dot products with an offset from the first corner are the barycentric weights of the other two."""
        a, b, c = (self.corners[:, k] / self.size for k in range(3))
        n = np.cross(b - a, c - a)
        square = np.where(self.solid, dot(n, n), 1.0)[:, None] * self.size
        return np.stack([np.cross(c - a, n) / square, np.cross(n, b - a) / square], axis=1)

    @cached_property
    def body(self) -> Ints:
        """(T,) index of the connected body of each triangle, welded by exact position."""
        from scipy.sparse import coo_array
        from scipy.sparse.csgraph import connected_components

        vertex = welded(self.corners.reshape(-1, 3)).reshape(-1, 3)
        start, end = vertex[:, :2].ravel(), vertex[:, 1:].ravel()
        count = int(vertex.max()) + 1
        graph = coo_array((np.ones(len(start), dtype=bool), (start, end)), shape=(count, count))
        return np.asarray(connected_components(graph, directed=False)[1][vertex[:, 0]], dtype=np.int32)

    def plane_distance(self, triangles: Ints, points: Array) -> Array:
        """Signed distances (N,) of points (N, 3) to the planes of triangles (N,)."""
        return dot(points - self.corners[triangles, 0], self.normals[triangles])

    def barycentric(self, triangles: Ints, points: Array) -> Array:
        """Weights (N, 3), sum 1, of points (N, 3) in the planes of triangles (N,), clamped to the triangles."""
        offset, dual = points - self.corners[triangles, 0], self._dual[triangles]
        second, third = dot(offset, dual[:, 0]), dot(offset, dual[:, 1])
        weights = np.stack([1.0 - second - third, second, third], axis=1)
        weights = np.maximum(weights, 0.0)
        return np.asarray(weights / (weights[:, :1] + weights[:, 1:2] + weights[:, 2:]))

    def first_hits(self, starts: Array, directions: Array, length: Array, camera: bool = False) -> tuple[Ints, Array]:
        """The first surface along each ray.

        Parameters
        ----------
        starts, directions : (N, 3) float64
            Relative to `origin`; directions of any length.
        length : (N,) float64
            Length of each ray in units of its direction; infinite for no end.
        camera : bool
            Whether the rays are a camera's, which pass through triangles from behind where their material culls back faces.

        Returns
        -------
        (N,) int32, (N, 3) float64
            Triangle index or -1; the point on that triangle (intersection with its plane in float64, clamped to the triangle).
        """
        triangles = np.full(len(starts), -1, dtype=np.int32)
        points = np.full(starts.shape, np.nan)
        live = np.arange(len(starts))
        at, left = self._entered(starts, directions, length)
        for _ in range(MAX_PASSED):
            hit = self._drawn.first(at, directions[live], left)
            some = hit >= 0
            live, at, left, hit = live[some], at[some], left[some], hit[some]
            if len(live) == 0:
                break
            point = self._on_triangle(hit, at, directions[live])
            keep = self.opaque(hit, point)
            if camera:
                keep &= dot(self.normals[hit], directions[live]) * self.culls[hit] <= 0.0
            triangles[live[keep]], points[live[keep]] = hit[keep], point[keep]
            live, hit, point, before = live[~keep], hit[~keep], point[~keep], at[~keep]
            at = self._lifted(hit, point, directions[live])
            left = left[~keep] - _along(directions[live], at - before)
            go = left > 0.0
            live, at, left = live[go], at[go], left[go]
        return triangles, points

    def _entered(self, starts: Array, directions: Array, length: Array) -> tuple[Array, Array]:
        """Starts moved to the rays' entry into the scene's box: a distant eye would be rounded in float32."""
        low, high = self._box
        with np.errstate(divide="ignore", invalid="ignore"):
            near = np.minimum((low - starts) / directions, (high - starts) / directions)
        near = np.where(np.isfinite(near), near, 0.0)
        enter = np.maximum(np.maximum(near[:, 0], near[:, 1]), np.maximum(near[:, 2], 0.0))
        return np.asarray(starts + enter[:, None] * directions), length - enter

    def _on_triangle(self, triangles: Ints, starts: Array, directions: Array) -> Array:
        normal, corner = self.normals[triangles], self.corners[triangles, 0]
        slope = dot(directions, normal)
        t = dot(corner - starts, normal) / np.where(slope == 0.0, 1.0, slope)
        points = starts + t[:, None] * directions
        weights = self.barycentric(triangles, points)
        # Rays that miss the triangle by float32's rounding, and grazing ones, get a point on its edge; all others stay exact.
        a, b, c = weights.T
        outside = np.flatnonzero((a == 0.0) | (b == 0.0) | (c == 0.0) | (slope == 0.0))
        points[outside] = np.einsum("nk,nkj->nj", weights[outside], self.corners[triangles[outside]])
        return points

    def _lifted(self, triangles: Ints, points: Array, directions: Array, factor: Array | float = 1.0) -> Array:
        """Points on triangles, moved off their planes along the directions."""
        normal = self.facing(triangles, points)
        side = np.where(dot(normal, directions) < 0.0, -1.0, 1.0)
        return np.asarray(points + normal * (side * factor * LIFT * self.reach[triangles])[:, None])

    def opaque(self, triangles: Ints, points: Array) -> Bools:
        """Whether the surface exists at the points: False where MASK alpha (factor, vertices and texture, bilinear at level 0, multiplied)
        is below the cutoff."""
        exists = np.ones(len(triangles), dtype=bool)
        cut = np.flatnonzero(self.masked[triangles])
        for number in np.unique(self.node[triangles[cut]]):
            mine = cut[self.node[triangles[cut]] == number]
            mesh = self.scene.nodes[number].mesh
            alpha = np.full(len(mine), mesh.material.color[3])
            corners = mesh.triangles[triangles[mine] - self.first[number]]
            weights = self.barycentric(triangles[mine], points[mine])
            if mesh.colors is not None:
                a, b, c = mesh.colors[:, 3].astype(np.float64)[corners].T
                alpha = alpha * (a + (b - a) * weights[:, 1] + (c - a) * weights[:, 2])  # exact if all are equal
            if mesh.placed_uv is not None and mesh.material.texture is not None:
                uv = np.einsum("nk,nkj->nj", weights, mesh.placed_uv.astype(np.float64)[corners])
                alpha = alpha * texture_alpha(mesh.material, uv)
            exists[mine] = alpha >= mesh.material.cutoff
        return exists

    def blocked(
        self, own: Ints, points: Array, directions: Array, length: Array, lifted: Bools | None = None
    ) -> tuple[Bools, Array]:
        """Whether open segments from points on surfaces to the light are blocked: parameters, rules and distances as of `blockers`."""
        found, distance = self.blockers(own, points, directions, length, lifted)
        return found >= 0, distance

    def blockers(
        self, own: Ints, points: Array, directions: Array, length: Array, lifted: Bools | None = None
    ) -> tuple[Ints, Array]:
        """The triangles that block open segments from points to the light, those that are nearest to the points.

        A triangle blocks unless it is the point's own (by index), or its plane passes within PLANE_BOUND * (largest coordinate of both
        triangles) of the point or of the light, or alpha removes it. Rays pass through the others: the ray continues from the intersection
        with that plane, lifted off it by float32's rounding, so that nothing behind is skipped.

        Parameters
        ----------
        own : (N,) int32
            Triangles of the points; -1: none.
        points : (N, 3) float64
            Relative to `origin`.
        directions : (N, 3) float64
            Unit vectors to the light.
        length : (N,) float64
            Distance to the light; infinite for a directional light.
        lifted : (N,) bool, optional
            Points that are off their own triangle, which can then block like any other.

        Returns
        -------
        (N,) int32, (N,) float64
            The first occluder, -1 if there is none; distance to it, infinite if there is none.
        """
        result, distance = np.full(len(own), -1, dtype=np.int32), np.full(len(own), np.inf)
        if self._casting is None:
            return result, distance
        live = np.arange(len(own))
        skipped = own if lifted is None else np.where(lifted, np.int32(-1), own)
        free = own < 0
        reach = np.where(free, np.abs(points).max(axis=1, initial=0.0), self.reach[own])
        at = np.where(free[:, None], points, self._lifted(own, points, directions))
        last, factor = own, np.ones(len(own))
        for _ in range(MAX_PASSED):
            hit = self._casting.first(at, directions[live], length[live] - _along(directions[live], at - points[live]))
            some = hit >= 0
            live, last, factor, hit = live[some], last[some], factor[some], hit[some]
            if len(live) == 0:
                break
            start, towards = points[live], directions[live]
            slope = dot(self.normals[hit], towards)
            away = -self.plane_distance(hit, start) * np.sign(slope)  # > 0: the plane is between the point and infinity
            bound = PLANE_BOUND * np.maximum(reach[live], self.reach[hit])
            with np.errstate(invalid="ignore"):
                beyond = np.where(np.isinf(length[live]), np.inf, length[live] * np.abs(slope)) - away
            t = away / np.where(slope == 0.0, 1.0, np.abs(slope))
            met = start + t[:, None] * towards
            counts = (hit != skipped[live]) & (away > bound) & (beyond > bound) & (slope != 0.0)
            counts[counts] = self.opaque(hit[counts], met[counts])
            result[live[counts]], distance[live[counts]] = hit[counts], t[counts]
            on = ~counts
            live, hit, met, towards, t = live[on], hit[on], met[on], towards[on], t[on]
            # hit again: the rounding was larger than the lift
            factor = np.where(hit == last[on], 2.0 * factor[on], 1.0)
            met = np.where((t > 0.0)[:, None], met, points[live])  # hit behind the point, by rounding
            at, last = self._lifted(hit, met, towards, factor), hit
        return result, distance


def _along(directions: Array, offsets: Array) -> Array:
    """Projections of offsets (N, 3) on directions (N, 3), in units of the directions."""
    return dot(offsets, directions) / dot(directions, directions)
