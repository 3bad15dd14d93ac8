"""Shadow: the settings of one light's shadow, and which of them can work together."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

from glshadow.core.bias import Bias
from glshadow.core.filters import Filter, Pcf
from glshadow.core.fit import Fit, ViewFit
from glshadow.core.metric import Target
from glshadow.core.setting import Settings, instance, number, optional, setting, whole
from glshadow.core.spaces import ClipSpace
from glshadow.errors import SettingsError

MAX_RESOLUTION = 16384  # what GL 4 hardware guarantees; the context's own limit is checked when the map is made


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
    resolution : int
        Texels along each side of a view's map, 1 to 16384.
    filter : Filter
        How one receiver is answered for: Hard, Pcf, ... or Exact, which has no map and asks the triangles.
    bias : optional
        None: ReceiverPlaneBias(). Also ConstantBias, SlopeScaledBias, NormalOffsetBias, ClipBias, NoBias.
    target : Target, optional
        None: DEPTH32F.
    clip : ClipSpace, optional
        None: 0..1 for suns, 0..1 reversed for lights with a position, where the driver has glClipControl; else -1..1.
    fit : ViewFit or SceneFit
        What the map covers: the receivers the camera sees, or the whole scene whatever the camera.
    faces : Faces, optional
        None: back faces are culled for closed, consistently wound, single-sided meshes that do not contain the light; else both.
    strength : float
        0 (no shadow) to 1: how much of the light a shadow takes away in the image. Visibility itself is not scaled.
    """

    resolution: int = setting(whole(1, MAX_RESOLUTION, unit="texels"), 2048)
    filter: Filter = setting(instance(Filter), factory=Pcf)
    bias: Bias | None = setting(optional(instance(Bias)), None)
    target: Target | None = setting(optional(instance(Target)), None)
    clip: ClipSpace | None = setting(optional(instance(ClipSpace)), None)
    fit: Fit = setting(instance(Fit), factory=ViewFit)
    faces: Faces | None = setting(optional(instance(Faces)), None)
    strength: float = setting(number(0.0, 1.0), 1.0)

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.bias is not None and self.bias.depth_only and self.target is not None and not self.target.is_depth:
            raise SettingsError(
                f"{type(self.bias).__name__} is polygon offset and moves a depth attachment only; target {self.target.value} stores a "
                "metric. Use ReceiverPlaneBias or ConstantBias, or a depth target."
            )
        if not self.filter.has_map and (self.bias is not None or self.target is not None):
            raise SettingsError(
                f"{self.filter!r} compares triangles, not depths: leave bias and target at None, got bias {self.bias!r} and target "
                f"{self.target.value if self.target else None!r}"
            )
