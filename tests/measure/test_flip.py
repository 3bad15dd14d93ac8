"""FLIP of whole images."""

from __future__ import annotations

import sys
from types import SimpleNamespace

import numpy as np
import pytest
from numpy.typing import NDArray

import glshadow as gs


@pytest.fixture
def picture(rng: np.random.Generator) -> NDArray[np.uint8]:
    """Soft blobs of colour."""
    coarse = rng.integers(0, 256, (6, 8, 3))
    return np.kron(coarse, np.ones((8, 8, 1))).astype(np.uint8)


def test_equal_images_have_no_difference(picture: NDArray[np.uint8]) -> None:
    found = gs.flip(picture, picture.copy())
    assert found.mean == 0.0
    assert found.map.shape == picture.shape[:2]
    assert found.map.dtype == np.float32
    assert not found.map.any()


def test_black_on_white_is_the_largest_difference() -> None:
    black, white = (np.full((32, 32, 3), value, dtype=np.uint8) for value in (0, 255))
    mean, where = gs.flip(black, white)
    assert mean == pytest.approx(where.mean(), rel=1e-6)
    # The paper's measure reaches 1 only for complementary hues; black on white is its largest step in lightness.
    assert 0.9 < mean <= 1.0


def test_map_shows_the_place_and_size_of_the_difference(picture: NDArray[np.uint8]) -> None:
    means = []
    for step in (8, 32):
        other = picture.copy()
        patch = other[20:28, 30:38]
        patch[...] = np.where(patch > 127, patch - step, patch + step)
        mean, where = gs.flip(other, picture)
        row, column = np.unravel_index(where.argmax(), where.shape)
        assert 18 <= row < 30
        assert 28 <= column < 40
        assert not where[:5, :5].any()  # far beyond the filters' reach of a few pixels
        means.append(mean)
    assert 0.0 < means[0] < means[1]


def test_larger_viewing_distance_lowers_the_difference(picture: NDArray[np.uint8]) -> None:
    other = picture.copy()
    other[24, 32] = 255 - other[24, 32]
    near, far = (gs.flip(other, picture, ppd).map.max() for ppd in (20.0, 120.0))
    assert far < near


def test_frames_are_compared_by_their_image(picture: NDArray[np.uint8]) -> None:
    frame = SimpleNamespace(image=picture)
    assert gs.flip(frame, picture).mean == 0.0


def test_incomparable_images_are_refused(picture: NDArray[np.uint8]) -> None:
    with pytest.raises(gs.SettingsError, match="the same size"):
        gs.flip(picture, picture[:-1])
    with pytest.raises(gs.SettingsError, match=r"reference must be \(H, W, 3\) uint8"):
        gs.flip(picture, picture.astype(np.float32))
    with pytest.raises(gs.SettingsError, match='ours must be a Frame with the output "image"'):
        gs.flip(SimpleNamespace(image=None), picture)
    with pytest.raises(gs.SettingsError, match="pixels_per_degree"):
        gs.flip(picture, picture, 0.0)


def test_missing_package_names_what_to_install(picture: NDArray[np.uint8], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "flip_evaluator", None)
    with pytest.raises(gs.GlshadowError, match=r"pip install 'glshadow\[study\]'"):
        gs.flip(picture, picture)
