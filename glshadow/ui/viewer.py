"""Viewer: draws the current state of an interactive view, and its errors when nothing moves."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from types import TracebackType
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from numpy.typing import NDArray

from glshadow.frame import Frame
from glshadow.gl.driver.context import Backend
from glshadow.lights import traced_points
from glshadow.overlay import overlay, required_outputs
from glshadow.reference.trace import trace
from glshadow.reference.truth import Truth
from glshadow.renderer import Renderer
from glshadow.scoring.error import Measurement, measure
from glshadow.scoring.score import COLORS, Outcome
from glshadow.ui.showing import Showing

if TYPE_CHECKING:
    import moderngl

PAINTED = (Outcome.GRAIN, Outcome.EDGE, Outcome.ACNE, Outcome.LEAK)
OPACITY = 0.85
SMALLEST = 16  # pixels along a side


@dataclass(frozen=True, eq=False)
class View:
    """An image that was drawn.

    Attributes
    ----------
    image : (H, W, 3) uint8
    frame : Frame
    error : Measurement, optional
        If it was requested.
    ms : float
        Time of drawing, without the reference.
    """

    image: NDArray[np.uint8] = field(repr=False)
    frame: Frame = field(repr=False)
    error: Measurement | None = field(repr=False)
    ms: float

    @property
    def facts(self) -> str:
        """What was used, its time and its error, on one line."""
        used = self.frame.used
        kinds = dict.fromkeys(
            f"{each.filter}{f' at {each.views[0].resolution}' if each.views else ''}" for each in used if each.filter
        )
        words = [" + ".join(kinds) or "no shadow", f"{self.ms:.1f} ms"]
        if self.error is not None:
            words.append(f"wrong {self.error.wrong:.3%}, grain {self.error.grain:.3%}")
        return ", ".join(words)


TRACING = "tracing rays: a few seconds"


class Viewer:
    """A renderer, and the reference of the last view."""

    def __init__(self, backend: Backend = "auto", context: moderngl.Context | None = None) -> None:
        self.renderer = Renderer(backend, context)
        self._truth: tuple[Any, Truth] | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self.release()

    def release(self) -> None:
        """Release the renderer."""
        self.renderer.release()

    def draw(self, showing: Showing, size: tuple[int, int], moving: bool = False) -> View:
        """Draw an image. While things move: at half the size, with one sample and no error, scaled up.

        Raises
        ------
        GlshadowError
            As for `Renderer.render` and `trace`.
        """
        width, height = size
        small = (max(width // 2, SMALLEST), max(height // 2, SMALLEST)) if moving else size
        measured = showing.error and not moving
        outputs = {"image", *required_outputs(showing.overlays)} | ({"visibility", "triangle"} if measured else set())
        samples = 1 if moving else showing.samples
        start = time.perf_counter()
        frame = self.renderer.render(
            showing.scene, showing.camera, showing.shadowed, small, outputs=tuple(sorted(outputs)), samples=samples
        )
        ms = 1e3 * (time.perf_counter() - start)
        image = overlay(frame, showing.overlays) if showing.overlays else frame.image
        error = self._measured(showing, frame) if measured else None
        if error is not None:
            image = painted(image, error)
        if small != size:
            rows, columns = (np.arange(n) * m // n for n, m in zip((height, width), (small[1], small[0]), strict=True))
            image = image[np.ix_(rows, columns)]
        return View(image, frame, error, ms)

    def _measured(self, showing: Showing, frame: Frame) -> Measurement | None:
        casting = [light for light in frame.lights if light.shadow is not None]
        if not casting:
            return None
        bare = tuple((replace(light, shadow=None), light.shadow is None) for light in frame.lights)
        key = (showing.scene, showing.camera, bare, frame.size, frame.samples)
        if self._truth is None or not _same(self._truth[0], key):
            surface = frame.triangle if frame.samples == 1 else None
            points = traced_points(casting)
            self._truth = (
                key,
                trace(showing.scene, showing.camera, frame.lights, frame.size, frame.samples, points, surface),
            )
        return measure(frame, self._truth[1])


def _same(one: Sequence[Any], other: Sequence[Any]) -> bool:
    return one[0] is other[0] and one[1:] == other[1:]


def painted(image: NDArray[np.uint8], error: Measurement) -> NDArray[np.uint8]:
    """An image with its wrong pixels in the colours of `Measurement.picture`; with several lights, the worst kind per pixel."""
    kinds = error.kinds.max(axis=0)
    result = image.astype(np.float32)
    for kind in PAINTED:
        where = kinds == kind
        result[where] += OPACITY * (np.asarray(COLORS[kind], dtype=np.float32) - result[where])
    return np.asarray(np.rint(result), dtype=np.uint8)
