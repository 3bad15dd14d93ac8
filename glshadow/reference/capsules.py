"""Rays through a scene with points and lines: balls and tubes in float64, found by boxes around them in Embree."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshadow.core.spaces import Array, Bools
from glshadow.errors import SceneError
from glshadow.reference.embree import Embree, Ints, dot
from glshadow.reference.rays import LIFT, PLANE_BOUND, Rays
from glshadow.scene.capsules import Capsules, radius_scale
from glshadow.scene.mesh import Mesh
from glshadow.scene.nodes import Scene

MOST_BOXES = 1 << 14  # sides of boxes that one ray passes
# Triangles of a box, by the bits of its corners: x, y, z.
_FACES = np.array([
    [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3], [0, 4, 5], [0, 5, 1],
    [2, 3, 7], [2, 7, 6], [0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5],
], dtype=np.int32)  # fmt: skip
_LOOSE = (0.02, 0.12)
"""By what share of the radius the sides of boxes are moved outward, each by another one: sides of boxes beside each other then do not
coincide, and a ray that continues behind one side skips no other."""


def has_capsules(scene: Scene) -> bool:
    """Whether a scene has points or lines."""
    return any(isinstance(node.mesh, Capsules) and node.mesh.count > 0 for node in scene.nodes)


class CapsuleRays(Rays):
    """Triangles, balls and tubes of a scene, numbered together in the order of nodes.

    In `corners` a capsule's are its two ends and the first one again: a triangle without area, which Embree does not hold.
    """

    def __init__(self, scene: Scene, origin: Array) -> None:
        super().__init__(scene, origin)
        self.radius = np.zeros(len(self.node))
        for node, first in zip(scene.nodes, self.first, strict=True):
            if isinstance(node.mesh, Capsules):
                radius = node.mesh.radius * radius_scale(node.world_from_mesh)
                self.radius[first : first + node.mesh.count] = radius
        self.curved = self.radius > 0.0
        self.reach = self.reach + self.radius
        self.size = float(self.reach.max())

    def __getstate__(self) -> dict[str, Any]:
        return {k: v for k, v in super().__getstate__().items() if k not in ("_drawn_boxes", "_casting_boxes")}

    def _vertices(self, mesh: Mesh) -> NDArray[np.integer]:
        return mesh.ends[:, [0, 1, 0]] if isinstance(mesh, Capsules) else mesh.triangles

    def _check(self) -> None:
        """Nothing: there are balls or tubes."""

    @cached_property
    def _box(self) -> Array:
        low = (self.corners.min(axis=1) - self.radius[:, None]).min(axis=0)
        high = (self.corners.max(axis=1) + self.radius[:, None]).max(axis=0)
        return np.stack([low - 1e-3 * self.size, high + 1e-3 * self.size])

    @cached_property
    def _drawn_boxes(self) -> _Boxes:
        return self._boxes(np.array([node.drawn for node in self.scene.nodes]))

    @cached_property
    def _casting_boxes(self) -> _Boxes:
        return self._boxes(np.array([node.drawn for node in self.scene.nodes]) & self.casting)

    def _boxes(self, nodes: Bools) -> _Boxes:
        return _Boxes(self, np.flatnonzero(self.curved & nodes[self.node]))

    def facing(self, own: Ints, points: Array) -> Array:
        """Unit normals (N, 3) at points (N, 3) of elements (N,); of balls and tubes outward."""
        found = self.normals[own]
        rows = np.flatnonzero(self.curved[own])
        if len(rows) == 0:
            return found
        a, b = self.corners[own[rows], 0], self.corners[own[rows], 1]
        along = b - a
        length2 = dot(along, along)
        share = np.clip(dot(points[rows] - a, along) / np.where(length2 > 0.0, length2, 1.0), 0.0, 1.0)
        outward = points[rows] - a - share[:, None] * along
        length = np.sqrt(dot(outward, outward))
        found[rows] = np.where(
            length[:, None] > 0.0, outward / np.where(length > 0.0, length, 1.0)[:, None], found[rows]
        )
        return found

    def tangent_distance(self, own: Ints, points: Array, moved: Array) -> Array:
        """Signed distances (N,) of other points (N, 3) to the tangent planes at points (N, 3) of elements (N,)."""
        flat = super().tangent_distance(own, points, moved)
        return np.where(self.curved[own], dot(moved - points, self.facing(own, points)), flat)

    def shown(self, own: Ints, eye: Array, directions: Array, points: Array, normals: Array) -> tuple[Array, Array]:
        """Points and normals of surfaces that an image shows: of a ball or tube that the ray misses, those nearest to the ray."""
        rows = np.flatnonzero(self.curved[own])
        points, normals = points.copy(), normals.copy()
        near, _, nearest = self._interval(own[rows], eye[rows], directions[rows])
        met = np.isfinite(near)
        near = np.where(met, near, nearest)
        points[rows] = eye[rows] + near[:, None] * directions[rows]
        normals[rows] = self.facing(own[rows], points[rows])
        points[rows] = self._on_surface(own[rows], points[rows], normals[rows])
        return points, normals

    def _on_surface(self, own: Ints, points: Array, normals: Array) -> Array:
        a, along = self.corners[own, 0], self.corners[own, 1] - self.corners[own, 0]
        length2 = dot(along, along)
        share = np.clip(dot(points - a, along) / np.where(length2 > 0.0, length2, 1.0), 0.0, 1.0)
        return np.asarray(a + share[:, None] * along + self.radius[own, None] * normals)

    def first_hits(self, starts: Array, directions: Array, length: Array, camera: bool = False) -> tuple[Ints, Array]:
        """The first surface along each ray, as that of triangles. A ball or tube around the start is not met."""
        elements, points = super().first_hits(starts, directions, length, camera)
        length2 = dot(directions, directions)
        with np.errstate(invalid="ignore"):
            best = np.where(elements >= 0, dot(points - starts, directions) / length2, length)
        at, _ = self._entered(starts, directions, length)
        entered = dot(at - starts, directions) / length2
        boxes = self._drawn_boxes
        for live, element in boxes.along(starts, directions, entered, best):
            near, _, _ = self._interval(element, starts[live], directions[live])
            nearer = (near > 0.0) & (near < best[live])
            rows, found = live[nearer], element[nearer]
            best[rows], elements[rows] = near[nearer], found
            place = starts[rows] + near[nearer, None] * directions[rows]
            points[rows] = self._on_surface(found, place, self.facing(found, place))
        return elements, points

    def blocked(
        self, own: Ints, points: Array, directions: Array, length: Array, lifted: Bools | None = None
    ) -> tuple[Bools, Array]:
        """Whether open segments from points on surfaces to the light are blocked: by triangles as without capsules, by a ball or tube
        that is not the point's own if they are inside it for more than rounding."""
        found, distance = super().blockers(own, points, directions, length, lifted)
        result = found >= 0
        live_length = np.where(result, -1.0, length)
        for live, element in self._casting_boxes.along(points, directions, np.zeros(len(own)), live_length):
            near, far, _ = self._interval(element, points[live], directions[live])
            bound = PLANE_BOUND * np.maximum(self.reach[own[live]], self.reach[element])
            met = (far > bound) & (near < length[live] - bound) & (element != own[live])
            rows = live[met]
            result[rows], live_length[rows] = True, -1.0
            distance[rows] = np.minimum(distance[rows], np.maximum(near[met], 0.0))
        return result, distance

    def blockers(
        self, own: Ints, points: Array, directions: Array, length: Array, lifted: Bools | None = None
    ) -> tuple[Ints, Array]:
        """The elements that block open segments, those that are nearest to the points; by the rules of `blocked`."""
        found, distance = super().blockers(own, points, directions, length, lifted)
        reach = np.where(own < 0, np.abs(points).max(axis=1, initial=0.0), self.reach[own])
        last = np.minimum(distance, length)
        for live, element in self._casting_boxes.along(points, directions, np.zeros(len(own)), last):
            near, far, _ = self._interval(element, points[live], directions[live])
            bound = PLANE_BOUND * np.maximum(reach[live], self.reach[element])
            place = np.maximum(near, 0.0)
            met = (far > bound) & (near < length[live] - bound) & (element != own[live]) & (place < distance[live])
            rows = live[met]
            found[rows], distance[rows], last[rows] = element[met], place[met], place[met]
        return found, distance

    def _interval(self, element: Ints, starts: Array, directions: Array) -> tuple[Array, Array, Array]:
        """Ray parameters (N,) between which rays are inside capsules (N,), (inf, -inf) if nowhere; and those nearest to the axis."""
        radius2 = self.radius[element] ** 2
        length2 = dot(directions, directions)
        low, high = np.full(len(element), np.inf), np.full(len(element), -np.inf)
        closest, nearest = np.full(len(element), np.inf), np.zeros(len(element))

        def join(at: Array, beside: Array, half2: Array, inside: Bools) -> None:
            half = np.sqrt(np.where(inside, half2, 0.0))
            np.copyto(low, np.minimum(low, at - half), where=inside)
            np.copyto(high, np.maximum(high, at + half), where=inside)
            better = beside < closest
            np.copyto(nearest, at, where=better)
            np.copyto(closest, beside, where=better)

        a, b = self.corners[element, 0], self.corners[element, 1]
        for centre in (a, b):
            at = dot(centre - starts, directions) / length2
            offset = starts + at[:, None] * directions - centre
            beside = dot(offset, offset)
            join(at, beside, (radius2 - beside) / length2, beside <= radius2)
        axis = b - a
        size2 = dot(axis, axis)
        size2 = np.where(size2 > 0.0, size2, 1.0)
        offset = starts - a
        slope, start = dot(directions, axis) / size2, dot(offset, axis) / size2
        across, aside = directions - slope[:, None] * axis, offset - start[:, None] * axis
        square = dot(across, across)
        # along the axis's own direction the balls at its ends are all
        turned = (square > 1e-24 * length2) & (dot(axis, axis) > 0.0)
        at = -dot(aside, across) / np.where(turned, square, 1.0)
        between = aside + at[:, None] * across
        beside = dot(between, between)
        half = np.sqrt(np.maximum(radius2 - beside, 0.0) / np.where(turned, square, 1.0))
        with np.errstate(divide="ignore", invalid="ignore"):
            ends = np.sort(np.stack([-start / slope, (1.0 - start) / slope]), axis=0)
        level = slope == 0.0
        within = (start >= 0.0) & (start <= 1.0)
        ends[0] = np.where(level, np.where(within, -np.inf, np.inf), ends[0])
        ends[1] = np.where(level, np.where(within, np.inf, -np.inf), ends[1])
        first, last = np.maximum(at - half, ends[0]), np.minimum(at + half, ends[1])
        wall = turned & (beside <= radius2) & (first <= last)
        np.copyto(low, np.minimum(low, first), where=wall)
        np.copyto(high, np.maximum(high, last), where=wall)
        share = start + at * slope
        better = turned & (share > 0.0) & (share < 1.0) & (beside < closest)
        np.copyto(nearest, at, where=better)
        return low, high, nearest


