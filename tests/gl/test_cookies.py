"""Cookies: the light that passes at each pixel, against float64 lookups into the image."""

from __future__ import annotations

import gc
from dataclasses import replace

import numpy as np
import pytest

import glshadow as gs
from glshadow.core.spaces import Array, project, view_axes
from glshadow.core.srgb import linear_from_srgb

SIZE = (200, 120)
SCENE = gs.scenes.courtyard()
CELLS = np.random.default_rng(2).integers(0, 256, (4, 6, 3)).astype(np.uint8)
IMAGE = np.kron(CELLS, np.ones((16, 16, 1), dtype=np.uint8))
LIGHTS: dict[str, gs.DirectionalLight | gs.SpotLight] = {
    "spot": gs.SpotLight(position=(6, 7, 6), direction=(-6, -7, -6), outer_angle=35.0, inner_angle=35.0, cookie=gs.Cookie(image=IMAGE)),
    "narrow": gs.SpotLight(position=(6, 7, 6), direction=(-6, -7, -5), outer_angle=12.0, inner_angle=12.0, cookie=gs.Cookie(image=IMAGE)),
    "sun": gs.DirectionalLight(cookie=gs.Cookie(image=IMAGE, repeat=True, size=3.0)),
    "clamped sun": gs.DirectionalLight(cookie=gs.Cookie(image=IMAGE, size=5.0)),
}  # fmt: skip


def looked_up(light: gs.DirectionalLight | gs.SpotLight, points: Array) -> tuple[Array, Array]:
    """Linear colour (N, 3) of the texel at world points, and whether they lie well inside a cell, where no filter matters."""
    assert light.cookie is not None
    uvw = project(light.projected[1], points)
    uv = uvw[:, :2] / uvw[:, 3:]
    uv = uv % 1.0 if light.cookie.repeat else np.clip(uv, 0.0, 1.0 - 1e-9)
    x, y = uv[:, 0] * CELLS.shape[1], (1.0 - uv[:, 1]) * CELLS.shape[0]
    column, row = np.minimum(x, CELLS.shape[1] - 1e-9).astype(int), np.minimum(y, CELLS.shape[0] - 1e-9).astype(int)
    inside = (np.abs(x - column - 0.5) < 0.4) & (np.abs(y - row - 0.5) < 0.4)
    if not light.cookie.repeat:  # outside, the border is repeated
        inside |= ((uvw[:, :2] / uvw[:, 3:] < 0.0) | (uvw[:, :2] / uvw[:, 3:] > 1.0)).all(axis=1)
    return linear_from_srgb(CELLS[row, column] / 255.0), inside


@pytest.mark.parametrize("filter", [None, gs.Pcf(1)], ids=["exact", "pcf"])
@pytest.mark.parametrize("name", list(LIGHTS))
def test_light_colour_equals_the_image(renderer: gs.Renderer, name: str, filter: gs.Filter | None) -> None:
    light = replace(LIGHTS[name], shadow=gs.Shadow(filter=filter))
    outputs = ("linear", "position", "triangle")
    frame = renderer.render(SCENE, None, [light], SIZE, ambient=0.0, outputs=outputs, samples=1)
    plain = renderer.render(SCENE, None, [replace(light, cookie=None)], SIZE, ambient=0.0, outputs=outputs, samples=1)
    seen = frame.triangle >= 0
    points = frame.position[seen].astype(np.float64)
    color, inside = looked_up(light, points)
    tested = inside & (plain.linear[seen].max(axis=1) > 0.02)
    assert tested.sum() > 300
    expected = plain.linear[seen] * color
    # 8-bit sRGB decoded by the hardware, and a float32 position
    np.testing.assert_allclose(frame.linear[seen][tested], expected[tested], atol=2e-3)
    assert np.ptp(color[tested], axis=0).min() > 0.2


def test_image_placement() -> None:
    """Directional light: `size` wide, height by the image's aspect. Spot: the square that touches the cone. v is the light's up."""
    sun = gs.DirectionalLight(direction=(0.3, -1.0, 0.2), cookie=gs.Cookie(image=IMAGE, size=3.0))
    axes = view_axes(np.asarray(sun.direction))
    for along, step in ((axes[0], (1 / 3.0, 0.0)), (axes[1], (0.0, 1.5 / 3.0)), (axes[2], (0.0, 0.0))):
        uvw = project(sun.projected[1], np.stack([np.zeros(3), along]))
        np.testing.assert_allclose(uvw[0, :2], 0.5)
        np.testing.assert_allclose(uvw[1, :2] - uvw[0, :2], step, atol=1e-12)
        np.testing.assert_allclose(uvw[:, 3], 1.0)
    spot = gs.SpotLight(position=(1, 5, 2), direction=(0, -1, 0.5), outer_angle=30.0, cookie=gs.Cookie(image=IMAGE))
    axes, away = view_axes(np.asarray(spot.direction)), 4.0
    edge = away * np.tan(np.radians(30.0))
    for x, y in ((0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (-1.0, -1.0)):
        point = np.asarray(spot.position) - away * axes[2] + edge * (x * axes[0] + y * axes[1])
        uvw = project(spot.projected[1], point)
        np.testing.assert_allclose(uvw[:2] / uvw[3], (0.5 + 0.5 * x, 0.5 + 0.5 * y), atol=1e-12)


def test_cookie_has_no_mirror_image_behind_a_spot(renderer: gs.Renderer) -> None:
    """Projected behind a spot the image would appear again, upside down."""
    light = gs.SpotLight(
        position=(0, 1.5, 0), direction=(0, -0.2, -1), outer_angle=60, shadow=None, cookie=gs.Cookie(image=IMAGE)
    )
    frame = renderer.render(SCENE, None, [light], SIZE, ambient=0.0, outputs=("linear", "position"), samples=1)
    behind = frame.position[..., 2] > 3.0
    assert behind.any()
    assert frame.linear[behind].max() == 0.0


def test_cookie_works_with_multisampling(renderer: gs.Renderer) -> None:
    light = LIGHTS["sun"]
    few, many = (
        renderer.render(SCENE, None, [light], SIZE, outputs=("linear",), samples=each).linear for each in (1, 16)
    )
    assert np.abs(few - many).mean() < 0.03
    assert np.abs(few - many).max() > 0.1  # at borders


def test_cookie_texture_is_freed_with_its_last_user() -> None:
    with gs.Renderer("egl") as renderer:
        light = gs.DirectionalLight(cookie=gs.Cookie(image=IMAGE))
        renderer.render(SCENE, None, [light], (16, 16), samples=1)
        assert len(renderer._cache.cookies._made) == 1
        renderer.render(SCENE, None, [light], (16, 16), samples=1)
        assert len(renderer._cache.cookies._made) == 1
        del light
        gc.collect()
        renderer.render(SCENE, None, None, (16, 16), samples=1)
        assert renderer._cache.cookies._made == []


@pytest.mark.parametrize(
    "image", [np.zeros((2, 2, 3)), np.zeros((2, 2), np.uint8), np.zeros((0, 2, 3), np.uint8), "file.png", None]
)
def test_invalid_images_are_refused(image: object) -> None:
    with pytest.raises(gs.SettingsError, match="Cookie image must be an image"):
        gs.Cookie(image=image)  # type: ignore[arg-type]


def test_sky_refuses_a_cookie() -> None:
    with pytest.raises(gs.SettingsError, match="SkyLight has no cookie"):
        gs.SkyLight(cookie=gs.Cookie(image=IMAGE))  # type: ignore[call-arg]
