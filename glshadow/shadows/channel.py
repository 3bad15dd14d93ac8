"""Channel: one light's part of a texture that several lights share."""

from __future__ import annotations

from dataclasses import dataclass

CHANNELS = 4


@dataclass(frozen=True)
class Channel:
    """One channel of a texture, and one range of its depth buffer.

    Parameters
    ----------
    number, count : int
        Index of the channel, and number of channels.
    pack : int
        Lights with the same number share a texture.
    """

    number: int
    count: int
    pack: int

    @property
    def depth_range(self) -> tuple[float, float]:
        """(first, size) of its range of the depth buffer. The first light's range is farthest, so that later ranges are drawn in front."""
        return (self.count - 1 - self.number) / self.count, 1.0 / self.count

    @property
    def mask(self) -> tuple[bool, bool, bool, bool]:
        """Colour mask of the channel."""
        red, green, blue, alpha = (self.number == i for i in range(CHANNELS))
        return red, green, blue, alpha
