"""Textures larger than the driver's limit: scaled down in linear light, with a warning, and drawn."""

import numpy as np
import pytest

import glshadow as gs
from glshadow.core.srgb import linear_from_srgb, srgb_from_linear
from glshadow.errors import GlshadowWarning
from glshadow.gl.scene.shrunk import halved, shrunk


@pytest.mark.parametrize("width", [2, 3, 4, 5, 7, 8, 31, 64, 129])
def test_halves_are_means_over_equal_widths(rng, width):
    """Against the integral of the stepwise constant image over each new column."""
    values = rng.uniform(0, 1, (2, width, 3))
    integral = np.concatenate([np.zeros((2, 1, 3)), np.cumsum(values, axis=1)], axis=1)
    edges = np.linspace(0, width, width // 2 + 1)
    at = np.minimum(edges.astype(int), width - 1)
    upto = integral[:, at] + (edges - at)[None, :, None] * values[:, at]
    # 1e-13: rounding of sums of up to 129 numbers
    np.testing.assert_allclose(halved(values), np.diff(upto, axis=1) * (width // 2) / width, atol=1e-13)


def test_halves_of_one_colour_keep_it_to_the_bit():
    """Each of the 256 levels, of odd and even sizes, over one and two halvings."""
    pixels = np.repeat(np.arange(256, dtype=np.uint8)[:, None, None], 13, axis=1).repeat(4, axis=2)
    for limit in (12, 6, 3, 1):
        narrow = shrunk(pixels[:limit], limit)
        np.testing.assert_array_equal(narrow, np.broadcast_to(pixels[:limit, :1], narrow.shape))
    for rows in range(0, 256, 8):
        block = pixels[rows : rows + 8]
        np.testing.assert_array_equal(shrunk(block, 8), np.broadcast_to(block[:, :1], (8, 6, 4)))


def test_light_is_averaged_and_not_bytes():
    """Black and white make half of the light, which is 188 of 255; alpha is linear."""
    pixels = np.zeros((1, 8, 4), dtype=np.uint8)
    pixels[:, ::2] = 255
    assert shrunk(pixels, 4).tolist() == [[[188, 188, 188, 128]] * 4]
    grey = np.array([64, 192], dtype=np.uint8)[np.arange(8) % 2, None].repeat(4, axis=1)[None]
    expected = round(float(255 * srgb_from_linear(linear_from_srgb(np.array([64, 192]) / 255).mean())))
    assert (expected, shrunk(grey, 4)[0, 0].tolist()) == (146, [146, 146, 146, 128])
    assert shrunk(pixels, 4, srgb=False).tolist() == [[[128] * 4] * 4]
    assert shrunk(pixels.swapaxes(0, 1), 4).tolist() == [[[188, 188, 188, 128]]] * 4


def test_small_images_are_the_same_object():
    pixels = np.zeros((4, 4, 4), dtype=np.uint8)
    assert shrunk(pixels, 4) is pixels


def test_both_sides(rng):
    pixels = rng.integers(0, 256, (20, 40, 4), dtype=np.uint8)
    found = shrunk(pixels, 10)
    assert found.shape == (10, 10, 4)
    linear = linear_from_srgb(pixels[..., :3] / 255.0).reshape(10, 2, 10, 4, 3).mean(axis=(1, 3))
    # one level for each of two roundings to bytes
    np.testing.assert_allclose(found[..., :3], 255 * srgb_from_linear(linear), atol=1.01)


@pytest.mark.slow
@pytest.mark.parametrize("turned", [False, True])
def test_wide_texture_is_drawn(turned):
    """Stripes a 16th wide, 32,768 texels in all: the colours at their middles."""
    colors = np.array([(255, 0, 0), (0, 255, 0), (0, 0, 255), (188, 188, 188)] * 4, dtype=np.uint8)
    pixels = np.full((2, 32_768, 4), 255, dtype=np.uint8)
    pixels[..., :3] = np.repeat(colors, 2048, axis=0)
    if turned:
        pixels = pixels.swapaxes(0, 1)[::-1]
    places = [[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]
    mesh = gs.Mesh(
        places, [[0, 1, 2], [0, 2, 3]], uv=[[0, 0], [1, 0], [1, 1], [0, 1]], material=gs.Material(texture=pixels)
    )
    with gs.Renderer() as renderer:
        limit = 16_384
        camera = gs.OrthographicCamera((0, 0, 5), (0, 0, 0), height=2.0)
        with pytest.warns(
            GlshadowWarning, match=f"a base colour texture of .* pixels is scaled down to .*at most {limit}"
        ):
            frame = renderer.render(gs.Scene([mesh]), camera, (), (64, 64), ambient=1.0, samples=1, outputs=("linear",))
    line = frame.linear[::-1, 32][2::4] if turned else frame.linear[32, 2::4]
    # 1e-2: a mip level, and 8 bits
    np.testing.assert_allclose(line / line.max(), linear_from_srgb(colors / 255.0), atol=1e-2)


def test_case(models):
    scene = gs.load(models.parent / "cases" / "meant" / "wide_texture.glb")
    assert scene.nodes[0].mesh.material.texture.shape[1] > 16_384
    with gs.Renderer() as renderer, pytest.warns(GlshadowWarning, match="scaled down"):
        frame = renderer.render(scene, size=(64, 64))
    assert frame.image.std() > 0
