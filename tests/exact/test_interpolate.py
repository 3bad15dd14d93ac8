"""Soft shadows that are interpolated between pixels: right at the pixels that are tested, near the exact share elsewhere."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import glshadow as gs
from glshadow.core.spaces import Array
from glshadow.scenes import shapes

EXACT, BETWEEN = gs.Shadow(filter=gs.Exact()), gs.Shadow(filter=gs.Exact(interpolate=True))
SUN = gs.DirectionalLight(direction=(-0.55, -0.8, -0.25), angle=8.0)
LIGHTS: dict[str, gs.Light] = {
    "sun": SUN,
    "spot": gs.SpotLight(position=(4.0, 6.0, 4.0), direction=(-4.0, -6.0, -4.0), outer_angle=40.0, radius=0.6),
    "point": gs.PointLight(position=(1.5, 3.0, 1.0), radius=0.3),
}
STEP = 0.25
"""Of visibility: pixels that differ by more are not interpolated between (pass/interpolate.frag)."""


@pytest.fixture(autouse=True)
def _needs_compute(renderer: gs.Renderer) -> None:
    if not renderer.info["compute"]:
        pytest.skip("without OpenGL 4.3 nothing is interpolated: test_without_compute_the_frame_says_so")


def seen(renderer: gs.Renderer, scene: gs.Scene, light: gs.Light, shadow: gs.Shadow, **more: object) -> Array:
    """A light's visibility."""
    frame = renderer.render(scene, lights=[replace(light, shadow=shadow)], outputs="visibility", **more)
    assert frame.used[0].fallbacks == ()
    return frame.visibility[0]


@pytest.mark.parametrize("size", [(160, 120), (161, 121)])
@pytest.mark.parametrize("name", list(LIGHTS))
def test_every_second_pixel_is_exact_and_others_are_close(
    renderer: gs.Renderer, name: str, size: tuple[int, int]
) -> None:
    scene = gs.scenes.box().scene
    exact = seen(renderer, scene, LIGHTS[name], EXACT, size=size, samples=1)[::-1]  # row 0 below, as in OpenGL
    between = seen(renderer, scene, LIGHTS[name], BETWEEN, size=size, samples=1)[::-1]
    np.testing.assert_array_equal(between[::2, ::2], exact[::2, ::2])
    np.testing.assert_array_equal(np.isnan(between), np.isnan(exact))
    error = np.abs(between - exact)[~np.isnan(exact)]
    assert ((exact > 0.02) & (exact < 0.98)).sum() > 80
    # between pixels that differ by at most a quarter of the light, a penumbra seldom leaves their range by more
    assert np.quantile(error, 0.999) <= STEP
    assert error.mean() < 0.004
    assert (between != exact)[~np.isnan(exact)].any()


MAPS = gs.Shadow(filter=gs.DirectionMaps(64), resolution=512)


@pytest.mark.parametrize(
    ("shadow", "error"),
    [
        # 64 points of a disc: a share of 3 of them; their values between pixels differ by one more
        (BETWEEN, 4 / 64),
        # a texel is 1 / 510 of the wall's 40, a sixth of this penumbra
        (MAPS, 0.25),
    ],
    ids=["interpolate", "maps"],
)
def test_a_straight_penumbra_is_the_closed_form(renderer: gs.Renderer, shadow: gs.Shadow, error: float) -> None:
    # the edge of a wall of height 2 lights a plane through a disc: the share of a disc on one side of a line
    wall = gs.Mesh(*shapes.box((0.2, 2.0, 40.0)))
    floor = gs.Mesh(np.array([[-10, 0, -10], [10, 0, -10], [10, 0, 10], [-10, 0, 10.0]]), [[0, 2, 1], [0, 3, 2]])
    scene = gs.Scene([gs.Node(wall, _at(0.0, 1.0, 0.0)), gs.Node(floor)])
    light = gs.DirectionalLight(direction=(1.0, -1.0, 0.0), angle=8.0)
    camera = gs.OrthographicCamera((3.0, 5.0, 0.0), (3.0, 0.0, 0.0), up=(0.0, 0.0, -1.0), height=3.0)
    share = seen(renderer, scene, light, shadow, camera=camera, size=(160, 120), samples=1)
    x = 3.0 + (np.arange(160) + 0.5 - 80) * (3.0 / 120)
    radius = np.tan(np.radians(4.0))
    # the light's points are rays (s, 1) about its axis: past the edge at (0.1, 2)
    towards = np.stack([0.1 - x, np.full(160, 2.0)])  # from receivers to the edge
    axis, aside = np.array([-1.0, 1.0]) / np.sqrt(2), np.array([1.0, 1.0]) / np.sqrt(2)
    height = np.clip((aside @ towards) / (axis @ towards) / radius, -1.0, 1.0)
    expected = np.arccos(height) / np.pi - height * np.sqrt(1 - height * height) / np.pi
    np.testing.assert_allclose(share, np.broadcast_to(expected, share.shape), atol=error)


