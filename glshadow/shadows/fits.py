"""Fits: settings for what a light's shadow maps cover. The views are computed in shadows/fitted.py."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from glshadow.core.setting import flag, number, setting, whole
from glshadow.core.spaces import FARTHEST, Array
from glshadow.core.spelling import Spelled
from glshadow.shadows.fit_request import FitRequest, Fitted
from glshadow.shadows.fitted import around, cascades, warped


class Fit(Spelled):
    """Selects what a shadow map covers. Each kind is a subclass.

    Attributes
    ----------
    at_infinity_only : bool
        Whether it works for directional lights only; other lights then use ViewFit().
    warps : bool
        Whether a directional light's map may have a perspective projection.
    """

    at_infinity_only: ClassVar[bool] = False
    warps: ClassVar[bool] = False

    @property
    def measures(self) -> bool:
        """Whether it needs what the camera really sees; its views are then computed after the camera's depth is known."""
        return False

    def receivers(self, scene: Array, seen: list[Array]) -> list[Array]:
        """Corners (M, 3) that a map must contain, one array per body.

        Parameters
        ----------
        scene : (N, 8, 3) float64
            World corners of all bodies' boxes.
        seen : list of (M, 3) float64
            The part of each body that the camera sees.
        """
        raise NotImplementedError

    def fitted(self, request: FitRequest) -> Fitted:
        """The views: around the receivers."""
        return around(request, self.receivers(request.scene, request.seen))


@dataclass(frozen=True)
class ViewFit(Fit):
    """Covers the receivers that the camera can see; a pure function of scene, light and camera."""

    spelling = "view"

    def receivers(self, scene: Array, seen: list[Array]) -> list[Array]:
        """The visible part of each body."""
        return seen


@dataclass(frozen=True)
class SceneFit(Fit):
    """Covers the whole scene, independent of the camera, so that a static light's map can be cached."""

    spelling = "scene"

    def receivers(self, scene: Array, seen: list[Array]) -> list[Array]:
        """Everything."""
        return list(scene)


MAX_CASCADES = 8


@dataclass(frozen=True)
class Cascades(Fit):
    """Splits the visible depth range into slices with a shadow map each: small texels near, large ones far. Directional lights only.

    By default each map is fitted to what the depth buffer shows in its slice (sample distribution shadow maps). Stable maps are not, so
    that a moving camera shifts no texel.

    Parameters
    ----------
    count : int
        Number of maps, 1 to 8.
    split : float
        0 to 1: from slices of equal depth to slices of equal depth ratio.
    blend : float
        0 to 0.5: the share of each map's half width, or of each slice, over which it fades into the next map.
    stable : bool
        Use squares around the spheres that contain each slice, moved in whole texels, up to `distance`.
    by_depth : bool
        Select the map by the receiver's depth; otherwise use the first map that covers the receiver.
    distance : float
        World units that stable cascades cover. 0: a power of two beyond what the camera can see.

    References
    ----------
    Zhang, Sun, Xu, Lun 2006, "Parallel-Split Shadow Maps for Large-Scale Virtual Environments": the splits. Lauritzen, Salvi, Lefohn 2011,
    "Sample Distribution Shadow Maps": the fit. Valient 2008, "Stable Rendering of Cascaded Shadow Maps", ShaderX6.
    """

    count: int = setting(whole(1, MAX_CASCADES), 4, help="number of maps, 1 to 8")
    split: float = setting(number(0.0, 1.0), 1.0, help="0 slices of equal depth, 1 of equal ratio")
    blend: float = setting(number(0.0, 0.5), 0.1, help="share of a map over which it fades into the next")
    stable: bool = setting(flag(), False)
    by_depth: bool = setting(flag(), False)
    distance: float = setting(
        number(0.0, FARTHEST), 0.0, help="world units that stable maps cover; 0: everything visible"
    )

    spelling = "cascades"
    at_infinity_only = True

    @property
    def measures(self) -> bool:
        """True unless the cascades are stable."""
        return not self.stable

    def receivers(self, scene: Array, seen: list[Array]) -> list[Array]:
        """The visible part of each body, or the whole scene."""
        return list(scene) if self.stable else seen

    def fitted(self, request: FitRequest) -> Fitted:
        """One view for each slice."""
        return cascades(request, self)


@dataclass(frozen=True)
class Lispsm(Fit):
    """Light space perspective shadow map: one map with perspective, so that texels near the camera are small. Directional lights only.

    The map is fitted to what the depth buffer shows. If the perspective would make the visible texels larger, as it does when the light
    shines along the view, it is left out.

    Parameters
    ----------
    psm : bool
        Use the perspective of the camera itself, as perspective shadow maps do: the smallest texels directly in front of the camera, the
        largest far away. Otherwise the perspective whose worst texel is the smallest.

    References
    ----------
    Wimmer, Scherzer, Purgathofer 2004, "Light Space Perspective Shadow Maps", EGSR. Stamminger, Drettakis 2002, "Perspective Shadow Maps",
    SIGGRAPH: for a light at right angles to the view it is the same with the centre of projection at the eye.
    """

    psm: bool = setting(flag(), False)

    spelling = "lispsm"
    at_infinity_only = True
    warps = True

    @property
    def measures(self) -> bool:
        """Always."""
        return True

    def receivers(self, scene: Array, seen: list[Array]) -> list[Array]:
        """The visible part of each body."""
        return seen

    def fitted(self, request: FitRequest) -> Fitted:
        """One view."""
        return warped(request, self, cascades(request, Cascades(1, blend=0.0)))


FITS: tuple[type[Fit], ...] = (ViewFit, SceneFit, Cascades, Lispsm)
