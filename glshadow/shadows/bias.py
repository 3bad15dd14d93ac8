"""Depth bias: settings and formulas that prevent surfaces from shadowing themselves.

A bias moves the compare depth towards the light (or the stored depth away from it). World units along the light, except for
`ClipBias`, Babylon's unitless one, and `SlopeScaledBias`, which is GL's polygon offset.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike

from glshadow.core.setting import flag, number, optional, setting
from glshadow.core.spaces import Array, ClipSpace
from glshadow.core.spelling import Spelled
from glshadow.errors import SettingsError

# A curved surface is a fan of planes: neighbouring facets, which the filter also reads, rise above the receiver's plane. The bias
# allows them 15 degrees over the filter's reach, half a texel of depth for 3 x 3. Less leaves acne (terrain: 0.78 % of pixels at
# 1 degree, 0.006 at 15). More shows as light leaks at a caster's foot (at 20 the hard cases have the first beyond an edge's own texels).
FACET_SLOPE = float(np.tan(np.radians(15.0)))

SNAP_TEXELS = 1.0 / 128.0  # rasterisers round vertices to 1/256 texel (8 subpixel bits), which moves edges and depths


class Bias(Spelled):
    """Prevents a surface from shadowing itself. Each kind is a subclass; the passes use only these attributes and methods.

    Attributes
    ----------
    snippet : str
        GLSL file for the slot <bias>: moves the point where a receiver is compared.
    follows_plane : bool
        Whether the compare depth follows the receiver's plane from tap to tap, minus the slack of a tap.
    certain : bool
        Whether no surface shadows itself, whatever the settings: casters that shade nothing else then need not be drawn.
    depth_only : bool
        Whether it works with depth textures only.
    """

    snippet: ClassVar[str] = "bias/none.glsl"
    follows_plane: ClassVar[bool] = False
    certain: ClassVar[bool] = False
    depth_only: ClassVar[bool] = False

    def derived(self, reach: float) -> Self:
        """The bias with None replaced by numbers, for a filter that reads texels up to `reach` from the receiver along each axis."""
        return self

    def shortfall(self, reach: float, texel: float) -> str:
        """A sentence on which planes shadow themselves under such a filter. Empty: none, or it cannot be determined.

        Parameters
        ----------
        reach : float
            As in `derived`.
        texel : float
            World units: the map's largest texel.
        """
        return ""

    @property
    def shift_texels(self) -> float:
        """Distance in texels by which a receiver moves over the map, for square texels."""
        return 0.0

    @property
    def polygon_offset(self) -> tuple[float, float]:
        """(factor, units) of GL's polygon offset in the caster pass, for depth that is not reversed."""
        return (0.0, 0.0)

    @property
    def of_caster(self) -> tuple[float, float] | None:
        """(clip or metric units, world units against the normal) by which casters are moved. None: casters are not moved."""
        return None

    @property
    def of_compare(self) -> float:
        """Clip or metric units that are subtracted from the compare depth."""
        return 0.0

    @property
    def amount(self) -> float:
        """Value of the snippet's uniform."""
        return 0.0

    def moved(self, points: Array, normals: Array, towards: Array, distance: Array, lean: Array) -> Array:
        """Points where receivers are compared: the float64 twin of the snippet.

        Parameters
        ----------
        points, normals, towards : (N, 3) float64
            World space; `towards`: unit vectors to the light.
        distance : (N,) float64
            Distance to the light; infinite for a directional light.
        lean : (N,) float64
            Sine of the normal's angle to the map's axis, or to the light, times the size of a texel along which the normal leans.
        """
        return points


@dataclass(frozen=True)
class ReceiverPlaneBias(Bias):
    """Derived, without settings: the compare depth follows the receiver's own plane from tap to tap, minus the slack of one tap.

    The slack is the rise of the plane over the part of the map that one tap represents (half a texel for a nearest tap, one for a
    bilinear or gathered one), plus FACET_SLOPE for curved neighbours, the rounding, and the quantum of the map's format.
    """

    spelling = "receiver-plane"
    follows_plane = True
    certain = True


@dataclass(frozen=True)
class ConstantBias(Bias):
    """Moves the compare depth by `world` units along the light. Correct for one slope only."""

    world: float = setting(number(0.0), help="offset along the light, world units")

    spelling = "constant"
    snippet = "bias/constant.glsl"

    def shortfall(self, reach: float, texel: float) -> str:
        """A plane at an angle to the light's rays rises by up to sqrt(2) reach texels times the tangent of its tilt."""
        tilt = float(np.degrees(np.arctan(self.world / (np.sqrt(2.0) * reach * texel)))) if texel > 0.0 else 90.0
        if tilt >= 45.0:
            return ""
        return (
            f"bias {self} is too small for a filter that reads {reach:g} texels of {texel:.3g} away: planes tilted by more than "
            f"{tilt:.2g} degrees against the light may shadow themselves; leave bias out"
        )

    @property
    def amount(self) -> float:
        """Offset in world units."""
        return self.world

    def moved(self, points: Array, normals: Array, towards: Array, distance: Array, lean: Array) -> Array:
        """The receiver moved towards the light, but not past it."""
        return np.asarray(points + towards * np.minimum(self.world, 0.999 * distance)[:, None])


