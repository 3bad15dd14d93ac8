"""Two lights that glshadow does not have, written as CONTRIBUTING describes: rendering, tracing and spelling work without knowing them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

import glshadow as gs
from glshadow.core.setting import number, setting, vector
from glshadow.core.spaces import Array, Bools, ClipSpace, Triple, direction, rigid_inverse, view_axes
from glshadow.core.spelling import numbers
from glshadow.lights.light import Gizmo, Light
from glshadow.lights.local import LocalLight, SphereLight, unit_and_length
from glshadow.shadows.view import Projection, ShadowView


@dataclass(frozen=True, kw_only=True)
class TubeLight(LocalLight):
    """Light from a straight tube without thickness: a size of its own, and a map of six views."""

    along: Triple = setting(vector(3), (1.0, 0.0, 0.0), help="from its middle to one end")

    spelling: ClassVar[str] = "tube"
    usage: ClassVar[str] = "tube:px,py,pz:ax,ay,az"
    summary: ClassVar[str] = "a straight tube"
    by_place: ClassVar[tuple[str, ...]] = ("position", "along")
    places: ClassVar[tuple[int, int]] = (2, 2)
    snippet: ClassVar[str] = "light/point.glsl"

    @classmethod
    def from_places(cls, texts: Sequence[str]) -> dict[str, Any]:
        return {"position": numbers(texts[0], 3), "along": numbers(texts[1], 3)}

    @property
    def has_size(self) -> bool:
        return True

    @property
    def source_radius(self) -> float:
        return float(np.linalg.norm(self.along))

    def _at(self, shares: Array) -> tuple[Light, ...]:
        places = np.asarray(self.position) + shares[:, None] * np.asarray(self.along)
        return tuple(gs.PointLight(position=tuple(place.tolist()), shadow=self.shadow) for place in places)

    def hard_lights(self, count: int) -> tuple[Light, ...]:
        return self._at((2.0 * np.arange(count) + 1.0) / count - 1.0)

    def extremes(self) -> tuple[Light, ...]:
        return self._at(np.array([-1.0, 1.0]))

    def aims(self, points: Array, samples: int, generator: np.random.Generator) -> Iterator[tuple[Array, Array]]:
        for k in range(samples):
            share = 2.0 * (k + generator.uniform(size=len(points))) / samples - 1.0
            yield unit_and_length(np.asarray(self.position) + share[:, None] * np.asarray(self.along) - points)

    def gizmo(self, size: float, far: float) -> Gizmo:
        ends = np.asarray(self.position) + np.array([[-1.0], [1.0]]) * np.asarray(self.along)
        return Gizmo(ends[None], width=4.0)


SNIPPET = """
uniform mat3 u_beam; // right and up, over the tangents of half its width and half its height, and forward
#include "lib/reach.glsl"

bool light_shines_on(vec3 position_lv) {
    float depth = dot(position_lv, u_beam[2]);
    return abs(dot(position_lv, u_beam[0])) <= depth && abs(dot(position_lv, u_beam[1])) <= depth;
}

vec4 light_arriving(vec3 position_lv) {
    float distance_lv = length(position_lv);
    vec3 towards = -position_lv / max(distance_lv, 1e-30);
    return vec4(towards, faded(light_shines_on(position_lv) ? 1.0 : 0.0, distance_lv));
}
"""
"""glsl/light/beam.glsl"""


@dataclass(frozen=True, kw_only=True)
class BeamLight(SphereLight):
    """Light from a point into a pyramid of four sides, like a projector: one view, and GLSL of its own."""

    direction: Triple = setting(direction, (0.0, -1.0, 0.0), help="the way the light travels")
    width: float = setting(number(0.0, 10.0, above=True), 1.0, help="tangent of half its opening angle, right and left")
    height: float = setting(number(0.0, 10.0, above=True), 0.5, help="the same, up and down")

    spelling: ClassVar[str] = "beam"
    usage: ClassVar[str] = "beam:px,py,pz:dx,dy,dz"
    summary: ClassVar[str] = "a pyramid"
    by_place: ClassVar[tuple[str, ...]] = ("position", "direction")
    places: ClassVar[tuple[int, int]] = (2, 2)
    snippet: ClassVar[str] = "light/beam.glsl"
    projection: ClassVar[Projection] = "perspective"
    most_views: ClassVar[int] = 1

    @classmethod
    def from_places(cls, texts: Sequence[str]) -> dict[str, Any]:
        return {"position": numbers(texts[0], 3), "direction": numbers(texts[1], 3)}

    @property
    def disc_axes(self) -> Array:
        return view_axes(np.asarray(self.direction))

    @property
    def axis(self) -> Triple:
        return self.direction

    @property
    def edge(self) -> float:
        return max(self.width, self.height)

    def shines_on(self, points: Array) -> Bools:
        local = self.rays_to(points) @ self.disc_axes.T
        return np.asarray(
            (np.abs(local[..., :2]) <= -local[..., 2:] * np.array([self.width, self.height])).all(axis=-1)
        )

    def strength(self, points: Array) -> Array:
        return self.shines_on(points) * super().strength(points)

    def views(
        self, bodies: list[Array], casters: Array, clip: ClipSpace, resolution: int, guard: int, fine: bool
    ) -> tuple[ShadowView, ...]:
        view = self.face_view(0, self.disc_axes, self.edge, bodies, clip, resolution, guard, fine)
        return () if view is None else (view,)

    def frame(self, views: Sequence[ShadowView], origin: Array) -> Array:
        return rigid_inverse(self.disc_axes, np.asarray(self.position))

    def without_cone(self) -> Light:
        return gs.PointLight(position=self.position, shadow=self.shadow)

    def uniforms(self, axes: Array) -> dict[str, Any]:
        right, up, backward = self.disc_axes
        beam = np.stack([right / self.width, up / self.height, -backward])
        return {**super().uniforms(axes), "u_beam": axes @ beam.T}

    def gizmo(self, size: float, far: float) -> Gizmo:
        apex = np.asarray(self.position)
        corners = [(x * self.width, y * self.height, -1.0) for x in (-1.0, 1.0) for y in (-1.0, 1.0)]
        return Gizmo(
            np.stack([np.stack([apex, apex + far * (corner @ self.disc_axes)]) for corner in np.array(corners)])
        )
