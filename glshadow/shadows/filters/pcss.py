"""Pcss: percentage closer soft shadows."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Self

from glshadow.core.setting import setting, whole
from glshadow.shadows.filters.filter import Needs, SizeFilter

MOST_TEXELS = 32.0
"""Largest radius of search and filter: how far the map must extend beyond what it was fitted to."""
MAX_TAPS = 64


@dataclass(frozen=True)
class Pcss(SizeFilter):
    """Percentage closer soft shadows: the mean blocker depth sets the width of the filter.

    The light's size is in world units; the disc that a receiver sees is projected into the map's plane, and the receiver's plane is
    followed. An approximation, correct for one straight edge parallel to the light; `Exact()` computes the real penumbra.

    Parameters
    ----------
    blocker_taps, taps : int
        Texels of the blocker search, and bilinear comparisons of the filter; 8 to 64.

    References
    ----------
    Fernando 2005, "Percentage-Closer Soft Shadows", SIGGRAPH sketches.
    """

    blocker_taps: int = setting(whole(8, MAX_TAPS), 16, help=f"texels of the blocker search, 8 to {MAX_TAPS}")
    taps: int = setting(whole(8, MAX_TAPS), 32, help=f"comparisons, 8 to {MAX_TAPS}")

    spelling = "pcss"
    needs = Needs.COMPARISON
    snippet = "filter/pcss.glsl"
    summary = "mean over TAPS comparisons in a disc whose width follows from BLOCKER_TAPS texels of blocker search"
    source = "Fernando 2005"
    fails = "one width for several layers of blockers; light leaks where near and far ones overlap; rings with few taps; 32 texels at most"

    @property
    def reads_depths(self) -> bool:
        """Always true: the search reads the depths of blockers."""
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
        """Defines for taps and radius."""
        return {"GLS_PCSS_BLOCKERS": self.blocker_taps, "GLS_PCSS_TAPS": self.taps, "GLS_PCSS_MOST": str(MOST_TEXELS)}

    @classmethod
    def soft(cls) -> tuple[Self, ...]:
        """Few taps, and many."""
        return (cls(), cls(32, 64))
