"""Light: the base class of all lights, with every property that other modules need."""

from __future__ import annotations

import inspect
from abc import ABC, abstractmethod
from collections.abc import Callable, Hashable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Any, ClassVar, Self

import numpy as np

from glshadow.core.setting import Settings, flag, instance, number, optional, setting, shown, vector
from glshadow.core.spaces import Array, Bools, ClipSpace, Triple, view_axes
from glshadow.errors import SettingsError
from glshadow.lights.table import LightTable
from glshadow.shadows.cookie import Cookie
from glshadow.shadows.filters import Filter
from glshadow.shadows.shadow import Shadow
from glshadow.shadows.view import Projection, ShadowView

BRIGHTEST = 1e38  # largest value, well inside float32
BRIGHTEST_RADIANCE = 1e18
"""Largest value used on the GPU, whose square is still a float32."""

NEAR_HELP, FAR_HELP = "near plane of its shadow map, along the light", "far plane of its shadow map, along the light"


@dataclass(frozen=True, eq=False)
class Gizmo:
    """Lines that an overlay draws for a light.

    Attributes
    ----------
    lines : (S, 2, 3) float64
        World segments.
    width, opacity : float
        Width and opacity of the lines; the width is in pixels of an image 720 high.
    rays : int
        Number of rays drawn around the light; 0 draws a disc alone.
    """

    lines: Array
    width: float = 2.0
    opacity: float = 1.0
    rays: int = 0


class _Signature:
    """The signature of a light's settings for `help` and editors, which would show that of `__new__`."""

    def __get__(self, light: object, kind: type) -> inspect.Signature:
        whole = inspect.signature(kind.__init__)  # type: ignore[misc]
        return whole.replace(parameters=list(whole.parameters.values())[1:])


