"""LightSamples: one shadow map for each sample point of a light that has a size."""

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
        f"{name} must be a filter for point lights that uses a shadow map, such as Pcf(1), got {shown(value)}"
    )


@dataclass(frozen=True)
class LightSamples(SizeFilter):
    """The mean of one shadow map per sample point of the light: works with every renderer, at the cost of that many maps.

    Parameters
    ----------
    count : int
        Points of a light that has a size, 1 to 1024.
    of : Filter
        Filter of each shadow map.

    References
    ----------
    Haeberli, Akeley 1990, "The Accumulation Buffer: Hardware Support for High-Quality Rendering", SIGGRAPH.
    """

    count: int = setting(whole(1, 1024), 64, help="points of the light, 1 to 1024")
    of: Filter = setting(_of_a_map, Pcf(1), help="filter of each map", kw_only=True)

    spelling = "lightsamples"
    summary = "mean of COUNT shadow maps, one per sample point of a light that has a size"
    source = "Haeberli, Akeley 1990"
    fails = "costs COUNT maps; bands with few points"

    @property
    def points_of_light(self) -> int:
        """`count`."""
        return self.count

    @property
    def of_a_point(self) -> Filter:
        """`of`."""
        return self.of

    @property
    def needs(self) -> Needs:  # type: ignore[override]
        """Needs of the filter of each map."""
        return self.of.needs

    @property
    def encoding(self) -> str:  # type: ignore[override]
        """Encoding of each map."""
        return self.of.encoding

    @property
    def channels(self) -> int:  # type: ignore[override]
        """Channels of each map."""
        return self.of.channels

    @property
    def snippet(self) -> str:  # type: ignore[override]
        """Snippet of each map's filter."""
        return self.of.snippet

    @property
    def radius(self) -> float:
        """Radius of each map's filter."""
        return self.of.radius

    @property
    def slack_texels(self) -> float:
        """Slack of each map's filter."""
        return self.of.slack_texels

    @property
    def reach_texels(self) -> float:
        """Reach of each map's filter."""
        return self.of.reach_texels

    def defines(self) -> Mapping[str, int | str]:
        """Defines of each map's filter."""
        return self.of.defines()

    def visibility(self, position: Array, compare: Compare) -> Array:
        """Visibility of each map's filter."""
        return self.of.visibility(position, compare)

    @classmethod
    def soft(cls) -> tuple[Self, ...]:
        """Few maps, and many."""
        return (cls(16), cls(64))
