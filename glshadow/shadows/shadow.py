"""Shadow: the settings of one light's shadow, and which of them can work together."""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import Enum
from typing import Self

from glshadow.core.setting import Settings, instance, number, optional, setting, whole
from glshadow.core.spaces import ClipSpace
from glshadow.errors import SettingsError
from glshadow.shadows.bias import Bias
from glshadow.shadows.channel import Channel
from glshadow.shadows.filters import Exact, Filter, LightSamples, Pcf
from glshadow.shadows.fits import Fit, ViewFit
from glshadow.shadows.metric import Target

MAX_RESOLUTION = 16384  # what GL 4 hardware guarantees; the context's own limit is checked when the map is made

ASKED_FOR = "asked for"
"""Why a light has its filter, where it names one."""

RESOLUTION = 2048

OF_A_MAP = ("resolution", "bias", "target", "clip", "fit")
"""Settings that only a map has: where one is given, a derived filter is one that has a map."""


class Faces(Enum):
    """Which sides of a mesh, seen from the light, are drawn into its map."""

    FRONT = "front"
    BACK = "back"
    BOTH = "both"


@dataclass(frozen=True)
class Shadow(Settings):
    """How a light's shadow is made. None means derived.

    Parameters
    ----------
    resolution : int, optional
        Texels along each side of a view's map, 1 to 16384. None: 2048.
    filter : Filter, optional
        How one receiver is answered for: Hard, Pcf, ... or Exact, which has no map and asks the triangles. None: Exact() where lists
        of the scene's triangles fit into the driver's buffers; elsewhere, and where another setting asks for a map, Pcf(1), or
        LightSamples() for a light that has a size. `Used.why` says which and why. A SkyLight, which no single map serves, turns a filter of
        one map into LightSamples(of=that filter).
    bias : optional
        None: ReceiverPlaneBias(). Also ConstantBias, SlopeScaledBias, NormalOffsetBias, ClipBias, NoBias.
    target : Target, optional
        None: DEPTH32F.
    clip : ClipSpace, optional
        None: 0..1 for suns, 0..1 reversed for lights with a position, where the driver has glClipControl; else -1..1.
    fit : Fit, optional
        What the map covers: ViewFit the receivers the camera sees, SceneFit the whole scene whatever the camera; of suns Cascades several
        maps, Lispsm one in perspective. None: ViewFit().
    faces : Faces, optional
        None: back faces are culled for closed, consistently wound, single-sided meshes that do not contain the light; else both.
    strength : float
        0 (no shadow) to 1: how much of the light a shadow takes away in the image. Visibility itself is not scaled.
    edge_falloff : float
        0 (none) to 1: from how far before the border of a sun's or a spot's map its shadow fades, by the squared distance from the middle;
        Babylon.js's frustumEdgeFalloff. Only maps of one view have it.
    channel : Channel, optional
        Set by `PackedShadow`.
    """

    resolution: int | None = setting(optional(whole(1, MAX_RESOLUTION, unit="texels")), None)
    filter: Filter | None = setting(optional(instance(Filter)), None)
    bias: Bias | None = setting(optional(instance(Bias)), None)
    target: Target | None = setting(optional(instance(Target)), None)
    clip: ClipSpace | None = setting(optional(instance(ClipSpace)), None)
    fit: Fit | None = setting(optional(instance(Fit)), None)
    faces: Faces | None = setting(optional(instance(Faces)), None)
    strength: float = setting(number(0.0, 1.0), 1.0)
    edge_falloff: float = setting(number(0.0, 1.0), 0.0)
    channel: Channel | None = setting(optional(instance(Channel), "a texture of its own"), None)

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.bias is not None and self.bias.depth_only and self.target is not None and not self.target.is_depth:
            raise SettingsError(
                f"{type(self.bias).__name__} is polygon offset and moves a depth attachment only; target {self.target.value} stores a "
                "metric. Use ReceiverPlaneBias or ConstantBias, or a depth target."
            )
        if self.filter is not None and self.filter.encoding and self.target not in (None, Target.DEPTH32F):
            raise SettingsError(
                f"{self.filter!r} takes means of what a float depth texture holds: leave target at None, got {self.target.value}"
            )
        if self.filter is not None and not self.filter.has_map and (self.bias is not None or self.target is not None):
            raise SettingsError(
                f"{self.filter!r} compares triangles, not depths: leave bias and target at None, got bias {self.bias!r} and target "
                f"{self.target.value if self.target else None!r}"
            )

    def resolved(self, without_map: str = "", with_map: str = "", sized: bool = False) -> ResolvedShadow:
        """The settings with a filter, a resolution and a fit in place of None.

        Parameters
        ----------
        without_map : str
            Why triangles cannot be asked; empty: they can.
        with_map : str
            What else asks for a map; empty: nothing.
        sized : bool
            Whether the light has a size, which a derived filter obeys.
        """
        of_a_map: Filter = LightSamples() if sized else Pcf(1)
        named = [name for name in OF_A_MAP if getattr(self, name) is not None]
        named += [with_map] if with_map else []
        if self.filter is not None:
            filter_, why = self.filter, ASKED_FOR
        elif named:
            filter_, why = of_a_map, f"only a map has {' and '.join(named)}"
        elif without_map:
            filter_, why = of_a_map, without_map
        else:
            filter_, why = Exact(), "no setting asks for a map"
        return ResolvedShadow(self, self.resolution or RESOLUTION, filter_, self.fit or ViewFit(), why)

    def spelled_out(self) -> Self:
        """The same with the filter, the resolution and the fit that it has where triangles can be asked."""
        resolved = self.resolved()
        return replace(self, resolution=resolved.resolution, filter=resolved.filter, fit=resolved.fit)


@dataclass(frozen=True)
class ResolvedShadow:
    """A Shadow with its filter, resolution and fit decided, and why it has that filter."""

    requested: Shadow
    resolution: int
    filter: Filter
    fit: Fit
    why: str