@dataclass(frozen=True, kw_only=True)
class Light(Settings, ABC):
    """Base of all lights. Each kind is a subclass in a file of its own, listed in `glshadow.lights.LIGHTS`.

    Parameters
    ----------
    color : (3,) floats
        Linear RGB factor.
    intensity : float
        Strength: a white surface that faces the light receives color * intensity.
    shadow : Shadow or None
        Settings of its shadow. None: the light casts no shadow.
    photometric : bool
        Whether the intensity is in lux at infinity, else in candela, as of lights of glTF files: images are then exposed for it.

    Attributes
    ----------
    spelling : str
        Its name on the command line, in batches and in reports.
    usage, summary : str
        How it is written on the command line; a short description for its help.
    by_place : tuple of str
        Settings that the command line reads by position; all others are written `key=value`.
    places : (2,) ints
        How many colon-separated texts the command line reads by position: least and most.
    snippet : str
        GLSL file for the slot <light>.
    projection : {"orthographic", "perspective", "cube"}
        Projection of its shadow map's views, and of the frame in which its receivers are given.
    most_views : int
        Number of views of its shadow map: 1, 6, or 0 if it has no shadow map.
    at_infinity : bool
        Whether it shines along one direction and has no position.
    wide : bool
        Whether no single direction leads from a receiver to the light. The snippet then integrates over the light, and one shadow map
        cannot represent it.
    weighted : bool
        Whether its sample points are weighted by the cosine at the receiver (Lambert's law).
    per_channel : bool
        Whether its irradiance and its shadow differ by channel. It is then also `wide` and `weighted`, its hard lights are weighted by
        their colours, and visibility is the share of the luminance.
    sized_by : str
        The setting that gives it a size: degrees at infinity, else world units. Empty if it has no size to change.
    fixed : bool
        Whether it stays in place when a user turns the lights in a viewer.
    beside_geometry : frozenset of str
        Settings that do not affect where its shadows fall.
    penumbra : mapping or None
        Defines of pass/penumbra.frag, which tests all sample points in one pass. None: the sample points are drawn one after another.
    usual_filter : Filter or None
        Used unless the shadow's settings ask for another one; None: derived from them.
    """

    color: Triple = setting(vector(3, 0.0, BRIGHTEST), (1.0, 1.0, 1.0), help="linear RGB factor")
    intensity: float = setting(
        number(0.0, BRIGHTEST), 1.0, help="strength: a white surface facing the light receives color * intensity"
    )
    shadow: Shadow | None = setting(
        optional(instance(Shadow), "casts nothing"), factory=Shadow, help="settings of its shadow"
    )
    photometric: bool = setting(flag(), False, help="intensity is in lux or candela: images are exposed for it")

    spelling: ClassVar[str]
    usage: ClassVar[str]
    summary: ClassVar[str]
    by_place: ClassVar[tuple[str, ...]] = ()
    places: ClassVar[tuple[int, int]] = (0, 0)
    snippet: ClassVar[str]
    projection: ClassVar[Projection]
    most_views: ClassVar[int]
    at_infinity: ClassVar[bool] = False
    wide: ClassVar[bool] = False
    weighted: ClassVar[bool] = False
    per_channel: ClassVar[bool] = False
    sized_by: ClassVar[str] = ""
    fixed: ClassVar[bool] = False
    beside_geometry: ClassVar[frozenset[str]] = frozenset({"color", "intensity", "shadow", "photometric"})
    penumbra: ClassVar[Mapping[str, int] | None] = None
    usual_filter: ClassVar[Filter | None] = None

    __signature__ = _Signature()

    def __new__(cls, *_: Any, **given: Any) -> Self:
        known = [each.name for each in fields(cls)]
        if unknown := [name for name in given if name not in known]:
            raise SettingsError(
                f"{cls.__name__} has no {' and no '.join(f'{name}={shown(given[name])}' for name in unknown)}; it takes {', '.join(known)}"
            )
        return super().__new__(cls)

    def __post_init__(self) -> None:
        super().__post_init__()
        near, far = self.planes
        if near is not None and far is not None and not near < far:
            raise SettingsError(f"{type(self).__name__} near must be less than far, got near={near}, far={far}")

    # -- command line

    @classmethod
    def from_places(cls, texts: Sequence[str]) -> dict[str, Any]:
        """Settings from the texts that the command line reads by position."""
        return {}

    # -- position

    @property
    @abstractmethod
    def place(self) -> tuple[float, float, float, float]:
        """Homogeneous: (position, 1), or (direction to the light, 0) at infinity."""

    @abstractmethod
    def rays_to(self, points: Array) -> Array:
        """Vectors along which light reaches points (..., 3): from the light's middle, or its direction."""

    @abstractmethod
    def to_light(self, points: Array) -> tuple[Array, Array]:
        """Unit vectors towards the light and distances to it.

        Parameters
        ----------
        points : (..., 3) float64
            World positions.

        Returns
        -------
        (..., 3) float64, (...) float64
            Unit vectors; distances, infinite for a light at infinity.
        """

    @abstractmethod
    def relative_to(self, origin: Array) -> Self:
        """The same light in coordinates relative to a point (3,)."""

    @abstractmethod
    def turned(self, turn: Array, middle: Array) -> Self:
        """The light turned about a point (3,) by a rotation (3, 3)."""

    @abstractmethod
    def nudged(self, tilt: float, shift: float) -> Self:
        """A slightly different light that cannot reuse this light's cached maps: tilted by radians, or moved by world units."""

    @property
    def geometry(self) -> tuple[Hashable, ...]:
        """A hashable key of everything that affects where its shadows fall: its kind and all settings but strength and shadow map."""
        names = (each.name for each in fields(self) if each.name not in self.beside_geometry)
        return (type(self), *(getattr(self, name) for name in names))

    # -- strength

    def strength(self, points: Array) -> Array:
        """Share of the intensity that is left at points (..., 3) after cone, range and falloff; (...)."""
        return np.ones(points.shape[:-1])

    def shines_on(self, points: Array) -> Bools:
        """Whether points (..., 3) are within the cone and on the lit side, occluded or not; (...)."""
        return np.ones(points.shape[:-1], dtype=bool)

    def reaches(self, points: Array) -> Bools:
        """Whether points (..., 3) are also within the range; (...)."""
        return self.shines_on(points)

    def irradiance(self, points: Array, normals: Array) -> Array:
        """Share of color * intensity that unshadowed white surfaces receive: the float64 twin of the snippet.

        Parameters
        ----------
        points, normals : (..., 3) float64
            World positions and unit normals.

        Returns
        -------
        (...) float64; of a light that differs by channel (..., 3)
        """
        towards, _ = self.to_light(points)
        return np.asarray(np.maximum((towards * normals).sum(axis=-1), 0.0) * self.strength(points))

    @property
    def projected(self) -> tuple[Cookie, Array] | None:
        """The projected image and the (4, 4) matrix from world points to (u, v, -, w), v up. None: the light projects no image."""
        return None

    @property
    def tables(self) -> Mapping[str, Callable[[], LightTable]]:
        """Textures of the snippet, by the names of their uniforms; made when a program uses them."""
        return {}

    # -- size

    @property
    def has_size(self) -> bool:
        """Whether the light is larger than a point."""
        return False

    @property
    def source_radius(self) -> float:
        """Radius of a disc or ball that holds the source: a tangent seen from the receiver at infinity, else world units."""
        return 0.0

    def hard_lights(self, count: int) -> tuple[Light, ...]:
        """Hard lights at `count` points of this light, each for an equal share. Their mean visibility is the visible share of the light.

        Those of a `weighted` light are weighted by the cosine at the receiver, those of a light that differs by channel also by their
        color, which is what each stands for. A light without size gives itself.
        """
        return (self,)

    def extremes(self) -> tuple[Light, ...]:
        """Hard lights whose convex hull holds all points of this light."""
        return (self,)

    def to_points(self, receivers: Array, count: int) -> Array:
        """Vectors (N, count, 3) from receivers (N, 3) to the points that pass/penumbra.frag samples; of any length at infinity."""
        return -self.rays_to(receivers)[:, None]

    def aims(self, points: Array, samples: int, generator: np.random.Generator) -> Iterator[tuple[Array, Array]]:
        """Unit vectors (N, 3) and distances (N,) from points (N, 3) to points of the light: one random point in each equal share."""
        for _ in range(samples):
            yield self.to_light(points)

    @property
    def disc_axes(self) -> Array:
        """Axes right, up and backward (3, 3) of the disc of sample points: about the direction of the light, or about straight down."""
        return view_axes(np.array([0.0, -1.0, 0.0]))

    def area_points(self, count: int, axes: Array) -> Array:
        """Sample points (count, 2) for pass/penumbra.frag, in a frame with axes (3, 3). Only for lights with `penumbra`."""
        raise NotImplementedError

    def area_uniforms(self, axes: Array) -> dict[str, Any]:
        """Uniforms of pass/penumbra.frag for the sample points: right, up and forward of their disc."""
        right, up, backward = self.disc_axes @ axes.T
        return {"u_disc_axes": np.stack([right, up, -backward], axis=1)}

    def without_cone(self) -> Light:
        """The same light in every direction. A cone's border then limits the lit area only once."""
        return self

    # -- shadow

    @property
    def planes(self) -> tuple[float | None, float | None]:
        """Near and far of its shadow map; None: derived."""
        return (None, None)

    def filter_for(self, requested: Filter) -> Filter:
        """The filter that the light uses when this filter is requested; raises SettingsError for one of other lights."""
        requested.check_light(type(self).__name__)
        return requested

    @abstractmethod
    def views(
        self, bodies: list[Array], casters: Array, clip: ClipSpace, resolution: int, guard: int, fine: bool
    ) -> tuple[ShadowView, ...]:
        """The views of its shadow map; parameters as of `shadows.view.shadow_views`, `bodies` not empty. Empty if nothing is lit."""

    @abstractmethod
    def frame(self, views: Sequence[ShadowView], origin: Array) -> Array:
        """(4, 4) matrix into the frame in which its receivers are given.

        Parameters
        ----------
        views : sequence of ShadowView
            Views of its shadow map; empty if it has none.
        origin : (3,) float64
            Origin of the frame of a light at infinity without a shadow map.
        """

    def touches(self, low: Array, high: Array) -> Bools:
        """Whether a part of the light is inside the boxes from (N, 3) to (N, 3); (N,)."""
        return np.zeros(len(low), dtype=bool)

    @property
    def axis(self) -> Triple | None:
        """Axis of the cone that it lights. None: it shines in every direction."""
        return None

    @property
    def edge(self) -> float:
        """Tangent of the largest angle from the axis at which it shines."""
        return float(np.inf)

    @abstractmethod
    def map_texel(self, points: Array, seen: Bools, resolution: int) -> Array | float:
        """Texel width, in world units at points (..., 3), of a shadow map that fits tightly around the points `seen` (...)."""

    # -- drawing

    def uniforms(self, axes: Array) -> dict[str, Any]:
        """Uniforms of the snippet, for receivers in a frame with axes (3, 3)."""
        return {"u_radiance": tuple(min(c * self.intensity, BRIGHTEST_RADIANCE) for c in self.color)}

    @abstractmethod
    def gizmo(self, size: float, far: float) -> Gizmo:
        """Lines that an overlay draws for the light. `size`: extent of the scene; `far`: far plane of its shadow map."""
