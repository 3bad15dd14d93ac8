"""Run lengths of masks: examples by hand, those of pycocotools 2.0, and masks that come back."""

from __future__ import annotations

import numpy as np
import pytest

from glshadow.core.spaces import Bools
from glshadow.training.runs import as_text, from_text, mask_of, run_lengths

HAND = np.array([[0, 1, 1], [0, 1, 0]], dtype=bool)
"""Down the columns: 0 0, 1 1, 1 0."""


@pytest.mark.parametrize(
    ("mask", "lengths", "text"),
    [
        (HAND, [2, 3, 1], "231"),
        (np.ones((3, 2), dtype=bool), [0, 6], "06"),
        (np.zeros((3, 2), dtype=bool), [6], "6"),
        (np.array([[1, 0, 1, 1]], dtype=bool), [0, 1, 1, 2], "0111"),
        (np.repeat([[False, True]], 40, axis=0), [40, 40], "X1X1"),
    ],
    ids=["hand", "full", "empty", "row", "halves"],
)
def test_run_lengths_by_hand(mask: Bools, lengths: list[int], text: str) -> None:
    assert run_lengths(mask) == lengths
    assert as_text(lengths) == text
    assert from_text(text) == lengths
    np.testing.assert_array_equal(mask_of(lengths, mask.shape), mask)


def test_text_is_that_of_pycocotools() -> None:
    """Of a disc and of stripes: the beginning and the length of what pycocotools 2.0 encodes."""
    y, x = np.mgrid[:200, :300]
    disc = as_text(run_lengths(np.hypot(x - 150, y - 90) < 80))
    assert disc.startswith(
        "Vn=i0Z5:G8I6J6J6K4L4L4L4L4L4M2M4M2N2M4M2N2N2M4M2N2N2N2N2O0O2N2N2N2O0O2N2N2O0O2N2O0O2O0O2O0O2O0O"
    )
    assert len(disc) == 325
    stripes = as_text(run_lengths(np.arange(40 * 50).reshape(40, 50) % 37 < 15))
    assert stripes.startswith(
        "021O1000000000O10O10000000O1000O10000000O10O1000000000O10O1000000000O10O10000000O10O10000000"
    )
    assert len(stripes) == 1404


def test_random_masks_come_back(rng: np.random.Generator) -> None:
    for _ in range(100):
        mask = rng.random(rng.integers(1, 40, 2)) < rng.random()
        lengths = run_lengths(mask)
        assert sum(lengths) == mask.size
        assert sum(lengths[1::2]) == mask.sum()
        assert from_text(as_text(lengths)) == lengths
        np.testing.assert_array_equal(mask_of(lengths, mask.shape), mask)
