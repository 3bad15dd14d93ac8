"""DistantLight: base of the lights at infinity."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar, Self

import numpy as np

from glshadow.core.setting import refuse, setting
from glshadow.core.spaces import Array, Bools, Triple, direction, rigid_inverse, view_axes
from glshadow.geometry.fitting import minimum_rectangle
from glshadow.lights.light import Gizmo, Light
from glshadow.shadows.view import Projection, ShadowView


def downward(name: str, value: Any) -> Triple:
    """Check a direction from the zenith down: its largest component is negative, whichever axis is up."""
    kept: Triple = direction(name, value)  # type: ignore[assignment]  # of a vector of three
    if not max(kept, key=abs) < 0.0:
        raise refuse(name, "a direction from the zenith down, its largest component below 0, such as (0, -1, 0)", value)
    return kept


@dataclass(frozen=True, kw_only=True)
class DistantLight(Light):
    """Base of lights that shine along one direction and have no position."""

    direction: Triple = setting(direction, help="direction in which the light travels")

    projection: ClassVar[Projection] = "orthographic"
    at_infinity: ClassVar[bool] = True

    @property
    def place(self) -> tuple[float, float, float, float]:
        """Homogeneous direction to the light: (x, y, z, 0)."""
        x, y, z = self.direction
        return (-x, -y, -z, 0.0)

    def rays_to(self, points: Array) -> Array:
        """The direction of the light, for every point."""
        return np.broadcast_to(np.asarray(self.direction), points.shape)

    def to_light(self, points: Array) -> tuple[Array, Array]:
        """The direction against the light, at infinite distance."""
        towards = np.broadcast_to(-np.asarray(self.direction), points.shape)
        return towards, np.full(points.shape[:-1], np.inf)

    def relative_to(self, origin: Array) -> Self:
        """The same light: it has no position."""
        return self

    def turned(self, turn: Array, middle: Array) -> Self:
        """The light with its direction rotated."""
        return replace(self, direction=tuple((turn @ np.asarray(self.direction)).tolist()))

    def nudged(self, tilt: float, shift: float) -> Self:
        """The light with its direction tilted."""
        forward = np.asarray(self.direction)
        across = np.cross(forward, np.eye(3)[np.abs(forward).argmin()])
        return replace(self, direction=tuple((forward + tilt * across / np.linalg.norm(across)).tolist()))

    @property
    def disc_axes(self) -> Array:
        """Axes of the disc of sample points, about the light's direction."""
        return view_axes(np.asarray(self.direction))

    @property
    def axis(self) -> Triple:
        """The light's direction."""
        return self.direction

    def frame(self, views: Sequence[ShadowView], origin: Array) -> Array:
        """The frame of the first view, or the light's axes about the origin if there is no view."""
        if views:
            return views[0].view_from_world
        return rigid_inverse(view_axes(np.asarray(self.direction)), np.asarray(origin))

    def depth_range(
        self, points: Array, casters: Array, axes: Array, origin: Array, size: float = 0.0
    ) -> tuple[float, float]:
        """Near and far of a view with axes (3, 3) about an origin (3,), for receivers (N, 3) and casters (K, 3), unless they are given.

        Casters nearer than that are clamped to the near plane and still cast. The near plane stays one reach in front of the receivers (the
        extent of their depths, or `size`), so that the bias of a receiver's compare depth does not pass it.
        """
        depth = -((points - origin) @ axes[2])
        first = -((casters - origin) @ axes[2]).max()
        reach = max(float(np.ptp(depth)), size)
        ahead = float(origin @ np.asarray(self.direction))  # given planes are measured from the world's origin
        given = self.planes
        near = max(float(first), float(depth.min()) - reach) if given[0] is None else given[0] - ahead
        far = float(depth.max()) if given[1] is None else given[1] - ahead
        pad = 1e-3 * (far - near) + 1e-6 * reach
        return near - (pad if given[0] is None else 0.0), far + (pad if given[1] is None else 0.0)

    def map_texel(self, points: Array, seen: Bools, resolution: int) -> float:
        """Width of a texel: the longer side of the least-area rectangle around the visible points, divided by the resolution."""
        covered = points[seen]
        if len(covered) == 0:
            return 0.0
        flat = (covered - covered.mean(axis=0)) @ view_axes(np.asarray(self.direction))[:2].T
        return float(np.ptp(minimum_rectangle(flat)[1], axis=0).max()) / resolution

    def gizmo(self, size: float, far: float) -> Gizmo:
        """A disc with twelve rays."""
        return Gizmo(np.zeros((0, 2, 3)), rays=12)
