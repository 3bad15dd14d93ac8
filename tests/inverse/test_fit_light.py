"""Lights found from their shadows: directions and sizes from starts 30 degrees off, of exact and of traced targets, and of images."""

from __future__ import annotations

import numpy as np
import pytest

import glshadow as gs
from glshadow.inverse.fit import _pyramid
from glshadow.inverse.unknowns import Unknowns

from ..outlines.solids import box, sheet

SIZE = (160, 90)
SUN = gs.DirectionalLight(direction=(-1.0, -1.5, 0.4), angle=3.0)
SCENE = gs.Scene(
    [
        gs.Node(box((-0.5, 0.0, -0.5), (0.5, 1.5, 0.5)), name="post"),
        gs.Node(box((1.2, 0.0, -1.0), (1.6, 2.2, 0.0)), name="wall"),
        gs.Node(sheet([(-6, 0, 6), (6, 0, 6), (6, 0, -6), (-6, 0, -6)]), name="floor"),
    ],
    camera=gs.PerspectiveCamera((4.0, 7.0, 8.0), (0.0, 0.0, 0.0), fov_y=50.0),
)


def start(turn: float) -> gs.DirectionalLight:
    """A sun of one degree, 30 degrees off."""
    away = np.radians(30.0) * np.array([np.cos(turn), np.sin(turn)])
    turned = Unknowns(SUN, ("direction",), 1.0).at(away)
    assert off(turned) == pytest.approx(30.0)
    return gs.DirectionalLight(direction=turned.axis, angle=1.0)


def off(light: gs.Light) -> float:
    """Degrees between a light's direction and the sun's."""
    cosine = float(np.asarray(light.axis) @ np.asarray(SUN.direction))
    return float(np.degrees(np.arccos(min(cosine, 1.0))))


def target(renderer: gs.Renderer, kind: str) -> np.ndarray:
    if kind == "traced":
        return gs.trace(SCENE, lights=SUN, size=SIZE, samples=1, light_samples=256).visibility[0]
    return renderer.render(SCENE, lights=SUN, size=SIZE, samples=1, outputs="visibility").visibility[0]


TURNS = [
    pytest.param(
        2.0 * np.pi * k / 10, marks=() if k == 3 else (pytest.mark.exhaustive, pytest.mark.slow), id=f"{36 * k}"
    )
    for k in range(10)
]


@pytest.mark.parametrize("kind", [pytest.param("exact", marks=pytest.mark.exhaustive), "traced"])
@pytest.mark.parametrize("turn", TURNS)
def test_a_sun_is_found_from_its_shadow(renderer: gs.Renderer, kind: str, turn: float) -> None:
    found = gs.fit_light(SCENE, None, target(renderer, kind), start(turn), renderer=renderer)
    assert off(found.light) < 0.1
    assert isinstance(found.light, gs.DirectionalLight)
    assert found.light.angle == pytest.approx(SUN.angle, rel=0.1)
    assert found.error < 0.01 < found.start_error


def test_unknown_pixels_do_not_count(renderer: gs.Renderer) -> None:
    frame = renderer.render(SCENE, lights=SUN, size=(96, 54), samples=1, outputs="visibility")
    wanted = frame.visibility[0].copy()
    wanted[:, ::2] = np.nan
    wanted[:12] = np.nan
    near = gs.DirectionalLight(direction=(-1.0, -1.6, 0.45), angle=2.0)
    found = gs.fit_light(SCENE, None, wanted, near, search=0.0, renderer=renderer)
    assert off(found.light) < 0.2


def test_a_point_light_is_found_with_its_radius(renderer: gs.Renderer) -> None:
    light = gs.PointLight(position=(2.0, 5.0, 1.0), radius=0.3)
    frame = renderer.render(SCENE, lights=light, size=(96, 54), samples=1, outputs="visibility")
    near = gs.PointLight(position=(2.4, 5.4, 0.6), radius=0.15)
    found = gs.fit_light(SCENE, None, frame.visibility[0], near, ("position", "radius"), renderer=renderer).light
    assert isinstance(found, gs.PointLight)
    np.testing.assert_allclose(found.position, light.position, atol=0.1)
    assert found.radius == pytest.approx(light.radius, rel=0.15)


def test_an_image_gives_the_intensity(renderer: gs.Renderer) -> None:
    light = gs.DirectionalLight(direction=SUN.direction, angle=3.0, intensity=0.6)
    size, options = (96, 54), {"ambient": 0.1, "background": (0, 0, 0), "samples": 1}
    frame = renderer.render(
        SCENE, lights=light, size=size, outputs=("linear", "image"), exposure=None, tone="none", **options
    )
    near = gs.DirectionalLight(direction=(-1.0, -1.7, 0.5), angle=3.0, intensity=1.0)
    for given in (frame.linear, frame.image):
        found = gs.fit_light(
            SCENE, None, given, near, ("direction", "intensity"), 0.0, renderer, ambient=0.1, background=(0, 0, 0)
        )
        assert off(found.light) < 0.2
        assert found.light.intensity == pytest.approx(0.6, rel=0.01)


def test_pyramid_is_of_means_of_valid_pixels() -> None:
    image = np.ones((82, 40))
    image[0, 0] = image[0, 1] = np.nan
    image[1, 0] = 0.0
    image[2:4, :2] = np.nan
    levels = _pyramid(image)
    assert [each.shape for each in levels] == [(82, 40), (41, 20)]
    assert levels[1][0, 0] == 0.5
    assert np.isnan(levels[1][1, 0])
    assert (levels[1][2:] == 1.0).all()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"target": np.zeros(4)}, r"target must be an array \(H, W\)"),
        ({"target": np.zeros((4, 4), dtype=np.uint8)}, "1 lit and 0 dark"),
        ({"target": np.full((4, 4), np.nan)}, "target must have valid pixels"),
        ({"target": np.full((4, 4), 2.0)}, "target must be visibility from 0 to 1, got 2 to 2"),
        (
            {"light": gs.PointLight(position=(0, 4, 0))},
            "free must be different settings of PointLight: of position, radius",
        ),
        ({"light": gs.SkyLight()}, "free must be"),
        ({"light": gs.SkyLight(), "free": "direction"}, "light from all around cannot be fitted"),
        ({"light": gs.DirectionalLight(shadow=None)}, r"without a shadow \(shadow=None\)"),
        ({"free": "colour"}, "free"),
        ({"free": ()}, "free must be"),
        ({"free": "intensity"}, "intensity does not change visibility"),
        ({"search": 180.0}, r"search must be .*\[0, 90\] degrees"),
        ({"tone": "none"}, "fit_light takes no tone"),
        ({"renderer": 1}, "renderer must be"),
    ],
    ids=[
        "shape",
        "bytes",
        "nan",
        "beyond",
        "point",
        "sky",
        "dome",
        "bare",
        "name",
        "none",
        "bright",
        "far",
        "tone",
        "renderer",
    ],
)
def test_what_is_wrong_is_named(arguments: dict[str, object], message: str) -> None:
    given = {"target": np.zeros((9, 16)), "light": SUN, **arguments}
    with pytest.raises(gs.SettingsError, match=message):
        gs.fit_light(SCENE, None, **given)  # type: ignore[arg-type]
