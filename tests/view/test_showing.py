"""The state behind window and notebook controls: angles, distances and settings, in numbers."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import glshadow as gs
from glshadow.ui.controls import CHOICES, HELP, SIZES, Controls, landscapes
from glshadow.ui.showing import STEEPEST, Showing, angles_of, direction_of

SCENE = gs.scenes.courtyard()
CAMERA = gs.PerspectiveCamera(position=(0.0, 1.0, 5.0), target=(0.0, 1.0, 0.0))
LIGHTS: tuple[gs.DirectionalLight | gs.SpotLight | gs.PointLight | gs.RectLight, ...] = (
    gs.DirectionalLight(direction=(0.0, -1.0, -1.0)),
    gs.SpotLight(position=(4.0, 6.0, 3.0), direction=(-4.0, -6.0, -3.0)),
    gs.PointLight(position=(4.0, 6.0, 3.0)),
    gs.RectLight(position=(4.0, 6.0, 3.0), direction=(-4.0, -6.0, -3.0)),
)


def showing(**more: object) -> Showing:
    return Showing(SCENE, CAMERA, LIGHTS, **more)  # type: ignore[arg-type]


@pytest.mark.parametrize("angles", [(0.0, 0.0), (30.0, 40.0), (-120.0, -80.0), (179.0, 5.0)])
def test_angles_and_directions(angles: tuple[float, float]) -> None:
    assert angles_of(3.0 * direction_of(*angles)) == pytest.approx(angles)
    assert angles_of(np.array([0.0, 2.0, 0.0])) == (0.0, 90.0)


def test_turning_keeps_the_distance_and_the_target() -> None:
    seen = showing().turned(90.0, 0.0).camera
    assert seen.position == pytest.approx((5.0, 1.0, 0.0))
    assert seen.target == CAMERA.target
    above = showing().turned(0.0, 500.0).camera
    assert angles_of(np.subtract(above.position, above.target))[1] == pytest.approx(STEEPEST)


def test_panning_and_zooming() -> None:
    panned = showing().panned(0.2, 0.1).camera
    assert panned.position == pytest.approx((1.0, 1.5, 5.0))
    assert panned.target == pytest.approx((1.0, 1.5, 0.0))
    assert showing().zoomed(2.0).camera.position == pytest.approx((0.0, 1.0, 2.5))
    nearest = showing().zoomed(1e9).camera
    assert np.linalg.norm(np.subtract(nearest.position, nearest.target)) == pytest.approx(1e-3 * showing().size)
    flat = replace(showing(), camera=gs.OrthographicCamera((0, 5, 0), (0, 0, 0), (0, 0, -1), height=4.0)).zoomed(2.0)
    assert flat.camera.height == 2.0  # type: ignore[attr-defined]


@pytest.mark.parametrize("light", range(4))
def test_light_moves_to_the_given_angles(light: int) -> None:
    before = replace(showing(), light=light)
    after = before.lit_from(25.0, 50.0)
    assert after.aim == pytest.approx((25.0, 50.0))
    moved, old = after.lights[light], LIGHTS[light]
    assert after.lights[:light] + after.lights[light + 1 :] == LIGHTS[:light] + LIGHTS[light + 1 :]
    middle = SCENE.bounds.mean(axis=0)
    if not isinstance(moved, gs.DirectionalLight):
        assert np.linalg.norm(np.subtract(moved.position, middle)) == pytest.approx(
            np.linalg.norm(np.subtract(old.position, middle))  # type: ignore[union-attr]
        )
    if isinstance(moved, gs.SpotLight):  # it still aims at the same point, seen from the centre
        to_middle = middle - np.asarray(moved.position)
        was = middle - np.asarray(old.position)  # type: ignore[union-attr]
        cosine = np.dot(to_middle, moved.direction) / np.linalg.norm(to_middle) / np.linalg.norm(moved.direction)
        before_ = np.dot(was, old.direction) / np.linalg.norm(was) / np.linalg.norm(old.direction)  # type: ignore[union-attr]
        assert cosine == pytest.approx(before_)


def test_settings_replace_those_of_lights_that_cast() -> None:
    lights = (
        gs.DirectionalLight(shadow=gs.Shadow(strength=0.5, resolution=512)),
        gs.PointLight(position=(0.0, 5.0, 0.0), shadow=None),
    )
    chosen = Showing(SCENE, CAMERA, lights, filter=gs.Pcf(2), resolution=1024).shadowed
    assert chosen[0].shadow == gs.Shadow(strength=0.5, resolution=1024, filter=gs.Pcf(2))
    assert chosen[1].shadow is None
    exact = Showing(SCENE, CAMERA, lights, filter=gs.Exact(), bias=gs.NoBias()).shadowed
    assert exact[0].shadow == gs.Shadow(strength=0.5, filter=gs.Exact()), "settings of a map do not apply to it"
    assert Showing(SCENE, CAMERA, lights).shadowed == lights


def test_every_key_does_what_its_help_text_states() -> None:
    controls = Controls(showing(), landscapes())
    assert controls.pressed("f")
    assert str(controls.showing.filter) == str(gs.Hard())
    assert controls.pressed("F")
    assert controls.showing.filter is None
    for _ in CHOICES:
        controls.pressed("f")
    assert str(controls.showing.filter) == CHOICES[-1]
    assert controls.pressed("f")
    assert controls.showing.filter is None, "wraps around"
    assert controls.pressed("d")
    assert (controls.showing.overlays, controls.showing.filter) == (("map",), gs.Pcf(1))
    assert controls.pressed("d")
    assert controls.showing.overlays == ()
    assert controls.pressed("r")
    assert controls.showing.resolution == 256
    assert controls.pressed("b")
    assert controls.pressed("s")
    assert controls.showing.samples == 4
    assert controls.pressed("e")
    assert controls.showing.error
    assert controls.pressed("+")
    assert controls.showing.lights[0].angle == SIZES[1]  # type: ignore[union-attr]
    assert controls.pressed("n")
    assert controls.showing.light == 1
    assert controls.pressed("1")
    assert controls.showing.scene.name != SCENE.name
    assert controls.showing.error, "settings stay when the scene changes"
    assert controls.pressed("0")
    assert controls.showing.scene is SCENE
    assert controls.pressed("o")
    assert not controls.showing.camera.is_perspective
    assert controls.pressed("o")
    assert controls.showing.camera.is_perspective
    assert controls.pressed("a")
    before = controls.showing.aim[0]
    controls.advanced(0.5)
    assert controls.showing.aim[0] == pytest.approx(before + 20.0)
    assert controls.pressed("space")
    assert controls.showing.aim == pytest.approx(showing().aim)
    assert not controls.animated
    assert not controls.pressed("z"), "the key does nothing"
    named = {key for keys, _ in HELP for key in keys.split()}
    assert {"f", "F", "r", "R", "b", "B", "s", "d", "l", "x", "g", "e", "1", "2", "3", "0", "a", "n", "o", "h"} <= named


def test_both_projections_show_the_target_alike() -> None:
    controls = Controls(showing(), {})
    width = CAMERA.window((100, 100))
    controls.pressed("o")
    assert controls.showing.camera.height == pytest.approx(5.0 * (width[3] - width[2]))  # type: ignore[attr-defined]
    controls.pressed("o")
    assert controls.showing.camera.fov_y == pytest.approx(CAMERA.fov_y)  # type: ignore[attr-defined]
