"""Perceived difference between two images: FLIP, which models an observer who flips between them."""

# No postponed annotations: those of a NamedTuple are resolved in the module that documents it.
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from glshadow.core.setting import number, refuse
from glshadow.errors import GlshadowError, SettingsError

Floats = NDArray[np.float32]

MOST_PIXELS_PER_DEGREE = 1000.0  # the filters' widths grow with it
PIXELS_PER_DEGREE = 67.0206  # the paper's observer: 0.7 m from a display 0.7 m wide with 3840 pixels


class Pictured(Protocol):
    """The attribute of a rendered frame that `flip` uses."""

    @property
    def image(self) -> NDArray[np.uint8]: ...  # (H, W, 3) sRGB


class Flip(NamedTuple):
    """`mean` over the image, and `map` (H, W) float32; 0: looks the same, 1: the largest possible difference."""

    mean: float
    map: Floats


def flip(
    ours: Pictured | NDArray[np.uint8],
    reference: Pictured | NDArray[np.uint8],
    pixels_per_degree: float = PIXELS_PER_DEGREE,
) -> Flip:
    """Perceived difference between two images of the same size.

    `measure` counts pixels with wrong visibility; this measures how much of the difference an observer notices.

    Parameters
    ----------
    ours, reference : Frame, or (H, W, 3) uint8
        sRGB. An image from another program can be given as an array.
    pixels_per_degree : float
        Pixels of the image per degree of the observer's view, in (0, 1000].

    Raises
    ------
    SettingsError
        If an image is not 8-bit, or the sizes differ.
    GlshadowError
        If flip-evaluator is not installed.

    References
    ----------
    Andersson et al. 2020, "FLIP: A Difference Evaluator for Alternating Images", HPG; by its authors' flip-evaluator.
    """
    evaluate = _evaluator()
    images = _pixels(ours, "ours"), _pixels(reference, "reference")
    if images[0].shape != images[1].shape:
        shapes = " and ".join(f"{image.shape[1]} x {image.shape[0]}" for image in images)
        raise SettingsError(f"images must have the same size, got {shapes}")
    pixels_per_degree = number(0.0, MOST_PIXELS_PER_DEGREE, above=True)("pixels_per_degree", pixels_per_degree)
    test, truth = (image.astype(np.float32) / np.float32(255.0) for image in images)
    found, _, _ = evaluate(truth, test, "LDR", applyMagma=False, parameters={"ppd": pixels_per_degree})
    error: Floats = np.asarray(found, dtype=np.float32)[..., 0]
    return Flip(float(error.mean(dtype=np.float64)), error)


def _evaluator() -> Any:
    try:
        from flip_evaluator import evaluate
    except ImportError as error:
        raise GlshadowError(f"FLIP needs flip-evaluator ({error}): pip install 'glshadow[study]'") from error
    return evaluate


def _pixels(picture: Pictured | NDArray[np.uint8], name: str) -> NDArray[np.uint8]:
    image = picture if isinstance(picture, np.ndarray) else getattr(picture, "image", None)
    if not isinstance(image, np.ndarray) or np.ma.isMaskedArray(image):
        raise refuse(name, 'a Frame with the output "image" or an array (H, W, 3) of uint8', picture)
    if image.dtype != np.uint8 or image.ndim != 3 or image.shape[2] != 3 or image.size == 0:
        raise SettingsError(f"{name} must be (H, W, 3) uint8 in sRGB, got {image.shape} {image.dtype}")
    return image
