"""Shadow: the settings of one light's shadow, and which of them can be combined."""

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
from glshadow.shadows.filters.filter import Needs
from glshadow.shadows.fits import Fit, ViewFit
from glshadow.shadows.metric import Target

MAX_RESOLUTION = 16384  # guaranteed by GL 4 hardware; the context's own limit is checked when the map is allocated

ASKED_FOR = "requested"
"""Reason given when a light names its filter."""

OF_A_MAP = ("resolution", "bias", "target", "clip", "fit")
"""Settings that apply to shadow maps only: if one is given, the derived filter uses a map."""

OF_ONE_MAP = OF_A_MAP[1:]
"""Those of them that DirectionMaps derives itself."""


class Faces(Enum):
    """Which sides of a mesh, as seen from the light, are drawn into the shadow map."""

    FRONT = "front"
    BACK = "back"
    BOTH = "both"


@dataclass(frozen=True)
class Shadow(Settings):
    """Settings of a light's shadow. None means derived.

    Parameters
    ----------
    resolution : int, optional
        Texels along each side of a view's map, 1 to 16384. None: 2048; for DirectionMaps 128.
    filter : Filter, optional
        The shadow technique: Hard, Pcf, ... or Exact, which has no shadow map and tests shadow rays against the scene's triangles. None:
        Exact() if the triangle lists fit into the driver's buffers; otherwise, or if another setting needs a map, Pcf(1), or
        LightSamples() for a light that has a size. `Used.why` reports the choice and its reason. A SkyLight or EnvironmentLight, which one
        map cannot serve, uses DirectionMaps() and turns a filter for one map into LightSamples(of=that filter).
    bias : optional
        None: ReceiverPlaneBias(). Also ConstantBias, SlopeScaledBias, NormalOffsetBias, ClipBias, NoBias.
    target : Target, optional
        None: DEPTH32F.
    clip : ClipSpace, optional
        None: 0..1 for directional lights, 0..1 reversed for local lights, if the driver has glClipControl; otherwise -1..1.
    fit : Fit, optional
        What the map covers. ViewFit: the receivers that the camera sees. SceneFit: the whole scene, independent of the camera. For
        directional lights also Cascades (several maps) and Lispsm (one perspective map). None: ViewFit().
    faces : Faces, optional
        None: back faces are culled for closed, consistently wound, single-sided meshes that do not contain the light; otherwise both.
    strength : float
        0 (no shadow) to 1: the share of the light that a shadow removes in the image. Visibility itself is not scaled.
    edge_falloff : float
        0 (none) to 1: how far before the border of a directional or spot light's map its shadow starts to fade, by the squared distance
        from the middle; Babylon.js's frustumEdgeFalloff. For maps with one view only.
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
                f"{type(self.bias).__name__} is a polygon offset, which moves depth attachments only; target {self.target.value} stores a "
                "metric. Use ReceiverPlaneBias or ConstantBias, or a depth target."
            )
        if self.filter is not None and self.filter.encoding and self.target not in (None, Target.DEPTH32F):
            raise SettingsError(
                f"{self.filter!r} prefilters a float depth texture: leave target at None, got {self.target.value}"
            )
        if (
            self.filter is not None
            and self.filter.needs is Needs.DIRECTIONS
            and (given := [name for name in OF_ONE_MAP if getattr(self, name) is not None])
        ):
            raise SettingsError(
                f"{self.filter!r} derives {' and '.join(given)}: leave them at None, or use LightSamples()"
            )
        if self.filter is not None and not self.filter.has_map and (self.bias is not None or self.target is not None):
            raise SettingsError(
                f"{self.filter!r} tests triangles, not stored depths: leave bias and target at None, got bias {self.bias!r} and target "
                f"{self.target.value if self.target else None!r}"
            )

    def resolved(
        self, without_map: str = "", with_map: str = "", sized: bool = False, usual: Filter | None = None
    ) -> ResolvedShadow:
        """The settings with filter, resolution and fit derived.

        Parameters
        ----------
        without_map : str
            Why triangles cannot be tested; empty: they can. A filter that interpolates asks for speed: it becomes a map's then, any other
            requested filter stays.
        with_map : str
            Another reason to use a shadow map; empty: none.
        sized : bool
            Whether the light has a size that the derived filter must support.
        usual : Filter, optional
            The light's own choice, used unless a setting is given that it derives itself.
        """
        of_a_map: Filter = LightSamples() if sized else Pcf(1)
        named = [name for name in OF_A_MAP if getattr(self, name) is not None]
        named += [with_map] if with_map else []
        if self.filter is not None and not (without_map and self.filter.interpolates):
            filter_, why = self.filter, ASKED_FOR
        elif usual is not None and not with_map and all(getattr(self, name) is None for name in OF_ONE_MAP):
            filter_, why = usual, "light from many directions"
        elif named:
            filter_, why = of_a_map, f"only a shadow map has {' and '.join(named)}"
        elif without_map:
            filter_, why = of_a_map, without_map
        else:
            filter_, why = Exact(), "no setting needs a shadow map"
        return ResolvedShadow(self, self.resolution or filter_.resolution, filter_, self.fit or ViewFit(), why)

    def spelled_out(self) -> Self:
        """The same settings with filter, resolution and fit as derived where triangles can be tested."""
        resolved = self.resolved()
        return replace(self, resolution=resolved.resolution, filter=resolved.filter, fit=resolved.fit)


@dataclass(frozen=True)
class ResolvedShadow:
    """A Shadow with its filter, resolution and fit resolved, and the reason for its filter."""

    requested: Shadow
    resolution: int
    filter: Filter
    fit: Fit
    why: str
