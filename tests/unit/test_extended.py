"""Colours under alpha 0: those of the nearest texels that are seen."""

from __future__ import annotations

import numpy as np
import pytest

from glshadow.gl.scene.extended import extended


@pytest.mark.parametrize("shape", [(1, 1), (1, 7), (5, 3), (16, 16), (33, 50)])
@pytest.mark.parametrize("share", [0.05, 0.5])
def test_one_colour_fills_all_and_nothing_else_changes(shape: tuple[int, int], share: float) -> None:
    rng = np.random.default_rng(shape[0])
    pixels = rng.integers(0, 256, (*shape, 4), dtype=np.uint8)
    pixels[..., 3] = np.where(rng.random(shape) < share, np.maximum(pixels[..., 3], 1), 0)
    pixels[-1, 0, 3] = 200
    seen = pixels[..., 3] > 0
    pixels[seen, :3] = (60, 200, 30)
    before = pixels.copy()
    result = extended(pixels)
    assert np.array_equal(pixels, before)
    assert np.array_equal(result[..., 3], pixels[..., 3])
    assert (result[..., :3] == (60, 200, 30)).all()


def test_mean_of_the_smallest_block() -> None:
    pixels = np.zeros((4, 4, 4), dtype=np.uint8)
    pixels[0, 0], pixels[1, 1], pixels[3, 3] = (10, 0, 0, 255), (20, 0, 0, 1), (90, 0, 0, 255)
    red = extended(pixels)[..., 0]
    assert np.array_equal(red, [[10, 15, 40, 40], [15, 20, 40, 40], [40, 40, 90, 90], [40, 40, 90, 90]])


@pytest.mark.parametrize("alpha", [0, 1, 255])
def test_nothing_or_all_to_fill_keeps_the_array(alpha: int) -> None:
    pixels = np.full((3, 5, 4), alpha, dtype=np.uint8)
    assert extended(pixels) is pixels