class _Boxes:
    """Boxes around capsules in Embree."""

    def __init__(self, rays: CapsuleRays, numbers: NDArray[np.int64]) -> None:
        radius = rays.radius[numbers][:, None]
        generator = np.random.default_rng(11)
        rounding = 8.0 * LIFT * rays.size
        low, high = (
            sign
            * (
                (sign * rays.corners[numbers, :2]).max(axis=1)
                + radius * (1.0 + generator.uniform(*_LOOSE, (len(numbers), 3)))
                + rounding
            )
            for sign in (-1.0, 1.0)
        )
        self._numbers, self._low, self._high = numbers.astype(np.int32), low, high
        bits = (np.arange(8)[:, None] >> np.arange(3)) & 1
        corners = np.where(bits[None] == 1, high[:, None], low[:, None]).reshape(-1, 3)
        self._rays = rays
        self._longest = float(np.sqrt(((high - low) ** 2).sum(axis=1)).max(initial=0.0))
        faces = (8 * np.arange(len(numbers), dtype=np.int32)[:, None, None] + _FACES).reshape(-1, 3)
        self._embree = Embree(corners, np.arange(len(faces), dtype=np.int32), rays.size, faces)

    def along(self, starts: Array, directions: Array, first: Array, last: Array) -> Any:
        """Candidates along rays, a pair of arrays at a time: rows of the rays, and elements whose boxes they meet.

        `last` (N,) may be lowered meanwhile: a ray ends there.
        """
        if len(self._numbers) == 0:
            return
        live = np.flatnonzero(first < last)
        norm = np.sqrt(dot(directions, directions))
        # a ray that starts inside a box meets only its far side, which may lie behind a nearer capsule or the ray's end: begin before
        at = first[live] - self._longest / norm[live]
        for _ in range(MOST_BOXES):
            towards = directions[live]
            face = self._embree.first(starts[live] + at[:, None] * towards, towards, last[live] - at)
            some = face >= 0
            live, at, face, towards = live[some], at[some], face[some], towards[some]
            if len(live) == 0:
                return
            box, side = face // 12, face % 12 // 2
            yield live, self._numbers[box]
            plane = np.where(side % 2 == 0, self._low[box, side // 2], self._high[box, side // 2])
            slope = towards[np.arange(len(live)), side // 2]
            with np.errstate(divide="ignore", invalid="ignore"):
                met = (plane - starts[live, side // 2]) / slope
            step = 4.0 * LIFT * self._rays.size / norm[live]
            at = np.where(np.isfinite(met), np.maximum(met, at), at) + step
            go = at < last[live]
            live, at = live[go], at[go]
        raise SceneError(
            f"{self._rays.scene.name}: a ray meets more than {MOST_BOXES} sides of boxes around points or line segments"
        )
