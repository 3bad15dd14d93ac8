"""Looks: what a file is given that has no camera, lights and materials of its own."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import glshadow as gs
from glshadow.scene.looks import LOOKS, flatness

CUBE = np.array([[x, y, z] for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)])
FACES = [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1], [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]]  # fmt: skip
LIT = gs.DirectionalLight(direction=(0, -1, 0))


def cube(**given: object) -> gs.Mesh:
    return gs.Mesh(CUBE, np.array(FACES), **given)  # type: ignore[arg-type]


def test_default_is_the_studio_and_a_given_look_wins() -> None:
    scene = gs.load(cube())
    assert (scene.look, [type(light) for light in scene.lights]) == ("studio", [gs.DirectionalLight, gs.SkyLight])
    assert gs.Scene([cube()]).look == "plain"
    plain = gs.load(cube(), look="plain")
    assert (plain.camera, plain.lights) == (gs.Scene([cube()]).camera, gs.Scene([cube()]).lights)
    assert gs.load(cube(), look="outdoor").lights[0].angle == 0.53  # type: ignore[attr-defined]
    with pytest.raises(gs.SettingsError, match="look must be one of 'studio', 'plain', 'outdoor'"):
        gs.load(cube(), look="night")


def test_own_lights_and_cameras_stay_unless_a_look_is_given() -> None:
    own = gs.Scene([cube()], gs.PerspectiveCamera((5, 5, 5)), [LIT])
    assert gs.load(own).lights == (LIT,)
    assert (gs.load(own).look, gs.load(own, look="studio").look) == ("plain", "studio")
    relit = gs.load(own, look="studio")
    assert relit.camera == own.camera
    assert len(relit.lights) == 2


def test_key_comes_from_the_side_of_the_view_and_lower_for_flat_models() -> None:
    for turn in (0.0, 1.0, 4.0):
        eye = (9 * np.sin(turn), 4.0, 9 * np.cos(turn))
        scene = gs.load(gs.Scene([cube()], gs.PerspectiveCamera(eye)), look="studio")
        key = np.array(scene.lights[0].direction)  # type: ignore[attr-defined]
        right = scene.camera.view_from_world[0, :3]
        shadow = key * (1, 0, 1) / np.linalg.norm(key * (1, 0, 1))
        assert shadow @ right > 0.6  # the shadow falls to the right, within 53 degrees of it
        assert np.degrees(np.arcsin(-key[1])) == pytest.approx(48.0, abs=0.1)
    flat = gs.load(gs.Mesh(CUBE * (1, 0.01, 1), np.array(FACES)))
    assert np.degrees(np.arcsin(-flat.lights[0].direction[1])) == pytest.approx(30.0, abs=0.1)  # type: ignore[attr-defined]
    assert [flatness(np.array([[0, 0, 0], [3, h, 4]])) for h in (5, 2.25, 1.25, 0.25, 0)] == pytest.approx(
        [0, 0, 0.5, 1, 1]
    )


def test_views_from_straight_above_have_a_key_too() -> None:
    above = gs.PerspectiveCamera((0, 9, 0), up=(0, 0, -1))
    scene = gs.load(gs.Scene([cube()], above), look="studio")
    assert np.degrees(np.arcsin(-scene.lights[0].direction[1])) == pytest.approx(48.0)  # type: ignore[attr-defined]


def test_white_without_a_material() -> None:
    made = gs.load(cube()).nodes[0].mesh
    assert (made.material.color, gs.load(cube(), look="plain").nodes[0].mesh.material.color) == (
        (0.8, 0.8, 0.8, 1),
        (1,) * 4,
    )
    red = gs.Material(color=(1, 0, 0, 1))
    assert gs.load(cube(material=red)).nodes[0].mesh.material is red
    painted = cube(colors=np.ones((8, 4), np.float32))
    assert gs.load(painted).nodes[0].mesh is painted
    shared = cube()
    nodes = gs.load([gs.Node(shared), gs.Node(shared)]).nodes
    assert nodes[0].mesh is nodes[1].mesh
    scene = gs.Scene([shared])
    assert gs.load(scene).nodes[0].mesh is shared


def test_white_stays_in_motion(models: Path) -> None:
    scene = gs.load(models / "milk_truck.glb")
    assert [a.mesh is b.mesh for a, b in zip(scene.nodes, scene.at(0.5).nodes, strict=True)] == [True] * len(
        scene.nodes
    )


def test_ambient_light_is_the_looks_own_only_beside_its_fill() -> None:
    studio, plain = LOOKS["studio"], LOOKS["plain"]
    scene = gs.load(cube())
    assert studio.ambient_beside(scene.lights) == studio.ambient
    assert studio.ambient_beside([LIT]) == plain.ambient == (0.27, 0.12)
    assert plain.ambient_beside([LIT, gs.SkyLight()]) == plain.ambient
