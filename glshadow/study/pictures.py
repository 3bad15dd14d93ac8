"""Images of a setting: reference, rendered and error in full, and enlarged where the error is greatest."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from glshadow.frame import Frame
from glshadow.reference.truth import Truth
from glshadow.renderer import Renderer
from glshadow.scoring.error import Measurement
from glshadow.scoring.score import Outcome
from glshadow.triptych import GAP, triptych

Image = NDArray[np.uint8]

REGIONS = 2
REGION_SHARE = 0.06  # share of the image's width and height: the side of a region
# Weight of a pixel in the search for regions: artefacts weigh more than errors due to resolution.
WEIGHTS = {Outcome.GRAIN: 1, Outcome.EDGE: 4, Outcome.ACNE: 8, Outcome.LEAK: 8}


@dataclass(frozen=True)
class Region:
    """A rectangle of the image in pixels; `wrong` and `grainy` count its pixels of these kinds."""

    x: int
    y: int
    width: int
    height: int
    wrong: int
    grainy: int

    def cut(self, image: Image) -> Image:
        """The part of an image (H, W, 3)."""
        return image[self.y : self.y + self.height, self.x : self.x + self.width]


@dataclass(frozen=True, eq=False)
class Panel:
    """One setting's images (H, W, 3), shaded by its light alone, and its worst regions, the worst first."""

    truth: Image = field(repr=False)
    ours: Image = field(repr=False)
    error: Image = field(repr=False)
    regions: tuple[Region, ...]


def panel(renderer: Renderer, frame: Frame, truth: Truth, error: Measurement) -> Panel:
    """Images of a frame with one light."""
    width = frame.size[0]
    whole = triptych(renderer, frame, truth, error)
    truth_image, ours, error_image = (whole[:, k * (width + GAP) : k * (width + GAP) + width] for k in range(3))
    return Panel(truth_image, ours, error_image, worst_regions(error.kinds[0]))


def worst_regions(kinds: NDArray[np.uint8], count: int = REGIONS) -> tuple[Region, ...]:
    """The rectangles with the most error, without overlap; fewer if there is no more error.

    Parameters
    ----------
    kinds : (H, W) uint8
        Kinds of pixels, as of Measurement.
    """
    weight = np.zeros(kinds.shape, dtype=np.int64)
    for kind, value in WEIGHTS.items():
        weight[kinds == kind] = value
    height, width = (max(1, min(n, round(REGION_SHARE * n))) for n in kinds.shape)
    regions: list[Region] = []
    for _ in range(count):
        sums = np.pad(weight.cumsum(axis=0).cumsum(axis=1), ((1, 0), (1, 0)))
        boxes = sums[height:, width:] - sums[:-height, width:] - sums[height:, :-width] + sums[:-height, :-width]
        y, x = (int(n) for n in np.unravel_index(boxes.argmax(), boxes.shape))
        if boxes[y, x] == 0:
            break
        inside = kinds[y : y + height, x : x + width]
        wrong, grainy = int((inside >= Outcome.EDGE).sum()), int((inside == Outcome.GRAIN).sum())
        regions.append(Region(x, y, width, height, wrong, grainy))
        weight[y : y + height, x : x + width] = 0
        # a window that overlaps this one slightly would show it again
        weight[max(0, y - height // 2) : y + height + height // 2, max(0, x - width // 2) : x + width + width // 2] = 0
    return tuple(regions)