@dataclass(frozen=True)
class SlopeScaledBias(Bias):
    """GL's polygon offset in the caster pass: factor * max(|dz/dx|, |dz/dy|) + units * r. Depth textures only.

    Parameters
    ----------
    factor : float, optional
        None: twice the filter's reach, 1 for `Hard` and 4 for `Pcf(1)`. Over a texel that is i, j away, at most the reach, a plane rises by
        i |dz/dx| + j |dz/dy| <= 2 reach * max(|dz/dx|, |dz/dy|), so no plane shadows itself.
    units : float
        Constant offset against rounding, in steps of the depth format.

    References
    ----------
    OpenGL 4.6, section 14.6.5, "Depth Offset".
    """

    factor: float | None = setting(optional(number(0.0)), None, help="times the depth's slope per texel")
    units: float = setting(number(0.0), 4.0, help="times the depth format's smallest step")

    spelling = "slope"
    terse = True
    depth_only = True

    def derived(self, reach: float) -> Self:
        """The bias with a factor that suffices for the filter."""
        return replace(self, factor=_enough(2.0, reach)) if self.factor is None else self

    def shortfall(self, reach: float, texel: float) -> str:
        """The warning for a given factor that is too small."""
        return _lacks(self, self.factor, 2.0, reach, "factor")

    @property
    def polygon_offset(self) -> tuple[float, float]:
        """(factor, units) as set."""
        assert self.factor is not None, "see derived"
        return (self.factor, self.units)


@dataclass(frozen=True)
class NormalOffsetBias(Bias):
    """Moves the receiver along its normal by texels * texel size * sine before it is projected.

    The sine is that of the normal's angle to the light or, if that is larger, to the axis of a local light's map. If texels are not
    square, the size is that along which the normal leans.

    Parameters
    ----------
    texels : float, optional
        None: the filter's reach times the square root of 2, .7 for `Hard` and 2.8 for `Pcf(1)`. With a normal (x, y, z) in the axes of a
        map with texels (u, v), a receiver gains texels * |(x u, y v)| / z over its plane. Within the reach the plane rises by at most
        reach * (|x| u + |y| v) / z <= sqrt(2) reach * |(x u, y v)| / z, so no plane shadows itself.

    References
    ----------
    Holbert 2011, "Saying Goodbye to Shadow Acne", GDC poster.
    """

    texels: float | None = setting(optional(number(0.0)), None, help="offset along the normal, texels")

    spelling = "normal-offset"
    terse = True
    snippet = "bias/normal_offset.glsl"

    def derived(self, reach: float) -> Self:
        """The bias with as many texels as the filter needs."""
        return replace(self, texels=_enough(np.sqrt(2.0), reach)) if self.texels is None else self

    def shortfall(self, reach: float, texel: float) -> str:
        """The warning for given texels that are too few."""
        return _lacks(self, self.texels, np.sqrt(2.0), reach, "texels")

    @property
    def shift_texels(self) -> float:
        """The whole offset, under a grazing light."""
        return self.amount

    @property
    def amount(self) -> float:
        """Texels."""
        assert self.texels is not None, "see derived"
        return self.texels

    def moved(self, points: Array, normals: Array, towards: Array, distance: Array, lean: Array) -> Array:
        """The receiver moved along its normal."""
        return np.asarray(points + normals * (self.amount * lean)[:, None])


@dataclass(frozen=True)
class ClipBias(Bias):
    """Babylon's bias: clip units for depth textures, metric units for metric targets.

    Parameters
    ----------
    clip : float
        Added to the stored depth: clip z += s * clip * w * bias_factor(clip space), or metric += clip.
    normal : float
        World units by which **caster** vertices move against their normal, times sin(angle to the light).
    caster : bool
        True: applied when the map is drawn, as Babylon does. False: subtracted from the compare depth, which is the same test.
    """

    clip: float = setting(number(), help="depth offset, clip units or units of the metric")
    normal: float = setting(number(0.0), 0.0, help="offset of casters against their normal, world units")
    caster: bool = setting(flag(), True, help="whether it moves casters or the compare depth")

    spelling = "clip"

    @property
    def of_caster(self) -> tuple[float, float] | None:
        """(clip, normal) as set, if casters are moved."""
        return (self.clip, self.normal) if self.caster else None

    @property
    def of_compare(self) -> float:
        """clip."""
        return 0.0 if self.caster else self.clip


