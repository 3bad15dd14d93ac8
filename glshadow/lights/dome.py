"""DomeLight: base of the lights that come from many directions at once."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from glshadow.core.spaces import Array, ClipSpace
from glshadow.lights.distant import DistantLight
from glshadow.shadows.filters import DirectionMaps, Filter, LightSamples
from glshadow.shadows.view import ShadowView


@dataclass(frozen=True, kw_only=True)
class DomeLight(DistantLight):
    """Base of distant lights that no single shadow map can represent."""

    most_views: ClassVar[int] = 0
    wide: ClassVar[bool] = True
    weighted: ClassVar[bool] = True
    fixed: ClassVar[bool] = True
    usual_filter: ClassVar[Filter | None] = DirectionMaps()

    @property
    def has_size(self) -> bool:
        """Always true."""
        return True

    def filter_for(self, requested: Filter) -> Filter:
        """A filter for one shadow map becomes the mean of that filter over directions of the light."""
        return requested if requested.points_of_light else LightSamples(of=requested)

    def views(
        self, bodies: list[Array], casters: Array, clip: ClipSpace, resolution: int, guard: int, fine: bool
    ) -> tuple[ShadowView, ...]:
        """None."""
        return ()
