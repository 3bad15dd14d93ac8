"""LightSamples: a light that has a size as many maps, one for each of its points."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Self

from glshadow.core.setting import setting, shown, whole
from glshadow.core.spaces import Array
from glshadow.errors import SettingsError
from glshadow.shadows.filters.filter import Compare, Filter, Needs, SizeFilter
from glshadow.shadows.filters.pcf import Pcf


def _of_a_map(name: str, value: Any) -> Filter:
    if isinstance(value, Filter) and value.has_map and not value.points_of_light:
        return value
    raise SettingsError(
        f"{name} must be a filter that has a map and knows only points, such as Pcf(1), got {shown(value)}"
    )


@dataclass(frozen=True)
class LightSamples(SizeFilter):
    """The mean of as many shadow maps as the light has points: what every renderer can do, at their price. Also without OpenGL 4.3.

    Parameters
    ----------
    count : int
        Points of a light that has a size, 1 to 1024.
    of : Filter
        How each map is asked.

    References
    ----------
    Haeberli, Akeley 1990, "The Accumulation Buffer: Hardware Support for High-Quality Rendering", SIGGRAPH.
    """

    count: int = setting(whole(1, 1024), 64, help="points of the light, 1 to 1024")
    of: Filter = setting(_of_a_map, Pcf(1), help="how each map is asked", kw_only=True)

    spelling = "lightsamples"
    summary = "mean of COUNT maps, one for each point of a light that has a size"
    source = "Haeberli, Akeley 1990"
    fails = "costs COUNT maps; bands where points are few"

    @property
    def points_of_light(self) -> int:
        """As many as was said."""
        return self.count

    @property
    def of_a_point(self) -> Filter:
        """As each map is asked."""
        return self.of

    @property
    def needs(self) -> Needs:  # type: ignore[override]
        """What each map is asked for."""
        return self.of.needs

    @property
    def encoding(self) -> str:  # type: ignore[override]
        """That of each map."""
        return self.of.encoding

    @property
    def channels(self) -> int:  # type: ignore[override]
        """Those of each map."""
        return self.of.channels

    @property
    def snippet(self) -> str:  # type: ignore[override]
        """That of each map."""
        return self.of.snippet

    @property
    def radius(self) -> float:
        """That of each map."""
        return self.of.radius

    @property
    def slack_texels(self) -> float:
        """That of each map."""
        return self.of.slack_texels

    @property
    def reach_texels(self) -> float:
        """That of each map."""
        return self.of.reach_texels

    def defines(self) -> Mapping[str, int | str]:
        """Those of each map."""
        return self.of.defines()

    def visibility(self, position: Array, compare: Compare) -> Array:
        """That of each map."""
        return self.of.visibility(position, compare)

    @classmethod
    def soft(cls) -> tuple[Self, ...]:
        """Few maps, and many."""
        return (cls(16), cls(64))
