"""Fits: what a light's maps cover. Settings alone; the views follow in shadows/fitted.py."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from glshadow.core.setting import flag, number, setting, whole
from glshadow.core.spaces import FARTHEST, Array
from glshadow.core.spelling import Spelled
from glshadow.shadows.fit_request import FitRequest, Fitted
from glshadow.shadows.fitted import around, cascades, warped


class Fit(Spelled):
    """What a map covers. Each kind is one subclass.

    Attributes
    ----------
    for_suns : bool
        Whether other lights are fitted by ViewFit().
    warps : bool
        Whether a sun's map may be in perspective.
    """

    for_suns: ClassVar[bool] = False
    warps: ClassVar[bool] = False

    @property
    def measures(self) -> bool:
        """Whether it asks what is really seen: then its views are made once the camera's depth is there."""
        return False

    def receivers(self, scene: Array, seen: list[Array]) -> list[Array]:
        """Corners (M, 3) of what a map has to hold, one array per body.

        Parameters
        ----------
        scene : (N, 8, 3) float64
            World corners of all bodies' boxes.
        seen : list of (M, 3) float64
            What the camera sees of each.
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
        """What is seen."""
        return seen


@dataclass(frozen=True)
class SceneFit(Fit):
    """Covers the whole scene; independent of the camera, so that a static light's map can be kept."""

    spelling = "scene"

    def receivers(self, scene: Array, seen: list[Array]) -> list[Array]:
        """Everything."""
        return list(scene)


MAX_CASCADES = 8


@dataclass(frozen=True)
class Cascades(Fit):
    """Cuts what the camera sees into slices of depth, each with a map of its own: near texels small, far ones large. Suns only.

    Usually each map is fitted to what the depth buffer really shows in its slice (sample distribution shadow maps); stable maps are not,
    so that a moving camera moves no texel.

    Parameters
    ----------
    count : int
        1 to 8 maps.
    split : float
        0 to 1: from slices of equal depth to slices of equal ratio.
    blend : float
        0 to 0.5: the share of each map's half width, or of each slice, over which it fades into the next.
    stable : bool
        Squares around the spheres that hold each slice, moved by whole texels only, up to `distance`.
    by_depth : bool
        Which map is asked follows from the receiver's depth; else it is the first that covers it.
    distance : float
        World units that stable cascades reach. 0: a power of two beyond what the camera can see.

    References
    ----------
    Zhang, Sun, Xu, Lun 2006, "Parallel-Split Shadow Maps for Large-Scale Virtual Environments": the splits. Lauritzen, Salvi, Lefohn 2011,
    "Sample Distribution Shadow Maps": the fit. Valient 2008, "Stable Rendering of Cascaded Shadow Maps", ShaderX6.
    """

    count: int = setting(whole(1, MAX_CASCADES), 4, help="1 to 8 maps")
    split: float = setting(number(0.0, 1.0), 1.0, help="0 slices of equal depth, 1 of equal ratio")
    blend: float = setting(number(0.0, 0.5), 0.1, help="share of a map over which it fades into the next")
    stable: bool = setting(flag(), False)
    by_depth: bool = setting(flag(), False)
    distance: float = setting(
        number(0.0, FARTHEST), 0.0, help="world units that stable maps reach; 0: all that is seen"
    )

    spelling = "cascades"
    for_suns = True

    @property
    def measures(self) -> bool:
        """Unless they are stable."""
        return not self.stable

    def receivers(self, scene: Array, seen: list[Array]) -> list[Array]:
        """What is seen, or all."""
        return list(scene) if self.stable else seen

    def fitted(self, request: FitRequest) -> Fitted:
        """One view for each slice."""
        return cascades(request, self)


@dataclass(frozen=True)
class Lispsm(Fit):
    """One map in perspective, so that near the camera texels are small: light space perspective shadow maps. Suns only.

    It is fitted to what the depth buffer really shows. Where texels would be larger than without perspective, over what is seen, it is left
    out: when the sun shines along the view.

    Parameters
    ----------
    psm : bool
        The perspective of the camera itself, as perspective shadow maps have it: the smallest texels right before the camera, the largest
        far away. Else the one whose worst texel is the smallest.

    References
    ----------
    Wimmer, Scherzer, Purgathofer 2004, "Light Space Perspective Shadow Maps", EGSR. Stamminger, Drettakis 2002, "Perspective Shadow Maps",
    SIGGRAPH: of a light at right angles to the view, the same with the centre of projection at the eye.
    """

    psm: bool = setting(flag(), False)

    spelling = "lispsm"
    for_suns = True
    warps = True

    @property
    def measures(self) -> bool:
        """Always."""
        return True

    def receivers(self, scene: Array, seen: list[Array]) -> list[Array]:
        """What is seen."""
        return seen

    def fitted(self, request: FitRequest) -> Fitted:
        """One view."""
        return warped(request, self, cascades(request, Cascades(1, blend=0.0)))


FITS: tuple[type[Fit], ...] = (ViewFit, SceneFit, Cascades, Lispsm)