def _at(x: float, y: float, z: float) -> Array:
    moved = np.eye(4)
    moved[:3, 3] = x, y, z
    return moved


def slats(gap: float) -> gs.Scene:
    """Steps of a stair as wide as a few pixels, under a roof that covers half of them."""
    box = gs.Mesh(*shapes.box((1.0, 1.0, 1.0)))

    def put(size: tuple[float, float, float], at: tuple[float, float, float]) -> gs.Node:
        return gs.Node(box, _at(*at) @ np.diag([*size, 1.0]))

    steps = [put((0.8 * gap, 0.1, 3.0), (gap * k - 1.5, 0.3 * (k % 3), 0.0)) for k in range(int(3.0 / gap))]
    return gs.Scene([*steps, put((3.0, 0.05, 1.5), (0.0, 1.2, 0.4))])


@pytest.mark.parametrize("samples", [1, 4])
def test_surfaces_of_a_pixel_or_two_keep_their_own_share(renderer: gs.Renderer, samples: int) -> None:
    scene = slats(0.06)
    exact = seen(renderer, scene, SUN, EXACT, size=(160, 120), samples=samples)
    between = seen(renderer, scene, SUN, BETWEEN, size=(160, 120), samples=samples)
    error = np.abs(between - exact)[~np.isnan(exact)]
    # a share of another surface would be off by up to 1; samples may take that of a pixel beside them
    assert (error > 0.1).mean() < (0.02 if samples == 1 else 0.04)
    assert error.mean() < 0.012


def test_a_frame_depends_on_its_arguments_alone(renderer: gs.Renderer) -> None:
    scene, light = gs.scenes.box().scene, replace(SUN, shadow=BETWEEN)
    other = gs.PerspectiveCamera((5.0, 2.0, 1.0), (0.0, 0.0, 0.0))

    def frame(size: tuple[int, int], samples: int, camera: gs.Camera | None = None) -> Array:
        return renderer.render(scene, camera, [light], size, outputs="image", samples=samples).image

    first = frame((120, 90), 4)
    for size, samples, camera in (
        ((121, 91), 4, other),
        ((64, 48), 1, None),
        ((120, 90), 1, other),
        ((120, 90), 16, None),
    ):
        frame(size, samples, camera)
    np.testing.assert_array_equal(frame((120, 90), 4), first)
    with gs.Renderer() as fresh:
        np.testing.assert_array_equal(
            fresh.render(scene, None, [light], (120, 90), outputs="image", samples=4).image, first
        )


def test_it_is_named_in_what_was_used(renderer: gs.Renderer) -> None:
    frame = renderer.render(gs.scenes.box().scene, lights=[replace(SUN, shadow=BETWEEN)], size=(32, 24))
    assert "interpolated between pixels" in frame.used[0].why
    assert repr(frame.used[0].filter) == "Exact(interpolate=True)"
