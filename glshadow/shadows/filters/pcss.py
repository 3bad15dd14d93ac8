"""Pcss: percentage closer soft shadows."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Self

from glshadow.core.setting import setting, whole
from glshadow.shadows.filters.filter import Needs, SizeFilter

MOST_TEXELS = 32.0
"""Radius of the search and of the filter, at most: how far the map must reach beyond what it was fitted to."""
MAX_TAPS = 64


@dataclass(frozen=True)
class Pcss(SizeFilter):
    """Percentage closer soft shadows: the mean depth of what blocks a receiver says how wide its filter is.

    The size of the light is its own, in world units; the disc that a receiver sees of it is projected into the map's plane, and the
    receiver's plane is followed. A guess, where `Exact()` knows: right for one straight edge parallel to the light.

    Parameters
    ----------
    blocker_taps, taps : int
        Texels that are searched, and bilinear comparisons of the filter; 8 to 64.

    References
    ----------
    Fernando 2005, "Percentage-Closer Soft Shadows", SIGGRAPH sketches.
    """

    blocker_taps: int = setting(whole(8, MAX_TAPS), 16, help=f"texels that are searched, 8 to {MAX_TAPS}")
    taps: int = setting(whole(8, MAX_TAPS), 32, help=f"comparisons, 8 to {MAX_TAPS}")

    spelling = "pcss"
    needs = Needs.COMPARISON
    snippet = "filter/pcss.glsl"
    summary = "mean over TAPS comparisons in a disc as wide as what blocks in BLOCKER_TAPS texels suggests"
    source = "Fernando 2005"
    fails = "layers of blockers: one width for all; light where near and far ones overlap; rings where taps are few; 32 texels at most"

    @property
    def reads_depths(self) -> bool:
        """Of what blocks."""
        return True

    @property
    def slack_texels(self) -> float:
        """One texel: each tap is bilinear."""
        return 1.0

    @property
    def reach_texels(self) -> float:
        """As far as the widest filter reads."""
        return MOST_TEXELS + 1.0

    def defines(self) -> Mapping[str, int | str]:
        """Taps and radius."""
        return {"GLS_PCSS_BLOCKERS": self.blocker_taps, "GLS_PCSS_TAPS": self.taps, "GLS_PCSS_MOST": str(MOST_TEXELS)}

    @classmethod
    def soft(cls) -> tuple[Self, ...]:
        """Few taps, and many."""
        return (cls(), cls(32, 64))
