"""Truth: the traced reference of an image: exact visibility of every light, and queries about a pixel's surroundings."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from glshadow.core.cameras import Camera
from glshadow.core.setting import as_float, as_floats, refuse, shown, whole
from glshadow.core.spaces import FARTHEST, Array, Bools, perpendicular
from glshadow.lights import Light
from glshadow.reference.aimed import AimedLight, moved_over
from glshadow.reference.embree import Ints
from glshadow.reference.rays import LIFT, Rays
from glshadow.reference.receivers import Receivers
from glshadow.scene.nodes import Scene

Floats = NDArray[np.float32]

NEAR_DIRECTIONS = 16  # in the search for a shadow's boundary (see Truth.near_edge)
NEAR_RADII = 3


@dataclass(frozen=True, eq=False, repr=False)
class Truth:
    """Traced reference: exact visibility of every light, with the inputs that it was traced for.

    Attributes
    ----------
    visibility : (L, H, W) float32
        1 lit, 0 dark, also where N.L <= 0 and where the light does not shine (outside its cone, behind it); NaN where there is no
        surface; between 0 and 1 with several samples.
    cosine : (L, H, W) float32
        N.L with the normal that faces the viewer: the triangle's, for a smooth mesh the interpolated one (see `geometry.smooth`).
    reached : (L, H, W) bool
        Whether the point is inside a spot's cone and a light's range; always true for directional lights.
    triangle, node : (H, W) int32
        Index of the visible triangle (counted in the order of nodes, then of triangles) and of its node at the pixel's centre; -1: no
        surface.
    position, normal : (H, W, 3) float64
        World point at the pixel's centre, and its geometric normal facing the viewer; NaN where there is no surface.
    alpha : (H, W) float32
        Share of the pixel's samples that see a surface.
    samples : int
        Samples per pixel.
    light_samples : int
        Sample points on each light that has a size.
    variance : (L, H, W) float32, optional
        Variance of the light samples within a pixel, averaged over its own samples; None for one light sample.
    scene, camera, lights, size
        The inputs of the trace; size is (width, height).
    """

    visibility: Floats
    cosine: Floats
    reached: Bools
    triangle: Ints
    node: Ints
    position: Array
    normal: Array
    alpha: Floats
    samples: int
    light_samples: int
    variance: Floats | None
    scene: Scene
    camera: Camera
    lights: tuple[Light, ...]
    size: tuple[int, int]
    rays: Rays = field(repr=False)

    @cached_property
    def body(self) -> Ints:
        """(H, W) index of the connected body, welded by exact position, at the pixel's centre; -1: no surface."""
        return np.where(self.triangle >= 0, self.rays.body[self.triangle], np.int32(-1))

    @cached_property
    def shading(self) -> Array:
        """(H, W, 3) unit shading normals: interpolated for smooth meshes, otherwise `normal`."""
        known = self.triangle >= 0
        points, own, normals = self.position[known] - self.rays.origin, self.triangle[known], self.normal.copy()
        normals[known] = Receivers.of(self.rays, own, points, self.normal[known]).normals
        return normals

    def __repr__(self) -> str:
        seen = int((self.triangle >= 0).sum())
        shares = [f"{float(np.nanmean(plane)):.2%}" for plane in self.visibility] if seen else []
        return (
            f"Truth({shown(self.scene.name)}, {self.size[0]} x {self.size[1]}, {seen:,} pixels see a surface, "
            f"share lit by each light: {', '.join(shares) or 'none'})"
        )

    def near_edge(self, light: int, radius: Array | float, where: Bools | None = None) -> Bools:
        """Whether the true boundary of a light's shadow passes within a distance of the pixels' points.

        The distance is measured in the light plane (through the point, perpendicular to its light ray). Points in 16 directions at 1/3, 2/3
        and 3/3 of it are projected to the plane of the point's triangle and then along their own light ray to the nearest surface, in
        either direction. The boundary is near if one of them is lit and the point is dark, or vice versa.

        Parameters
        ----------
        light : int
            Index in `lights`.
        radius : float or (H, W) float64
            World units.
        where : (H, W) bool, optional
            Pixels to test, the others are False; None: all surfaces that face the light.

        Returns
        -------
        (H, W) bool
        """
        light, wanted = whole(0, len(self.lights) - 1)("light", light), self.triangle >= 0
        wanted &= self.cosine[light] > 0.0 if where is None else self._mask(where)
        rows = np.flatnonzero(wanted)
        lit = self.visibility[light].ravel()[rows] > 0.5
        reach = self._lengths(radius).ravel()[rows]
        points = self.position.reshape(-1, 3)[rows] - self.rays.origin
        own, normal = self.triangle.ravel()[rows], self.normal.reshape(-1, 3)[rows]
        source = AimedLight(self.lights[light], self.rays.origin)
        near = np.zeros(len(rows), dtype=bool)
        for fraction in range(NEAR_RADII, 0, -1):
            for number in range(NEAR_DIRECTIONS):
                left = np.flatnonzero(~near)
                if len(left) == 0:
                    break
                angle = 2.0 * np.pi * number / NEAR_DIRECTIONS
                moved = moved_over(
                    self.rays, source, own[left], points[left], reach[left] * fraction / NEAR_RADII, angle
                )
                near[left] = source.lit(self.rays, *moved, normal[left]) != lit[left]
        result = np.zeros(wanted.shape, dtype=bool)
        result.ravel()[rows] = near
        return result

    def near_foot(self, radius: Array | float, where: Bools) -> Bools:
        """Whether something stands on the surface within a distance: rays along the surface in 16 directions hit it.

        Parameters
        ----------
        radius : float or (H, W) float64
            World units.
        where : (H, W) bool
            Pixels to test.
        """
        where = self._mask(where)
        rows = np.flatnonzero(where & (self.triangle >= 0))
        points = self.position.reshape(-1, 3)[rows] - self.rays.origin
        normal, own = self.normal.reshape(-1, 3)[rows], self.triangle.ravel()[rows]
        reach = self._lengths(radius).ravel()[rows]
        u, v = perpendicular(normal)
        starts = points + normal * (LIFT * self.rays.reach[own])[:, None]
        near = np.zeros(len(rows), dtype=bool)
        for angle in 2.0 * np.pi * np.arange(NEAR_DIRECTIONS) / NEAR_DIRECTIONS:
            near |= self.rays.blocked(own, starts, np.cos(angle) * u + np.sin(angle) * v, reach)[0]
        result = np.zeros(where.shape, dtype=bool)
        result.ravel()[rows] = near
        return result

    def _mask(self, where: Bools) -> Bools:
        if not isinstance(where, np.ndarray) or where.dtype != np.bool_ or where.shape != self.triangle.shape:
            raise refuse("where", f"an array {self.triangle.shape} of bool", where)
        return np.asarray(where)

    def _lengths(self, radius: Array | float) -> Array:
        """The radius of each pixel (H, W)."""
        one = as_float(radius)
        lengths = as_floats(radius, self.triangle.shape) if math.isnan(one) else np.array(one)
        if lengths is None or (lengths < 0.0).any() or (lengths > FARTHEST).any():  # NaN where there is no surface
            raise refuse("radius", f"a length in [0, {FARTHEST:g}] or an array {self.triangle.shape} of them", radius)
        return np.broadcast_to(lengths, self.triangle.shape)

    def _repr_html_(self) -> str:
        """In a notebook: for every light the lit surfaces, bright, and those in shadow, dark."""
        from glshadow.inline import figure, visibility_picture

        seen = self.triangle >= 0
        figures = []
        for number, light in enumerate(self.lights):
            share = float(self.visibility[number][seen].mean()) if seen.any() else 0.0
            kind = type(light).__name__.removesuffix("Light").lower()
            picture = visibility_picture(self.visibility[number], self.cosine[number])
            figures.append(
                figure(picture, f"reference, light {number} ({kind}): {share:.2%} of the visible surface is lit")
            )
        return "".join(figures)
