"""Looks: what a file is given that has no camera, lights and materials of its own."""

from __future__ import annotations

import pickle
from pathlib import Path

import numpy as np
import pytest

import glshadow as gs
from glshadow.io.whitened import Whitened
from glshadow.scene.looks import LOOKS, flatness

CUBE = np.array([[x, y, z] for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)])
FACES = np.reshape(
    [0, 1, 3, 0, 3, 2, 4, 6, 7, 4, 7, 5, 0, 4, 5, 0, 5, 1, 2, 3, 7, 2, 7, 6, 0, 2, 6, 0, 6, 4, 1, 5, 7, 1, 7, 3],
    (12, 3),
)
LIT = gs.DirectionalLight(direction=(0, -1, 0))


def cube(**given: object) -> gs.Mesh:
    return gs.Mesh(CUBE, FACES, **given)  # type: ignore[arg-type]


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
        assert abs(shadow @ right) > 0.6  # the shadow falls to one side of the view, within 53 degrees of it
        assert np.degrees(np.arcsin(-key[1])) == pytest.approx(48.0, abs=0.1)
    flat = gs.load(gs.Mesh(CUBE * (1, 0.01, 1), FACES))
    assert np.degrees(np.arcsin(-flat.lights[0].direction[1])) == pytest.approx(30.0, abs=0.1)  # type: ignore[attr-defined]
    assert [flatness(np.array([[0, 0, 0], [3, h, 4]])) for h in (5, 2.25, 1.25, 0.25, 0)] == pytest.approx(
        [0, 0, 0.5, 1, 1]
    )


def test_views_from_straight_above_have_a_key_too() -> None:
    above = gs.PerspectiveCamera((0, 9, 0), up=(0, 0, -1))
    scene = gs.load(gs.Scene([cube()], above), look="studio")
    assert np.degrees(np.arcsin(-scene.lights[0].direction[1])) == pytest.approx(48.0)  # type: ignore[attr-defined]


def test_white_without_a_material() -> None:
    arrays = (CUBE, FACES)
    assert gs.load(arrays).nodes[0].mesh.material.color == (0.8, 0.8, 0.8, 1)
    assert gs.load(arrays, look="plain").nodes[0].mesh.material.color == (1, 1, 1, 1)
    mesh = cube()
    assert gs.load([mesh, gs.Node(mesh)]).nodes[1].mesh.material.color == (0.8, 0.8, 0.8, 1)
    assert gs.load(gs.Scene([mesh]), look="studio").nodes[0].mesh is mesh  # a Scene stays as it is


def test_white_is_told_from_paint() -> None:
    red, blank = gs.Material(color=(1, 0, 0, 1)), gs.Material(double_sided=True)
    shared = cube(material=blank)
    nodes = [gs.Node(each) for each in (cube(material=red), cube(colors=np.ones((8, 4), np.float32)), shared, shared)]
    whitened = Whitened(0.5, nodes)
    changed = [whitened.node(each) for each in nodes]
    assert [a is b for a, b in zip(nodes, changed, strict=True)] == [True, True, False, False]
    assert changed[2].mesh is changed[3].mesh is whitened(shared)
    assert (changed[2].mesh.material.color, changed[2].mesh.material.double_sided) == ((0.5, 0.5, 0.5, 1), True)
    moved = cube(material=blank)  # a pose of it
    assert whitened(moved).material is changed[2].mesh.material
    copied, mesh = pickle.loads(pickle.dumps((whitened, shared)))
    assert copied(mesh).material is copied(mesh).material


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


def test_a_loaded_scene_that_is_turned_is_framed_and_lit_anew() -> None:
    scene = gs.load((CUBE * (1, 1, 3), FACES))
    turned = gs.load(scene, up_axis="z")
    assert (turned.camera, turned.lights) == (gs.load((CUBE * (1, 1, 3), FACES), up_axis="z").camera, turned.lights)
