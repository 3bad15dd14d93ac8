"""SpotLight: light from a position into a cone."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar, Self

import numpy as np

from glshadow.core.setting import instance, number, optional, setting
from glshadow.core.spaces import Array, Bools, ClipSpace, Triple, direction, rigid_inverse, view_axes
from glshadow.core.spelling import number as read_number
from glshadow.core.spelling import vector
from glshadow.errors import SettingsError
from glshadow.lights.light import Gizmo, Light
from glshadow.lights.local import SphereLight
from glshadow.lights.point import PointLight
from glshadow.shadows.cookie import Cookie
from glshadow.shadows.view import Projection, ShadowView

INNER_SHARE = 2.0 / 3.0
"""Inner angle as a share of the outer angle, where the command line gives only the outer: 2/3, as in the defaults 20 and 30 degrees."""
_SIDES = 32  # segments of the gizmo's rims


@dataclass(frozen=True, kw_only=True)
class SpotLight(SphereLight):
    """Light from a position into a cone.

    Parameters
    ----------
    position, direction : (3,) floats
        Position of the light, and the direction in which it travels.
    inner_angle, outer_angle : float
        Degrees **from the axis**: full strength up to the inner angle, zero beyond the outer, smooth between. 0 <= inner <= outer < 90. The
        shadow map's field of view is twice the outer angle, so an outer angle of 90 (180 across) or more is not allowed. Visibility is 0
        beyond the outer angle.
    radius : float
        Radius of the source, world units. 0 is a point.
    range : float, optional
        Distance at which the light has faded to zero (window (1 - (d/range)^4)^2, glTF KHR_lights_punctual); None: no end.
    falloff : float
        Exponent p of the distance: strength ~ 1 / distance^p. 0 (default): constant, so that scale does not matter.
        2: physical, intensity is then in candela.
    cookie : Cookie, optional
        An image that colours its light; it fills the square around the cone.
    near, far : float, optional
        Depth range of the shadow map, distances from the light; None derives it.
    """

    direction: Triple = setting(direction, (0.0, -1.0, 0.0), help="direction in which the light travels")
    inner_angle: float = setting(
        number(0.0, 90.0, unit="degrees", below=True),
        20.0,
        help="degrees from the axis up to which the light has full strength",
    )
    outer_angle: float = setting(
        number(0.0, 90.0, unit="degrees", above=True, below=True),
        30.0,
        help="degrees from the axis beyond which there is no light",
    )
    cookie: Cookie | None = setting(optional(instance(Cookie), "none"), None, help="an image that it projects")

    spelling: ClassVar[str] = "spot"
    usage: ClassVar[str] = "spot:px,py,pz:dx,dy,dz[:outer[:inner]]"
    summary: ClassVar[str] = (
        "a cone; OUTER and INNER in degrees from the axis, default 30 and 2/3 of OUTER; radius=0, range, falloff=2 is physical"
    )
    by_place: ClassVar[tuple[str, ...]] = ("position", "direction", "outer_angle", "inner_angle")
    places: ClassVar[tuple[int, int]] = (2, 4)
    snippet: ClassVar[str] = "light/spot.glsl"
    projection: ClassVar[Projection] = "perspective"
    most_views: ClassVar[int] = 1
    beside_geometry: ClassVar[frozenset[str]] = SphereLight.beside_geometry | {"inner_angle", "cookie"}

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.inner_angle > self.outer_angle:
            raise SettingsError(
                f"SpotLight inner_angle must not be greater than outer_angle (degrees from the axis), "
                f"got inner_angle={self.inner_angle}, outer_angle={self.outer_angle}"
            )

    @classmethod
    def from_places(cls, texts: Sequence[str]) -> dict[str, Any]:
        """Read position, direction, and the angles of the cone."""
        given: dict[str, Any] = {"position": vector(texts[0]), "direction": vector(texts[1])}
        if len(texts) > 2:
            outer = read_number(texts[2])
            given |= {
                "outer_angle": outer,
                "inner_angle": read_number(texts[3]) if len(texts) > 3 else INNER_SHARE * outer,
            }
        return given

    def turned(self, turn: Array, middle: Array) -> Self:
        """The light with its position and direction rotated."""
        return replace(super().turned(turn, middle), direction=tuple((turn @ np.asarray(self.direction)).tolist()))

    def cone(self, points: Array) -> Array:
        """Strength of the cone at points (..., 3): 1 inside the inner angle, 0 outside the outer angle; (...)."""
        cosine = -(self.to_light(points)[0] @ np.asarray(self.direction))
        inner, outer = self._cosines
        if inner == outer:
            return np.where(cosine >= outer, 1.0, 0.0)
        x = np.clip((cosine - outer) / (inner - outer), 0.0, 1.0)
        return np.asarray(x * x * (3.0 - 2.0 * x))

    def strength(self, points: Array) -> Array:
        """The product of cone, range and falloff."""
        return self.cone(points) * super().strength(points)

    def shines_on(self, points: Array) -> Bools:
        """Whether points are within the outer angle."""
        return np.asarray(-(self.to_light(points)[0] @ np.asarray(self.direction)) >= self._cosines[1])

    @property
    def _cosines(self) -> Array:
        """Cosines of the inner and the outer angle."""
        return np.asarray(np.cos(np.radians([self.inner_angle, self.outer_angle])))

    @property
    def disc_axes(self) -> Array:
        """Axes of the disc of sample points, about the spot's direction."""
        return view_axes(np.asarray(self.direction))

    def without_cone(self) -> Light:
        """The same light as a point light."""
        return PointLight(position=self.position, shadow=self.shadow)

    @property
    def axis(self) -> Triple:
        """The spot's direction."""
        return self.direction

    @property
    def edge(self) -> float:
        """Tangent of the outer angle."""
        return float(np.tan(np.radians(self.outer_angle)))

    @property
    def projected(self) -> tuple[Cookie, Array] | None:
        """The cookie and its matrix; the image fills the square around the cone."""
        if self.cookie is None:
            return None
        axes, matrix = view_axes(np.asarray(self.direction)), np.eye(4)
        matrix[:3, :3], matrix[:3, 3] = axes, -axes @ np.asarray(self.position)
        scale = 0.5 / np.tan(np.radians(self.outer_angle))
        image = np.array([[scale, 0, -0.5, 0], [0, scale, -0.5, 0], [0, 0, 1, 0], [0, 0, -1.0, 0]])
        return self.cookie, np.asarray(image @ matrix)

    def views(
        self, bodies: list[Array], casters: Array, clip: ClipSpace, resolution: int, guard: int, fine: bool
    ) -> tuple[ShadowView, ...]:
        """One view of the part of the square around the cone that holds receivers."""
        axes = view_axes(np.asarray(self.direction))
        view = self.face_view(0, axes, self.edge, bodies, clip, resolution, guard, fine)
        return () if view is None else (view,)

    def frame(self, views: Sequence[ShadowView], origin: Array) -> Array:
        """The frame of its one view."""
        if views:
            return views[0].view_from_world
        return rigid_inverse(view_axes(np.asarray(self.direction)), np.asarray(self.position))

    def uniforms(self, axes: Array) -> dict[str, Any]:
        """Uniforms of a local light, with its cone."""
        inner, outer = self._cosines
        width = max(float(inner - outer), 1e-6)
        return {**super().uniforms(axes), "u_cone": (1.0 / width, -float(outer) / width)}

    def gizmo(self, size: float, far: float) -> Gizmo:
        """The cone's rim, the rim of full strength, and four lines from the light."""
        far = self.range or far
        axes, apex = view_axes(np.asarray(self.direction)), np.asarray(self.position)
        angle = 2.0 * np.pi * np.arange(_SIDES) / _SIDES
        round_ = np.cos(angle)[:, None] * axes[0] + np.sin(angle)[:, None] * axes[1]
        rims = [
            apex + far * (-axes[2] + np.tan(np.radians(half)) * round_) for half in (self.outer_angle, self.inner_angle)
        ]
        segments = [np.stack([rim, np.roll(rim, -1, axis=0)], axis=1) for rim in rims]
        segments.append(np.stack([np.broadcast_to(apex, (4, 3)), rims[0][:: _SIDES // 4]], axis=1))
        return Gizmo(np.concatenate(segments), width=1.3, opacity=0.9)
