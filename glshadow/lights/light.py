"""Light: what every kind of light says of itself, so that nothing else needs to know which there are."""

from __future__ import annotations

import inspect
from abc import ABC, abstractmethod
from collections.abc import Hashable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Any, ClassVar, Self

import numpy as np

from glshadow.core.setting import Settings, instance, number, optional, setting, shown, vector
from glshadow.core.spaces import Array, Bools, ClipSpace, Triple, view_axes
from glshadow.errors import SettingsError
from glshadow.shadows.cookie import Cookie
from glshadow.shadows.filters import Filter
from glshadow.shadows.shadow import Shadow
from glshadow.shadows.view import Projection, ShadowView

BRIGHTEST = 1e38  # what float32 holds
BRIGHTEST_RADIANCE = 1e18
"""On the GPU: its square root is still a float32."""

NEAR_HELP, FAR_HELP = "near plane of its shadow map, along the light", "far plane of its shadow map, along the light"


@dataclass(frozen=True, eq=False)
class Gizmo:
    """How an overlay shows a light.

    Attributes
    ----------
    lines : (S, 2, 3) float64
        World segments.
    width, opacity : float
        Of the lines; pixels of an image 720 high.
    rays : int
        Spokes round the light itself; 0: a disc alone.
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
    """Base of all lights. Each kind is one subclass, in a file of its own, and stands in `glshadow.lights.LIGHTS`.

    Parameters
    ----------
    color : (3,) floats
        Linear RGB factor.
    intensity : float
        Strength: a white surface that faces the light gets color * intensity.
    shadow : Shadow or None
        Settings of its shadow; None: it casts nothing.

    Attributes
    ----------
    spelling : str
        Its name on the command line, in batches and in reports.
    usage : str
        How the command line spells it.
    summary : str
        In a few words, for help.
    by_place : tuple of str
        Settings that the command line takes by their place; all others by `key=value`.
    places : (2,) ints
        How many texts between colons it takes there, at least and at most.
    snippet : str
        GLSL of the slot <light>.
    projection : {"orthographic", "perspective", "cube"}
        Of the views of its map, and of the frame in which its receivers are given.
    most_views : int
        Views of its shadow map: 1, 6, or 0 where it has none.
    at_infinity : bool
        Whether it shines along one direction, from no position.
    wide : bool
        Whether no single direction leads from a receiver to it: the snippet then integrates over it, and no map of one view stands for it.
    weighted : bool
        Whether its sample points count by the cosine at the receiver (Lambert's law).
    sized_by : str
        The setting that gives it a size: degrees at infinity, else world units; empty: it has none that can be changed.
    fixed : bool
        Whether it stays where it is when a user aims lights from elsewhere.
    beside_geometry : frozenset of str
        Settings that do not decide where its shadows fall.
    penumbra : mapping or None
        Defines of pass/penumbra.frag, which counts its sample points at once; None: they are drawn one after another.
    """

    color: Triple = setting(vector(3, 0.0, BRIGHTEST), (1.0, 1.0, 1.0), help="linear RGB factor")
    intensity: float = setting(
        number(0.0, BRIGHTEST), 1.0, help="strength: a white surface facing the light gets color * intensity"
    )
    shadow: Shadow | None = setting(optional(instance(Shadow), "casts nothing"), factory=Shadow, help="of its shadow")

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
    sized_by: ClassVar[str] = ""
    fixed: ClassVar[bool] = False
    beside_geometry: ClassVar[frozenset[str]] = frozenset({"color", "intensity", "shadow"})
    penumbra: ClassVar[Mapping[str, int] | None] = None

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

    # -- the command line

    @classmethod
    def from_places(cls, texts: Sequence[str]) -> dict[str, Any]:
        """Settings from the texts that the command line takes by their place."""
        return {}

    # -- where it is

    @property
    @abstractmethod
    def place(self) -> tuple[float, float, float, float]:
        """Homogeneous: (its position, 1), or (the way to it, 0) at infinity."""

    @abstractmethod
    def rays_to(self, points: Array) -> Array:
        """Vectors along which its light comes to points (..., 3): from its middle, or its direction."""

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
        """A light that differs a little, so that nothing drawn for this one serves it: tilted by radians, or shifted by world units."""

    @property
    def geometry(self) -> tuple[Hashable, ...]:
        """All that decides where its shadows fall, as a key: its kind, and every setting but those of its strength and its map."""
        names = (each.name for each in fields(self) if each.name not in self.beside_geometry)
        return (type(self), *(getattr(self, name) for name in names))

    # -- its strength

    def strength(self, points: Array) -> Array:
        """What cone, range and falloff leave of its intensity at points (..., 3): shares (...)."""
        return np.ones(points.shape[:-1])

    def shines_on(self, points: Array) -> Bools:
        """Whether points (..., 3) lie where it shines at all, whatever stands between: within its cone, before its lit side; (...)."""
        return np.ones(points.shape[:-1], dtype=bool)

    def reaches(self, points: Array) -> Bools:
        """The same, and within its range; (...)."""
        return self.shines_on(points)

    def irradiance(self, points: Array, normals: Array) -> Array:
        """Float64 twin of the snippet: the share of color * intensity that white surfaces get which nothing shadows.

        Parameters
        ----------
        points, normals : (..., 3) float64
            World positions and unit normals.

        Returns
        -------
        (...) float64
        """
        towards, _ = self.to_light(points)
        return np.asarray(np.maximum((towards * normals).sum(axis=-1), 0.0) * self.strength(points))

    @property
    def projected(self) -> tuple[Cookie, Array] | None:
        """The image that it projects, and the (4, 4) matrix from world points to (u, v, -, w), v up; None: it projects none."""
        return None

    # -- its size

    @property
    def has_size(self) -> bool:
        """Whether it is more than a point."""
        return False

    @property
    def source_radius(self) -> float:
        """Radius of a disc or ball that holds the source: at infinity the tangent under which a receiver sees it, else world units."""
        return 0.0

    def hard_lights(self, count: int) -> tuple[Light, ...]:
        """Lights without size at `count` points of it, each for an equal share: their mean visibility is the share of it that is seen.

        Those of a `weighted` light are weighted by the cosine at the receiver. A light without size is its own single point.
        """
        return (self,)

    def extremes(self) -> tuple[Light, ...]:
        """Lights without size whose convex hull holds all of its points."""
        return (self,)

    def to_points(self, receivers: Array, count: int) -> Array:
        """Vectors (N, count, 3) from receivers (N, 3) to the points that pass/penumbra.frag samples, of any length at infinity."""
        return -self.rays_to(receivers)[:, None]

    def aims(self, points: Array, samples: int, generator: np.random.Generator) -> Iterator[tuple[Array, Array]]:
        """Unit vectors (N, 3) and distances (N,) from points (N, 3) to points of it: one of each equal share, at random within that."""
        for _ in range(samples):
            yield self.to_light(points)

    @property
    def disc_axes(self) -> Array:
        """Right, up and backward (3, 3) of the disc of its points: about the way it shines, or about the way down."""
        return view_axes(np.array([0.0, -1.0, 0.0]))

    def area_points(self, count: int, axes: Array) -> Array:
        """Points (count, 2) for pass/penumbra.frag, in a frame with axes (3, 3); only where `penumbra` is given."""
        raise NotImplementedError

    def area_uniforms(self, axes: Array) -> dict[str, Any]:
        """Uniforms of pass/penumbra.frag for these points: right, up and forward of their disc."""
        right, up, backward = self.disc_axes @ axes.T
        return {"u_disc_axes": np.stack([right, up, -backward], axis=1)}

    def without_cone(self) -> Light:
        """The same light in every direction, so that the border of a cone bounds what is lit only once."""
        return self

    # -- its shadow

    @property
    def planes(self) -> tuple[float | None, float | None]:
        """Near and far of its map; None: derived."""
        return (None, None)

    def filter_for(self, asked: Filter) -> Filter:
        """The filter that the light needs to be served by one that is asked for."""
        return asked

    @abstractmethod
    def views(
        self, bodies: list[Array], casters: Array, clip: ClipSpace, resolution: int, guard: int, fine: bool
    ) -> tuple[ShadowView, ...]:
        """The views of its map: parameters are those of `shadows.view.shadow_views`, `bodies` not empty; none where nothing is lit."""

    @abstractmethod
    def frame(self, views: Sequence[ShadowView], origin: Array) -> Array:
        """(4, 4) into the frame in which its receivers are given.

        Parameters
        ----------
        views : sequence of ShadowView
            Of its map; empty: it has none.
        origin : (3,) float64
            Where the frame begins without a map, if the light is at infinity.
        """

    def touches(self, low: Array, high: Array) -> Bools:
        """Whether a part of the light lies in boxes (N, 3) to (N, 3); (N,)."""
        return np.zeros(len(low), dtype=bool)

    @property
    def axis(self) -> Triple | None:
        """The middle of what it shines on, as a direction; None: it shines in every direction."""
        return None

    @property
    def edge(self) -> float:
        """Tangent of the angle from the axis up to which it shines."""
        return float(np.inf)

    @abstractmethod
    def map_texel(self, points: Array, seen: Bools, resolution: int) -> Array | float:
        """Width of a texel of a map that fits tightly round the `seen` (...) of points (..., 3), at these points; world units."""

    # -- how it is drawn

    def uniforms(self, axes: Array) -> dict[str, Any]:
        """Uniforms of the snippet, for receivers in a frame with axes (3, 3)."""
        return {"u_radiance": tuple(min(c * self.intensity, BRIGHTEST_RADIANCE) for c in self.color)}

    @abstractmethod
    def gizmo(self, size: float, far: float) -> Gizmo:
        """How an overlay shows it, in a scene of a size; `far`: how far its map reaches."""
