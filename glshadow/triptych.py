"""reference | image | error side by side: the same shading with traced and rendered visibility, and where they differ."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from glshadow.derive.look import BACKGROUND, Ambient, look_of

if TYPE_CHECKING:
    from glshadow.frame import Frame
    from glshadow.reference.truth import Truth
    from glshadow.renderer import Renderer
    from glshadow.scoring.error import Measurement

GAP, GAP_COLOR = 4, (255, 255, 255)  # pixels between the images


def triptych(
    renderer: Renderer,
    frame: Frame,
    truth: Truth,
    error: Measurement,
    ambient: Ambient | None = None,
    background: ArrayLike | None = BACKGROUND,
) -> NDArray[np.uint8]:
    """Three images side by side, in one row per light, shaded by that light alone.

    Parameters
    ----------
    renderer : Renderer
        Renders each light without its shadow.
    frame, truth, error
        The measured frame, the reference and the error; `frame` needs its visibility.
    ambient, background
        As for Renderer.render. The light is exposed by its default, and not tone mapped.

    Returns
    -------
    (L H + (L - 1) GAP, 3 W + 2 GAP, 3) uint8
    """
    if background is None:  # an error image is not composited over another image
        background = BACKGROUND
    rows = []
    for number, light in enumerate(frame.lights):
        bare = replace(light, shadow=None)
        shown, dark = (
            renderer.render(
                frame.scene, frame.camera, [bare], frame.size, level, background, outputs=("linear", "alpha"), samples=1
            )
            for level in (ambient, 0.0)
        )
        look = replace(look_of(0.0, background, 1), scale=2.0**shown.exposure)
        strength = 0.0 if light.shadow is None else light.shadow.strength
        shaded = []
        for visibility in (truth.visibility[number], frame.visibility[number]):
            taken = strength * (1.0 - np.nan_to_num(visibility, nan=1.0).astype(np.float64))
            light = shown.linear - dark.linear * taken[..., None]
            shaded.append(look.encoded(np.concatenate([light, shown.alpha[..., None]], axis=2)))
        rows.append(_beside([*shaded, error.picture(number)], axis=1))
    return _beside(rows, axis=0)


def _beside(pictures: list[NDArray[np.uint8]], axis: int) -> NDArray[np.uint8]:
    shape = list(pictures[0].shape)
    shape[axis] = GAP
    gap = np.broadcast_to(np.array(GAP_COLOR, dtype=np.uint8), shape)
    parts = [part for picture in pictures for part in (gap, picture)][1:]
    return np.concatenate(parts, axis=axis)
