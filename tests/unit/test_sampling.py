"""Positions of samples in a pixel."""

from __future__ import annotations

import numpy as np
import pytest

from glshadow.core.sampling import IMAGE_SAMPLES, SAMPLES, grid, offsets, traced
from glshadow.errors import SettingsError


@pytest.mark.parametrize("samples", [*SAMPLES, 9, 36, 256])
def test_samples_are_a_grid_around_the_centre(samples: int) -> None:
    columns, rows = grid(samples)
    assert columns * rows == samples
    places = offsets(samples)
    assert places.shape == (samples, 2)
    np.testing.assert_allclose(places.mean(axis=0), 0.5, atol=1e-12)
    for axis, lines in enumerate((columns, rows)):
        line = places[:, axis] * lines
        np.testing.assert_array_equal(np.bincount(line.astype(int), minlength=lines), samples // lines)
        np.testing.assert_allclose(line % 1.0, 0.5, atol=1e-12)
    assert len({tuple(place) for place in places.tolist()}) == samples
    # row by row from below, like the samples of a block
    np.testing.assert_array_equal(np.lexsort((places[:, 0], places[:, 1])), np.arange(samples))


def test_one_sample_is_the_centre() -> None:
    np.testing.assert_array_equal(offsets(1), [[0.5, 0.5]])


@pytest.mark.parametrize("samples", [0, 2, 3, 5, 32, -4, True, None, "4", 4.5])
def test_bad_sample_counts_are_refused(samples: object) -> None:
    with pytest.raises(SettingsError, match="samples must be one of 1, 4, 8, 16, got"):
        IMAGE_SAMPLES("samples", samples)
    with pytest.raises(SettingsError, match="samples must be"):
        traced("samples", samples)


def test_reference_may_have_any_square_number() -> None:
    assert [traced("samples", n) for n in (1, 4, 8, 9, 16, 256)] == [1, 4, 8, 9, 16, 256]
