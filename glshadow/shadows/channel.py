"""Channel: which part of a texture that several lights share is a light's own."""

from __future__ import annotations

from dataclasses import dataclass

CHANNELS = 4


@dataclass(frozen=True)
class Channel:
    """One of a texture's channels, and one of as many ranges of its depth buffer.

    Parameters
    ----------
    number, count : int
        Which of how many.
    pack : int
        Lights of the same one share a texture.
    """

    number: int
    count: int
    pack: int

    @property
    def depth_range(self) -> tuple[float, float]:
        """(first, size) of its share of the depth buffer: the first light's lies farthest, so that the next ones are drawn before it."""
        return (self.count - 1 - self.number) / self.count, 1.0 / self.count

    @property
    def mask(self) -> tuple[bool, bool, bool, bool]:
        """The colours that it writes."""
        red, green, blue, alpha = (self.number == i for i in range(CHANNELS))
        return red, green, blue, alpha
