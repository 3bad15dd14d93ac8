"""Depth bias: what keeps a surface from shadowing itself. Settings and formulas.

A bias moves the compare depth towards the light (or the stored depth away from it). World units along the light, except for
`ClipBias`, Babylon's unitless one, and `SlopeScaledBias`, which is GL's polygon offset.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from glshadow.core.setting import Settings, flag, number, setting
from glshadow.core.spaces import Array, ClipSpace
from glshadow.errors import SettingsError

# A curved surface is a fan of planes: neighbouring facets, which the filter also reads, rise above the receiver's own. They are
# allowed 15 degrees over the filter's reach, half a texel of depth for 3 x 3. Less leaves grain (terrain: 0.78 % of pixels at 1
# degree, 0.006 at 15), more is seen at a caster's foot (at 20 the hard cases have the first leaks beyond an edge's own texels).
FACET_SLOPE = float(np.tan(np.radians(15.0)))


@dataclass(frozen=True)
class ReceiverPlaneBias:
    """Derived, no knob: compare depth follows the receiver's own plane from tap to tap, minus the slack of one tap.

    The slack is what the plane rises over the part of the map that one tap stands for (half a texel for a nearest tap, one for a
    bilinear or gathered one), plus FACET_SLOPE for curved neighbours, the rounding, and the quantum of the map's format.
    """


@dataclass(frozen=True)
class ConstantBias(Settings):
    """Compare depth moved by `world` units along the light. Right for one slope only."""

    world: float = setting(number(0.0), help="world units along the light")


@dataclass(frozen=True)
class SlopeScaledBias(Settings):
    """GL's polygon offset in the caster pass: factor * max(|dz/dx|, |dz/dy|) + units * r. Depth textures only."""

    factor: float = setting(number(0.0), 1.1, help="times the steepest slope of the caster's depth, per texel")
    units: float = setting(number(0.0), 4.0, help="smallest steps of the depth format")


@dataclass(frozen=True)
class NormalOffsetBias(Settings):
    """The receiver moved along its normal by texels * texel size * sin(angle to the light) before it is projected.

    References
    ----------
    Holbert 2011, "Saying Goodbye to Shadow Acne", GDC poster. 1.5 texels are one bilinear reach of 3 x 3.
    """

    texels: float = setting(number(0.0), 1.5, help="texels along the receiver's normal")


@dataclass(frozen=True)
class ClipBias(Settings):
    """Babylon's bias: clip units for depth textures, metric units for metric targets.

    Parameters
    ----------
    clip : float
        Added to the stored depth: clip z += s * clip * w * bias_factor(clip space), or metric += clip.
    normal : float
        World units by which the **caster's** vertices move against their normal, times sin(angle to the light).
    caster : bool
        True: applied where the map is drawn, as Babylon does. False: subtracted from the compare depth, the same test.
    """

    clip: float = setting(number(), help="clip units, or metric units of a metric target, added to the stored depth")
    normal: float = setting(number(0.0), 0.0, help="world units by which casters move against their normal")
    caster: bool = setting(flag(), True, help="applied where the map is drawn, not where it is compared")


@dataclass(frozen=True)
class NoBias:
    """No bias: every lit surface shadows itself in stripes. For teaching and for tests."""


Bias = ReceiverPlaneBias | ConstantBias | SlopeScaledBias | NormalOffsetBias | ClipBias | NoBias


def bias_factor(clip: ClipSpace) -> float:
    """0.5 where NDC z spans one unit, 1 where it spans two: the same window depth moves either way."""
    return 0.5 if clip.zero_to_one else 1.0


def receiver_plane_from_derivatives(duvz_dx: ArrayLike, duvz_dy: ArrayLike) -> Array:
    """Gradient of depth over the map, from screen derivatives of a receiver that is planar.

    Both derivations of the source, through the screen and within the map, end in this one formula.

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
    """The same gradient from the plane's normal in (u, v, depth) space: -(n_u, n_v) / n_z; zero where edge-on (n_z = 0)."""
    normal = np.asarray(normal_uvz, dtype=np.float64)
    edge_on = normal[..., 2] == 0.0
    gradient = -normal[..., :2] / np.where(edge_on, 1.0, normal[..., 2])[..., None]
    return np.where(edge_on[..., None], 0.0, gradient)


def normal_bias(position_w: ArrayLike, normal_w: ArrayLike, to_light_w: ArrayLike, amount: float) -> Array:
    """A caster's vertex moved against its normal by amount * sin(angle to the light); (..., 3) world.

    The sine is clamped at 0: rounding can make 1 - (N.L)^2 negative where the light is straight above.
    """
    normal, towards = np.asarray(normal_w, dtype=np.float64), np.asarray(to_light_w, dtype=np.float64)
    cosine = (normal * towards).sum(axis=-1, keepdims=True)
    return np.asarray(position_w - normal * amount * np.sqrt(np.maximum(0.0, 1.0 - cosine * cosine)))
