"""The outdoor look's sky: its colours by elevation, and images over it against a transparent background's."""

from __future__ import annotations

import numpy as np

import glshadow as gs
from glshadow.core.srgb import linear_from_srgb, srgb_from_linear
from glshadow.derive.backdrop import PALE, backdrop, over

SKY = ((0.9, 0.9, 0.9), (0.2, 0.4, 0.8))


def test_colours_by_elevation() -> None:
    low, high = linear_from_srgb(SKY[0]), linear_from_srgb(SKY[1])
    up = gs.PerspectiveCamera((0, 0, 0), (0, 1, 0), (0, 0, 1))
    # at the zenith exp(-1 / PALE) of the horizon is left
    np.testing.assert_allclose(backdrop(SKY, up, (1, 1))[0, 0], high + np.exp(-1 / PALE) * (low - high), rtol=1e-12)
    level = gs.PerspectiveCamera((5, 1e7, 3), (6, 1e7, 3), fov_y=90)
    column = backdrop(SKY, level, (1, 4))[:, 0]
    np.testing.assert_array_equal(column[2:], [low, low])
    heights = np.array([0.75, 0.25]) / np.hypot(1, [0.75, 0.25])
    np.testing.assert_allclose(column[:2], high + np.exp(-heights / PALE)[:, None] * (low - high), rtol=1e-12)
    flat = backdrop(SKY, gs.OrthographicCamera((0, 0, 5), (0, 0, 0), height=2.0), (3, 2))
    np.testing.assert_array_equal(flat, np.broadcast_to(low, (2, 3, 3)))


def test_opaque_pixels_keep_their_values_and_others_are_mixed_in_linear_light() -> None:
    image = np.array([[[10, 20, 250, 255], [200, 100, 50, 0], [200, 100, 50, 51]]], dtype=np.uint8)
    behind = np.full((1, 3, 3), 0.25)
    result = over(image, behind)[0]
    assert result[0].tolist() == [10, 20, 250]
    assert result[1].tolist() == [137, 137, 137]
    mixed = 0.2 * linear_from_srgb(image[0, 2, :3] / 255) + 0.8 * 0.25
    np.testing.assert_array_equal(result[2], np.rint(255 * srgb_from_linear(mixed)))


def test_outdoor_images_have_the_sky_unless_a_background_is_given(renderer: gs.Renderer) -> None:
    ball = gs.Points([[0, 0, 0]], radius=1.0)
    scene = gs.load([gs.Node(ball)], look="outdoor")
    outputs = ("image", "linear", "alpha")
    frame = renderer.render(scene, size=(64, 36), outputs=outputs)
    clear = renderer.render(scene, size=(64, 36), outputs=outputs, background=None)
    sky = backdrop(scene.defaults.sky, scene.camera, (64, 36))  # type: ignore[arg-type]
    assert frame.image.shape == frame.linear.shape == (36, 64, 3)
    open_ = frame.alpha == 0
    np.testing.assert_allclose(frame.linear[open_], sky[open_], rtol=1e-6)
    np.testing.assert_array_equal(frame.image[open_], np.rint(255 * srgb_from_linear(sky[open_])))
    np.testing.assert_array_equal(frame.image[frame.alpha == 1], clear.image[frame.alpha == 1][:, :3])
    np.testing.assert_allclose(frame.linear, clear.linear[..., :3] + (1 - clear.linear[..., 3:]) * sky, rtol=1e-5)
    given = renderer.render(scene, size=(64, 36), background=(0.2, 0.4, 0.6), outputs="image")
    np.testing.assert_array_equal(given.image[0, 0], [51, 102, 153])
    assert frame.image[0, 32, 2] > frame.image[0, 32, 0] + 20  # blue above
