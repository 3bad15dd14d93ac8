"""Cropped: a rectangle of pixels of another camera's image, as a camera."""

from __future__ import annotations

from dataclasses import dataclass, field

from glshadow.core.camera import Camera, Window
from glshadow.core.spaces import Triple


@dataclass(frozen=True)
class Cropped(Camera):
    """The same rays as those of a part of a camera's image.

    Parameters
    ----------
    whole : Camera
    whole_size : (2,) ints
        Pixels of its image.
    corner : (2,) ints
        First column from the left and first row from below.
    """

    whole: Camera
    whole_size: tuple[int, int]
    corner: tuple[int, int]
    position: Triple = field(init=False)
    target: Triple = field(init=False)
    up: Triple = field(init=False)
    near: float | None = field(init=False)
    far: float | None = field(init=False)

    def __post_init__(self) -> None:
        for name in ("position", "target", "up", "near", "far", "is_perspective", "view_from_world"):
            object.__setattr__(self, name, getattr(self.whole, name))

    def window(self, size: tuple[int, int]) -> Window:
        """Edges of the part, which has `size` pixels."""
        left, right, bottom, top = self.whole.window(self.whole_size)
        columns, rows = self.whole_size
        (x, y), (width, height) = self.corner, size

        def between(low: float, high: float, step: int, steps: int) -> float:
            return high if step == steps else low + (high - low) * (step / steps)

        return (between(left, right, x, columns), between(left, right, x + width, columns),
                between(bottom, top, y, rows), between(bottom, top, y + height, rows))  # fmt: skip
