"""Score: the error of one light as numbers, and the classification of pixels."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum


class Outcome(IntEnum):
    """Classification of a pixel."""

    NO_SURFACE = 0
    NOT_COUNTED = 1
    GOOD = 2
    GRAIN = 3
    EDGE = 4
    ACNE = 5
    LEAK = 6


COLORS = {
    Outcome.NO_SURFACE: (0, 0, 0),
    Outcome.NOT_COUNTED: (40, 110, 60),
    Outcome.GRAIN: (255, 140, 0),
    Outcome.EDGE: (255, 225, 0),
    Outcome.ACNE: (230, 30, 30),
    Outcome.LEAK: (40, 80, 255),
}
LIT, DARK = 190, 80  # grey of correct pixels


@dataclass(frozen=True)
class Score:
    """Errors of one light, or of all, as fractions of the counted pixels; NaN if no pixel is counted.

    Attributes
    ----------
    mean : float
        Mean |visibility - reference|.
    wrong : float
        |visibility - reference| > 0.5: the sum of `edge`, `leak`, and the wrong pixels of `acne`.
    edge : float
        Wrong within (filter radius + 1/2) sqrt(2) texels of the true boundary: limited by the resolution.
    acne, leak : float
        Wrong elsewhere: lit but rendered dark, dark but rendered lit. Artefacts. Under a light without size, `acne` also includes lit
        pixels that are darker by more than 1/16 beyond (filter radius + 1) sqrt(2) texels of the true boundary and of anything that stands
        on the surface: the surface shadows itself in part of the kernel.
    grain : float
        |visibility - reference| > 1/16 beyond (filter radius + 1) sqrt(2) texels of the true boundary, including that acne.
    contact : float
        The part of `leak` within two texels of something that stands on the surface.
    counted : float
        Counted pixels as a fraction of those that see a surface.
    all_wrong, all_mean : float
        `wrong` and `mean` over all pixels that see a surface.
    p95 : float
        95th percentile of |visibility - reference|.
    penumbra : float
        `mean` over the pixels that see a part of a light that has a size; 0 if there are none.
    window : float
        Mean over the counted pixels of |mean of visibility - reference over the counted pixels of their 8 x 8 window|: errors that
        do not cancel between neighbours. Lost shadows that are thinner than a pixel show here.
    """

    mean: float
    wrong: float
    edge: float
    acne: float
    leak: float
    grain: float
    contact: float
    counted: float
    all_wrong: float
    all_mean: float
    p95: float
    penumbra: float
    window: float

    def __str__(self) -> str:
        parts = ", ".join(f"{name} {getattr(self, name):.4%}" for name in ("edge", "acne", "leak"))
        return (
            f"wrong {self.wrong:.4%} ({parts}; contact {self.contact:.4%}), grain {self.grain:.4%}, "
            f"mean {self.mean:.5f}, over windows {self.window:.5f}, of the counted {self.counted:.1%} of the surface; "
            f"of all of it wrong {self.all_wrong:.4%}, mean {self.all_mean:.5f}"
            + (f"; penumbra mean {self.penumbra:.5f}, 95 % within {self.p95:.5f}" if self.penumbra else "")
        )
