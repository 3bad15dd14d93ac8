"""Every pixel against rays; where the two differ, every triangle is tested in float64."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np
import pytest

import glshadow as gs
from glshadow.core.spaces import Array
from glshadow.lights import Light
from glshadow.renderer import Renderer
from glshadow.scene.nodes import Scene
from glshadow.scenes import analytic

from .compare import WRONG, compared

COURTYARD = {
    "sun": gs.DirectionalLight(direction=(-0.55, -0.8, -0.25)),
    "low sun": gs.DirectionalLight(direction=(1.0, -0.02, 0.3)),
    "spot": gs.SpotLight(position=(6.0, 9.0, 5.0), direction=(-6.0, -9.0, -5.0), inner_angle=35.0, outer_angle=40.0),
    "wide spot": gs.SpotLight(position=(0.5, 2.2, 0.8), direction=(0.3, -1.0, 0.2), inner_angle=70.0, outer_angle=80.0),
    "point light": gs.PointLight(position=(0.5, 2.2, 0.8)),
    "point light near a column": gs.PointLight(position=(2.4, 0.3, 3.0)),
    "point light far away": gs.PointLight(position=(60.0, 90.0, 50.0)),
}


@pytest.fixture(scope="module")
def courtyard() -> Scene:
    return gs.scenes.courtyard()


@pytest.mark.parametrize("name", list(COURTYARD))
def test_courtyard(renderer: Renderer, courtyard: Scene, name: str) -> None:
    result = compared(renderer, courtyard, COURTYARD[name])
    assert result.wrong.sum() <= WRONG, str(result)
    assert 0.2 < result.lit < 0.99, str(result)


def test_light_inside_a_closed_column_is_blocked(renderer: Renderer, courtyard: Scene) -> None:
    """The column's walls are seen from behind: if they were culled as back faces, half of the image would be lit."""
    frame = renderer.render(
        courtyard,
        lights=[gs.PointLight(position=(3.0, 0.3, 3.0), shadow=gs.Shadow(filter=gs.Exact()))],
        size=(640, 360),
        samples=1,
    )
    np.testing.assert_array_equal(np.nan_to_num(frame.visibility), 0.0)


SMALL: dict[str, analytic.AnalyticScene] = {
    "box": analytic.box(30.0, 30.0),
    "plates": analytic.plates(1e-3, 45.0),
    "room with rods": analytic.room(rods=True),
    "sphere": analytic.sphere(45.0),
    "wall": analytic.wall(5.0),
}


def small_lights(scene: Scene) -> dict[str, Light]:
    """One light of each kind, above the scene."""
    low, high = scene.bounds
    above = 0.5 * (low + high) + np.array([0.11, 0.4, 0.07]) * float(np.linalg.norm(high - low))
    return {
        "sun": gs.DirectionalLight(direction=(-0.4, -0.8, 0.3)),
        "spot": gs.SpotLight(position=tuple(above), direction=(-0.11, -0.4, -0.07), inner_angle=40.0, outer_angle=45.0),
        "point light": gs.PointLight(position=tuple(above)),
    }


@pytest.mark.parametrize("kind", ["own light", "sun", "spot", "point light"])
@pytest.mark.parametrize("name", list(SMALL))
def test_small_scenes(renderer: Renderer, name: str, kind: str) -> None:
    scene = SMALL[name].scene
    light = scene.lights[0] if kind == "own light" else small_lights(scene)[kind]
    result = compared(renderer, scene, light)
    assert result.wrong.sum() <= WRONG, str(result)


@pytest.mark.parametrize("name", list(SMALL))
def test_closed_forms(renderer: Renderer, name: str) -> None:
    """Without a tracer: the image is the closed form, except for edges within rounding of a pixel's point."""
    built = SMALL[name]
    result = compared(renderer, built.scene, built.scene.lights[0])
    truth, seen = result.truth, result.truth.triangle >= 0
    exact = built.exact(truth.position[seen], truth.shading[seen])
    share = float((exact != result.frame.visibility[0][seen]).mean())
    # facets of the sphere lie up to 2e-4 of its radius inside it; rods and plates: points on their own surface
    allowed = 2e-3 if name in ("sphere", "room with rods") else 1e-4
    assert share <= allowed, f"{share:.4%} of the pixels differ"


def around(scene: Scene, share: tuple[float, float, float]) -> tuple[Array, float]:
    """A point away from a scene's centre by a fraction of its size, and the size."""
    low, high = scene.bounds
    size = float(np.linalg.norm(high - low))
    return 0.5 * (low + high) + np.array(share) * size, size


@pytest.mark.parametrize("kind", ["sun", "low sun", "spot", "point light"])
@pytest.mark.parametrize("name", ["chess_board.glb", "house_scene.glb"])
def test_models(renderer: Renderer, models: Path, name: str, kind: str) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", gs.GlshadowWarning)
        scene = gs.load(models / name, ground=True, look="plain")
    lights: dict[str, Light] = {
        "sun": scene.lights[0],
        "low sun": gs.DirectionalLight(direction=(1.0, -0.02, 0.3)),
        "spot": gs.SpotLight(
            position=tuple(around(scene, (0.2, 0.3, 0.15))[0]),
            direction=(-0.2, -0.3, -0.15),
            inner_angle=30.0,
            outer_angle=35.0,
        ),
        "point light": gs.PointLight(position=tuple(around(scene, (0.031, 0.09, 0.017))[0])),
    }
    result = compared(renderer, scene, lights[kind])
    assert result.wrong.sum() <= WRONG, str(result)
    dark = (result.truth.visibility[0] == 0.0) & (result.truth.cosine[0] > 0.0)
    assert dark.sum() > 100, str(result)
