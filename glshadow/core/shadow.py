"""Shadow: the settings of one light's shadow, and which of them can work together."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum
from typing import get_args

from glshadow.core.bias import Bias, SlopeScaledBias
from glshadow.core.fit import Fit, ViewFit
from glshadow.core.kernels import Exact, Filter, Pcf
from glshadow.core.metric import Target
from glshadow.core.spaces import ClipSpace
from glshadow.errors import SettingsError

MAX_RESOLUTION = 16384  # what GL 4 hardware guarantees; the context's own limit is checked when the map is made


class Faces(Enum):
    """Which sides of a mesh, seen from the light, are drawn into its map."""

    FRONT = "front"
    BACK = "back"
    BOTH = "both"


@dataclass(frozen=True)
class Shadow:
    """How a light's shadow is made. None means derived.

    Parameters
    ----------
    resolution : int
        Texels along each side of a view's map, 1 to 16384.
    filter : Hard, Pcf or Exact
        How many texels answer for one receiver; Exact: none, it asks the triangles.
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

    resolution: int = 2048
    filter: Filter = field(default_factory=Pcf)
    bias: Bias | None = None
    target: Target | None = None
    clip: ClipSpace | None = None
    fit: Fit = field(default_factory=ViewFit)
    faces: Faces | None = None
    strength: float = 1.0

    def __post_init__(self) -> None:
        resolution = self.resolution
        if isinstance(resolution, bool) or not isinstance(resolution, int) or not 1 <= resolution <= MAX_RESOLUTION:
            raise SettingsError(f"resolution must be an integer in [1, {MAX_RESOLUTION}] texels, got {resolution!r}")
        if not 0.0 <= self.strength <= 1.0:
            raise SettingsError(f"strength must be in [0, 1], got {self.strength!r}")
        for name, value, kinds in (
            ("filter", self.filter, get_args(Filter)),
            ("bias", self.bias, (*get_args(Bias), type(None))),
            ("target", self.target, (Target, type(None))),
            ("clip", self.clip, (ClipSpace, type(None))),
            ("fit", self.fit, get_args(Fit)),
            ("faces", self.faces, (Faces, type(None))),
        ):
            if not isinstance(value, kinds):
                allowed = ", ".join(kind.__name__ for kind in kinds if kind is not type(None))
                raise SettingsError(f"{name} must be an instance of {allowed}, got {value!r}")
        if isinstance(self.bias, SlopeScaledBias) and self.target is not None and not self.target.is_depth:
            raise SettingsError(
                f"SlopeScaledBias is polygon offset and moves a depth attachment only; target {self.target.value} stores a "
                "metric. Use ReceiverPlaneBias or ConstantBias, or a depth target."
            )
        if isinstance(self.filter, Exact) and (self.bias is not None or self.target is not None):
            raise SettingsError(
                f"Exact() compares triangles, not depths: leave bias and target at None, got bias {self.bias!r} and target "
                f"{self.target.value if self.target else None!r}"
            )
