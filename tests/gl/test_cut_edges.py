"""Edges of what alpha cuts out of a texture: the colour stored under alpha 0 is nowhere in the image, magnified or minified."""

from __future__ import annotations

import numpy as np
import pytest

import glshadow as gs
from glshadow.scenes import shapes

SIZE = (64, 64)
FRONT = gs.OrthographicCamera((0.0, 0.0, 5.0), (0.0, 0.0, 0.0), height=2.0)
LEAF = (60, 200, 60)
PACKED = 3e-3  # of emission, whose mantissa has 9 bits


def leaf(under: tuple[int, int, int], mode: gs.AlphaMode, repeats: float, cutoff: float = 0.5) -> gs.Mesh:
    side = np.arange(32) - 15.5
    inside = np.hypot(side, side[:, None]) < 12.0
    pixels = np.zeros((32, 32, 4), dtype=np.uint8)
    pixels[...] = (*under, 0)
    pixels[inside] = (*LEAF, 255)
    uv = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], dtype=np.float32) * np.float32(repeats)
    material = gs.Material(texture=pixels, alpha_mode=mode, cutoff=cutoff, unlit=True)
    return gs.Mesh(*shapes.rectangle((-1, -1, 0), (2, 0, 0), (0, 2, 0)), uv=uv, material=material)


def drawn(renderer: gs.Renderer, mesh: gs.Mesh) -> gs.Frame:
    # over a background of the leaf's own colour nothing else is seen
    background = np.array(LEAF) / 255.0
    return renderer.render(
        gs.Scene([mesh]), FRONT, [], SIZE, background=background, samples=4, outputs=("linear", "alpha")
    )


@pytest.mark.parametrize("repeats", [0.9, 7.3, 60.0])
@pytest.mark.parametrize("mode", [gs.AlphaMode.MASK, gs.AlphaMode.BLEND])
def test_no_halo(renderer: gs.Renderer, mode: gs.AlphaMode, repeats: float) -> None:
    black, white = (drawn(renderer, leaf(under, mode, repeats)) for under in ((0, 0, 0), (255, 255, 255)))
    assert 0.2 < black.alpha.mean() < 0.8
    assert np.array_equal(black.linear, white.linear)
    assert np.array_equal(black.alpha, white.alpha)
    leaf_alone = np.broadcast_to(black.linear[np.unravel_index(black.alpha.argmax(), SIZE[::-1])], black.linear.shape)
    np.testing.assert_allclose(black.linear, leaf_alone, atol=PACKED)


@pytest.mark.parametrize("mode", [gs.AlphaMode.OPAQUE, gs.AlphaMode.MASK])
def test_colour_under_alpha_0_is_shown_where_nothing_is_cut(renderer: gs.Renderer, mode: gs.AlphaMode) -> None:
    frame = drawn(renderer, leaf((255, 255, 255), mode, 1.0, cutoff=0.0))
    np.testing.assert_allclose(frame.linear[1, 1], 1.0, atol=PACKED)