@dataclass(frozen=True)
class NoBias(Bias):
    """No bias: lit surfaces show shadow acne. For teaching and tests."""

    spelling = "none"


BIASES: tuple[type[Bias], ...] = (ReceiverPlaneBias, ConstantBias, SlopeScaledBias, NormalOffsetBias, ClipBias, NoBias)


def _enough(share: float, reach: float) -> float:
    """The offset that a plane needs, `share` per texel of the filter's reach and of a snapped vertex; rounded up, as reports write it."""
    return float(np.ceil(share * (reach + SNAP_TEXELS) * 1e4) / 1e4)


def _lacks(bias: Bias, given: float | None, share: float, reach: float, name: str) -> str:
    if given is None or given >= (needed := share * reach) * (1.0 - 1e-6):
        return ""
    return (
        f"bias {bias} is too small for a filter that reads {reach:g} texels away: planes that do not face the light shadow themselves "
        f"below {name} = {needed:.4g}; leave {name} out"
    )


def bias_factor(clip: ClipSpace) -> float:
    """0.5 if NDC z spans one unit, 1 if it spans two: the same window depth moves in both."""
    return 0.5 if clip.zero_to_one else 1.0


WINDOW_PER_CLIP = 0.5
"""Window depth moved by a bias of 1 times `bias_factor`: equal to NDC z in 0..1, half of it in -1..1."""


def receiver_plane_from_derivatives(duvz_dx: ArrayLike, duvz_dy: ArrayLike) -> Array:
    """Gradient of depth over the map, from screen derivatives of a planar receiver.

    Both derivations in the sources, through the screen and within the map, lead to this formula.

    Parameters
    ----------
    duvz_dx, duvz_dy : (..., 3) array_like
        Derivatives of (u, v, depth) along two independent screen directions.

    Returns
    -------
    (..., 2) float64
        (d depth / du, d depth / dv). Zero where the plane is edge-on to the light: the 2x2 Jacobian is singular against its
        own terms, |det| <= 2^-20 (|du/dx dv/dy| + |dv/dx du/dy|).

    Raises
    ------
    SettingsError
        If the last axis is not 3.

    References
    ----------
    Tuft 2010, "Cascaded Shadow Maps"; Luna 2016, section 20.5. GLSL twin: glsl/bias/receiver_plane_derivatives.glsl
    """
    dx, dy = np.asarray(duvz_dx, dtype=np.float64), np.asarray(duvz_dy, dtype=np.float64)
    if dx.shape[-1:] != (3,) or dy.shape[-1:] != (3,):
        raise SettingsError(f"derivatives need a last axis of 3 (u, v, depth), got shapes {dx.shape} and {dy.shape}")
    a, b = dx[..., 0] * dy[..., 1], dx[..., 1] * dy[..., 0]
    det = a - b
    singular = np.abs(det) <= 2.0**-20 * (np.abs(a) + np.abs(b))
    du = dy[..., 1] * dx[..., 2] - dx[..., 1] * dy[..., 2]
    dv = dx[..., 0] * dy[..., 2] - dy[..., 0] * dx[..., 2]
    gradient = np.stack([du, dv], axis=-1) / np.where(singular, 1.0, det)[..., None]
    return np.where(singular[..., None], 0.0, gradient)


def receiver_plane_from_normal(normal_uvz: ArrayLike) -> Array:
    """The same gradient from the plane's normal in (u, v, depth) space: -(n_u, n_v) / n_z; zero if edge-on (n_z = 0)."""
    normal = np.asarray(normal_uvz, dtype=np.float64)
    edge_on = normal[..., 2] == 0.0
    gradient = -normal[..., :2] / np.where(edge_on, 1.0, normal[..., 2])[..., None]
    return np.where(edge_on[..., None], 0.0, gradient)


def normal_bias(position_w: ArrayLike, normal_w: ArrayLike, to_light_w: ArrayLike, amount: float) -> Array:
    """Caster vertices moved against their normal by amount * sin(angle to the light); (..., 3) world space.

    The sine is clamped at 0: rounding can make 1 - (N.L)^2 negative if the light is straight above.
    """
    normal, towards = np.asarray(normal_w, dtype=np.float64), np.asarray(to_light_w, dtype=np.float64)
    cosine = (normal * towards).sum(axis=-1, keepdims=True)
    return np.asarray(position_w - normal * amount * np.sqrt(np.maximum(0.0, 1.0 - cosine * cosine)))
