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
"""Of the outer angle, where the command line gives that alone: as the default 20 of 30 degrees."""
_SIDES = 32  # of the gizmo's rims


@dataclass(frozen=True, kw_only=True)
class SpotLight(SphereLight):
    """Light from a position into a cone.

    Parameters
    ----------
    position, direction : (3,) floats
        Where the light is and the way it travels.
    inner_angle, outer_angle : float
        Degrees **from the axis**: full strength up to the inner, none beyond the outer, smooth between. 0 <= inner <= outer < 90;
        the shadow map's field of view is twice the outer angle, so 90 and more (180 across) has no map. Beyond the outer angle visibility
        is 0.
    radius : float
        Radius of the source, world units. 0 is a point.
    range : float, optional
        Distance at which the light has faded to nothing (window (1 - (d/range)^4)^2, glTF KHR_lights_punctual); None: no end.
    falloff : float
        Exponent p of the distance: strength ~ 1 / distance^p. 0 (default): constant, so that scale does not matter;
        2: physical, intensity is then in candela.
    cookie : Cookie, optional
        An image that colours its light: the square around the cone.
    near, far : float, optional
        Depth range of the shadow map, distances from the light; None derives it.
    """

    direction: Triple = setting(direction, (0.0, -1.0, 0.0), help="the way the light travels")
    inner_angle: float = setting(
        number(0.0, 90.0, unit="degrees", below=True), 20.0, help="degrees from the axis up to which it is full"
    )
    outer_angle: float = setting(
        number(0.0, 90.0, unit="degrees", above=True, below=True),
        30.0,
        help="degrees from the axis beyond which there is none",
    )
    cookie: Cookie | None = setting(optional(instance(Cookie), "none"), None, help="an image that it projects")

    spelling: ClassVar[str] = "spot"
    usage: ClassVar[str] = "spot:px,py,pz:dx,dy,dz[:outer[:inner]]"
    summary: ClassVar[str] = (
        "a cone, its angles from the axis: 30, and two thirds of outer; radius=0, range, falloff=2 is physical"
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
        """Position, direction, and the angles of its cone."""
        given: dict[str, Any] = {"position": vector(texts[0]), "direction": vector(texts[1])}
        if len(texts) > 2:
            outer = read_number(texts[2])
            given |= {
                "outer_angle": outer,
                "inner_angle": read_number(texts[3]) if len(texts) > 3 else INNER_SHARE * outer,
            }
        return given

    def turned(self, turn: Array, middle: Array) -> Self:
        """Its position, and its direction with it."""
        return replace(super().turned(turn, middle), direction=tuple((turn @ np.asarray(self.direction)).tolist()))

    def cone(self, points: Array) -> Array:
        """Strength of its cone at points (..., 3): 1 inside the inner, 0 outside the outer angle; (...)."""
        cosine = -(self.to_light(points)[0] @ np.asarray(self.direction))
        inner, outer = self._cosines
        if inner == outer:
            return np.where(cosine >= outer, 1.0, 0.0)
        x = np.clip((cosine - outer) / (inner - outer), 0.0, 1.0)
        return np.asarray(x * x * (3.0 - 2.0 * x))

    def strength(self, points: Array) -> Array:
        """Cone, range and falloff."""
        return self.cone(points) * super().strength(points)

    def shines_on(self, points: Array) -> Bools:
        """Within its outer angle."""
        return np.asarray(-(self.to_light(points)[0] @ np.asarray(self.direction)) >= self._cosines[1])

    @property
    def _cosines(self) -> Array:
        """Of the inner and the outer angle."""
        return np.asarray(np.cos(np.radians([self.inner_angle, self.outer_angle])))

    @property
    def disc_axes(self) -> Array:
        """About its direction."""
        return view_axes(np.asarray(self.direction))

    def without_cone(self) -> Light:
        """A point light."""
        return PointLight(position=self.position, shadow=self.shadow)

    @property
    def axis(self) -> Triple:
        """Its direction."""
        return self.direction

    @property
    def edge(self) -> float:
        """Tangent of its outer angle."""
        return float(np.tan(np.radians(self.outer_angle)))

    @property
    def projected(self) -> tuple[Cookie, Array] | None:
        """It fills the square round the cone."""
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
        """One, on the part of the square round its cone in which receivers lie."""
        axes = view_axes(np.asarray(self.direction))
        view = self.face_view(0, axes, self.edge, bodies, clip, resolution, guard, fine)
        return () if view is None else (view,)

    def frame(self, views: Sequence[ShadowView], origin: Array) -> Array:
        """That of its view."""
        if views:
            return views[0].view_from_world
        return rigid_inverse(view_axes(np.asarray(self.direction)), np.asarray(self.position))

    def uniforms(self, axes: Array) -> dict[str, Any]:
        """Also its cone."""
        inner, outer = self._cosines
        width = max(float(inner - outer), 1e-6)
        return {**super().uniforms(axes), "u_cone": (1.0 / width, -float(outer) / width)}

    def gizmo(self, size: float, far: float) -> Gizmo:
        """Its rim, the rim of full strength, and four lines from the light."""
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
