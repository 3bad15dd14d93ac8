"""glTF animations: the scene at a time against closed forms in float64; broken animations are left out by name."""

from __future__ import annotations

import pickle
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import glshadow as gs
from glshadow.arguments import metered
from glshadow.core.spaces import Array
from glshadow.errors import GlshadowWarning, SceneError, SettingsError
from glshadow.io.gltf.animation import Track, slerp

from .glb import Glb

FACE = np.array([[1.0, 0, 0], [0, 1, 0], [0, 0, 1]])
EXACT = 1e-15  # relative to coordinates of about 1: a few roundings of float64
STORED = 1e-7  # the same of keys that the file rounds to float32


def scene_of(file: Glb, folder: Path, **options: Any) -> gs.Scene:
    return gs.load(file.save(folder / "moving.glb"), **options)


def moving(*channels: tuple[int, str, Any, Any], nodes: list[dict[str, Any]] | None = None, **sampler: Any) -> Glb:
    """A triangle in node 0, and one animation: (node, path, times, values) of each channel."""
    file = Glb(nodes=nodes or [{"mesh": 0}])
    file.mesh({"attributes": {"POSITION": file.add(FACE)}})
    animate(file, *channels, **sampler)
    return file


def animate(file: Glb, *channels: tuple[int, str, Any, Any], name: str | None = None, **sampler: Any) -> None:
    made: dict[str, Any] = {"channels": [], "samplers": []}
    for node, path, times, values in channels:
        output = values if isinstance(values, int) else file.add(values)
        given = times if isinstance(times, int) else file.add(np.asarray(times, dtype=float))
        made["samplers"].append({"input": given, "output": output, **sampler})
        made["channels"].append({"sampler": len(made["samplers"]) - 1, "target": {"node": node, "path": path}})
    file.json.setdefault("animations", []).append(made if name is None else {"name": name, **made})


def about_z(degrees: float) -> tuple[float, float, float, float]:
    half = np.radians(degrees) / 2
    return (0.0, 0.0, float(np.sin(half)), float(np.cos(half)))


def corners(scene: gs.Scene, node: int = 0) -> Array:
    placed = scene.nodes[node]
    return placed.mesh.positions @ placed.world_from_mesh[:3, :3].T + placed.world_from_mesh[:3, 3]


# -- values


def test_corner_of_a_turning_triangle(tmp_path: Path) -> None:
    """A quarter turn in two seconds below a node that is moved and scaled: the corner (1, 0, 0) goes round a circle."""
    nodes = [{"mesh": 0}, {"children": [0], "translation": [5, 0, 0], "scale": [2, 2, 2]}]
    scene = scene_of(moving((0, "rotation", [0, 2], [about_z(0), about_z(90)]), nodes=nodes), tmp_path)
    assert (scene.duration, scene.animations) == (2.0, {"animation0": 2.0})
    for seconds in (0.0, 0.25, 1.0, 1.75, 2.0, 3.0):
        angle = np.radians(45.0 * min(seconds, 2.0))
        expected = (5 + 2 * np.cos(angle), 2 * np.sin(angle), 0)
        np.testing.assert_allclose(corners(scene.at(seconds))[0], expected, atol=4 * STORED)


def test_translation_scale_and_clamping(tmp_path: Path) -> None:
    file = moving((0, "translation", [1, 3], [[0, 0, 0], [4, 8, 0]]), (0, "scale", [0, 2], [[1, 1, 1], [3, 1, 1]]))
    scene = scene_of(file, tmp_path)
    assert scene.duration == 3.0
    for seconds, shift, factor in ((0, 0, 1), (0.5, 0, 1.5), (1.5, 1, 2.5), (3, 4, 3), (9, 4, 3), (-1, 0, 1)):
        expected = FACE * (factor, 1, 1) + (shift, 2 * shift, 0)
        np.testing.assert_allclose(corners(scene.at(seconds)), expected, atol=EXACT)


def test_step_holds_until_the_next_key(tmp_path: Path) -> None:
    file = moving((0, "translation", [0, 1, 2], [[0, 0, 0], [1, 0, 0], [2, 0, 0]]), interpolation="STEP")
    scene = scene_of(file, tmp_path)
    moved = [scene.at(t).nodes[0].world_from_mesh[0, 3] for t in (0, 0.999, 1, np.nextafter(2, 0), 2)]
    assert moved == [0, 0, 1, 1, 2]


def test_cubic_spline_is_the_formula_of_the_specification() -> None:
    """Appendix C.5, written out with exact fractions: keys at 1 and 3 s."""
    a0, v0, b0, a1, v1, b1 = 9.0, 2.0, 0.5, -1.5, 5.0, 9.0
    track = Track(
        0, "translation", np.array([1.0, 3.0]), np.array([[[a0], [v0], [b0]], [[a1], [v1], [b1]]]), "CUBICSPLINE"
    )
    for seconds in (1.0, 1.25, 2.0, 2.5, 3.0):
        t, td = (seconds - 1.0) / 2.0, 2.0
        expected = (
            (2 * t**3 - 3 * t**2 + 1) * v0
            + td * (t**3 - 2 * t**2 + t) * b0
            + (-2 * t**3 + 3 * t**2) * v1
            + td * (t**3 - t**2) * a1
        )
        assert float(track.at(seconds)[0]) == pytest.approx(expected, rel=4 * EXACT)
    assert [float(track.at(t)[0]) for t in (0.0, 4.0)] == [v0, v1]


def test_cubic_spline_from_a_file(tmp_path: Path) -> None:
    """A parabola: x = t^2 on 0..2 has the tangents 2 t."""
    keys = [[[0, 0, 0], [0, 0, 0], [0, 0, 0]], [[4, 0, 0], [4, 0, 0], [4, 0, 0]]]
    file = moving((0, "translation", [0, 2], np.reshape(keys, (6, 3))), interpolation="CUBICSPLINE")
    scene = scene_of(file, tmp_path)
    for seconds in (0.0, 0.5, 1.0, 1.5, 2.0):
        assert scene.at(seconds).nodes[0].world_from_mesh[0, 3] == pytest.approx(seconds**2, abs=EXACT)


def test_rotations_take_the_shorter_way() -> None:
    a, b = np.array(about_z(10)), np.array(about_z(70))
    for q in (b, -b, 3.0 * b):
        turned = slerp(a, q, 0.25)
        np.testing.assert_allclose(turned * np.sign(turned[3]), about_z(25), atol=EXACT)
    # 20 degrees backwards rather than 340 forwards
    np.testing.assert_allclose(
        np.abs(slerp(np.array(about_z(0)), np.array(about_z(340)), 0.5)), np.abs(about_z(-10)), atol=EXACT
    )


def test_tiny_rotations_are_not_lost() -> None:
    """The arc cosine of a . b would be 0 here."""
    a, b = np.array(about_z(0)), np.array([0.0, 0.0, 1e-9, 1.0])
    assert slerp(a, b, 0.25)[2] == pytest.approx(0.25e-9, rel=1e-7)
    np.testing.assert_array_equal(slerp(a, a, 0.5), a)


def test_integers_sparse_and_pointers(tmp_path: Path) -> None:
    """Rotations as normalised 16-bit integers, a sparse accessor of translations, and KHR_animation_pointer to a scale."""
    file = moving()
    turns = file.add(np.rint(np.array([about_z(0), about_z(90)]) * 32767), "int16", normalized=True)
    rows, values = file.view(np.array([[1]], dtype="<u1")), file.view(np.array([[0, 0, 6]], dtype="<f4"))
    place = {"indices": {"bufferView": rows, "componentType": 5121}, "values": {"bufferView": values}}
    sparse = file.declare(2, sparse={"count": 1, **place})
    animate(
        file,
        (0, "rotation", [0, 1], turns),
        (0, "translation", [0, 1], sparse),
        (0, "scale", [0, 1], [[1, 1, 1], [3, 3, 3]]),
    )
    target = file.json["animations"][-1]["channels"][2]["target"]
    target.clear()
    target |= {"path": "pointer", "extensions": {"KHR_animation_pointer": {"pointer": "/nodes/0/scale"}}}
    file.json["animations"].pop(0)
    now = scene_of(file, tmp_path).at(0.5)
    c = np.sqrt(0.5)
    # 2^-15: the rounding of the integers
    np.testing.assert_allclose(corners(now)[0], (2 * c, 2 * c, 3), atol=2**-15)


def test_weights_of_morph_targets(tmp_path: Path) -> None:
    up, out = np.array([[0.0, 0, 2]] * 3), np.array([[0.0, 0, 0], [4, 0, 0], [0, 0, 0]])
    file = Glb(nodes=[{"mesh": 0}, {"mesh": 0, "translation": [9, 0, 0]}])
    primitive = {
        "attributes": {"POSITION": file.add(FACE)},
        "targets": [{"POSITION": file.add(up)}, {"POSITION": file.add(out)}],
    }
    file.mesh(primitive, weights=[0, 0])
    animate(file, (0, "weights", [0, 1, 3], np.array([[0.0], [0], [1], [0], [1], [1]])))
    scene = scene_of(file, tmp_path)
    assert scene.at(0).nodes[0].mesh is scene.nodes[0].mesh
    for seconds, one, two in ((0.5, 0.5, 0), (1, 1, 0), (2, 1, 0.5), (3, 1, 1)):
        now = scene.at(seconds)
        np.testing.assert_allclose(now.nodes[0].mesh.positions, FACE + one * up + two * out, atol=EXACT)
        assert now.nodes[1] is scene.nodes[1]


def arm() -> Glb:
    """Three vertices: on the first joint, on both, on the second; the second joint, at y = 1, turns by 90 degrees in 1 s."""
    file = Glb(nodes=[{"mesh": 0, "skin": 0}, {"children": [2]}, {"translation": [0, 1, 0]}])
    bind = np.stack([np.eye(4), np.eye(4)])
    bind[1, 1, 3] = -1
    attributes = {
        "POSITION": file.add([[0.0, 0, 0], [1, 1, 0], [0, 3, 0]]),
        "NORMAL": file.add(np.tile((0.0, 0, 1), (3, 1))),
        "JOINTS_0": file.add([[0, 1, 0, 0], [0, 1, 0, 0], [0, 1, 0, 0]], "uint8"),
        "WEIGHTS_0": file.add([[1.0, 0, 0, 0], [0.5, 0.5, 0, 0], [0, 1, 0, 0]]),
    }
    file.mesh({"attributes": attributes})
    file.json["skins"] = [{"joints": [1, 2], "inverseBindMatrices": file.add(bind)}]
    animate(file, (2, "rotation", [0, 1], [about_z(0), about_z(90)]))
    return file


def test_skin_of_two_joints(tmp_path: Path) -> None:
    scene = scene_of(arm(), tmp_path)
    assert scene.at(0.0).nodes[0].mesh is scene.nodes[0].mesh
    for seconds in (0.25, 0.5, 1.0):
        angle = np.radians(90.0 * seconds)
        mesh = scene.at(seconds).nodes[0].mesh
        c, s = np.cos(angle), np.sin(angle)
        expected = [[0, 0, 0], [(1 + c) / 2, 1 + s / 2, 0], [-2 * s, 1 + 2 * c, 0]]
        np.testing.assert_allclose(mesh.positions, expected, atol=4 * STORED)
        np.testing.assert_array_equal(mesh.normals, np.tile(np.float32((0, 0, 1)), (3, 1)))
        assert mesh.triangles is scene.nodes[0].mesh.triangles
        assert mesh.material is scene.nodes[0].mesh.material


def test_pose_equals_a_file_at_rest_in_that_pose(tmp_path: Path) -> None:
    """The same skin whose file says that the joint is turned: every vertex to the bit."""
    turned = arm()
    turned.json["nodes"][2]["rotation"] = np.asarray(about_z(90), dtype=np.float32).astype(float).tolist()
    at = scene_of(arm(), tmp_path).at(1.0)
    np.testing.assert_array_equal(at.nodes[0].mesh.positions, scene_of(turned, tmp_path).nodes[0].mesh.positions)


# -- what is shared


def test_names_order_and_objects_stay(tmp_path: Path) -> None:
    nodes = [{"mesh": 0, "name": "a"}, {"mesh": 0, "name": "b", "children": [2]}, {"mesh": 0, "name": "c"}]
    file = moving((1, "translation", [0, 1], [[0, 0, 0], [0, 0, 1]]), nodes=nodes)
    scene = scene_of(file, tmp_path, ground=True)
    now = scene.at(0.5)
    assert [node.name for node in now.nodes] == [node.name for node in scene.nodes] == ["a", "b", "c", "ground"]
    assert [one is other for one, other in zip(now.nodes, scene.nodes, strict=True)] == [True, False, False, True]
    assert len({id(node.mesh) for node in (*scene.nodes[:3], *now.nodes[:3])}) == 1
    assert (now.camera, now.lights, now.name) == (scene.camera, scene.lights, scene.name)
    np.testing.assert_array_equal(now.bounds, gs.Scene(now.nodes).bounds)
    assert scene.at(0.0) is scene
    assert now.at(0.5) is now


def test_times_in_any_order_give_the_same(tmp_path: Path) -> None:
    scene = scene_of(arm(), tmp_path)
    first = {t: scene.at(t).nodes[0].mesh.positions for t in (0.1, 0.7, 0.3)}
    now = scene
    for t in (0.3, 0.7, 0.1, 0.7):
        now = now.at(t)
        np.testing.assert_array_equal(now.nodes[0].mesh.positions, first[t])
    again = pickle.loads(pickle.dumps(scene.at(0.9)))
    np.testing.assert_array_equal(again.at(0.3).nodes[0].mesh.positions, first[0.3])


def test_moved_nodes_and_other_settings(tmp_path: Path) -> None:
    """A node that the user has removed, one that he has marked, and a camera and lights of his own."""
    nodes = [{"mesh": 0, "name": "a"}, {"mesh": 0, "name": "b"}]
    values = [[0, 0, 0], [0, 0, 4]]
    scene = scene_of(
        moving((0, "translation", [0, 1], values), (1, "translation", [0, 1], values), nodes=nodes), tmp_path
    )
    camera, light = gs.PerspectiveCamera((9, 9, 9), (0, 0, 0)), gs.PointLight(position=(0, 9, 0))
    own = replace(scene, nodes=(replace(scene.nodes[1], casts=False),), camera=camera, lights=(light,))
    now = own.at(0.5)
    assert [(node.name, node.casts, node.world_from_mesh[2, 3]) for node in now.nodes] == [("b", False, 2.0)]
    assert (now.camera, now.lights) == (camera, (light,))


def test_camera_and_lights_follow_their_nodes(tmp_path: Path) -> None:
    lens = {"type": "perspective", "perspective": {"yfov": 1.0, "znear": 0.1}}
    nodes = [{"mesh": 0}, {"camera": 0, "translation": [0, 0, 5]}]
    nodes.append({"extensions": {"KHR_lights_punctual": {"light": 0}}, "translation": [0, 3, 0]})
    file = moving(
        (1, "translation", [0, 2], [[0, 0, 5], [4, 0, 5]]),
        (2, "translation", [0, 2], [[0, 3, 0], [0, 7, 0]]),
        nodes=nodes,
    )
    file.json |= {
        "cameras": [lens],
        "extensions": {"KHR_lights_punctual": {"lights": [{"type": "point", "intensity": 2}]}},
    }
    scene = scene_of(file, tmp_path)
    now = scene.at(1.0)
    assert now.camera.position == (2.0, 0.0, 5.0)
    assert now.lights[0].position == (0.0, 5.0, 0.0)
    assert now.lights[0].intensity == 2
    assert now.lights[0].photometric
    # exposed by the light of the scene at rest: an animation does not flicker
    level = metered(scene, scene.lights, "scene")
    assert level is not None
    assert metered(now, now.lights, "scene") == level == metered(now.at(2.0), now.at(2.0).lights, "scene")
    own = tuple(replace(light, position=(0.0, 5.5, 0.0)) for light in now.lights)
    assert metered(now, own, "scene") != level
    assert scene.framed([0, 1]).camera is scene.camera
    up = scene_of(file, tmp_path, up_axis="z").at(1.0)
    np.testing.assert_allclose(up.camera.position, (2, 5, 0), atol=EXACT)
    np.testing.assert_allclose(up.lights[0].position, (0, 0, -5), atol=EXACT)
    assert scene.at(1.0).at(0.0).camera == scene.camera


def test_loading_at_a_time_equals_at(tmp_path: Path) -> None:
    file = arm()
    for axis in (None, "z"):
        now = scene_of(file, tmp_path, up_axis=axis).at(0.75)
        loaded = scene_of(file, tmp_path, up_axis=axis, time=0.75)
        np.testing.assert_array_equal(loaded.nodes[0].mesh.positions, now.nodes[0].mesh.positions)
        np.testing.assert_array_equal(loaded.nodes[0].world_from_mesh, now.nodes[0].world_from_mesh)
        np.testing.assert_array_equal(gs.load(scene_of(file, tmp_path), up_axis=axis, time=0.75).bounds, now.bounds)
    with pytest.warns(GlshadowWarning, match="2 s is outside its animation, which lasts 1 s: it stands still"):
        late = scene_of(file, tmp_path, time=2)
    np.testing.assert_array_equal(late.bounds, scene_of(file, tmp_path).at(1.0).bounds)


def test_several_animations(tmp_path: Path) -> None:
    """One moves the node, the other the camera's; each leaves the other's nodes at rest."""
    nodes = [{"mesh": 0}, {"mesh": 0}]
    file = Glb(nodes=nodes)
    file.mesh({"attributes": {"POSITION": file.add(FACE)}})
    animate(file, (0, "translation", [0, 1], [[0, 0, 0], [1, 0, 0]]), name="walk")
    animate(file, (1, "translation", [0, 4], [[0, 0, 0], [0, 8, 0]]), name="jump")
    animate(file, (1, "translation", [0, 2], [[0, 0, 0], [0, 0, 0]]), name="walk")
    scene = scene_of(file, tmp_path)
    assert scene.animations == {"walk": 1.0, "jump": 4.0, "walk.2": 2.0}

    def moved(now: gs.Scene) -> list[float]:
        return [float(now.nodes[0].world_from_mesh[0, 3]), float(now.nodes[1].world_from_mesh[1, 3])]

    assert moved(scene.at(1)) == [1, 0]
    jump = scene.at(1).at(1, "jump")
    assert moved(jump) == moved(scene.at(1, 1)) == [0, 2]
    assert jump.duration == 4.0
    assert moved(jump.at(2)) == [0, 4]  # the same animation from then on
    assert moved(jump.at(1, "walk")) == [1, 0]
    assert scene_of(file, tmp_path, animation="jump").duration == 4.0
    for wrong in ("run", 3, -1, True, 1.5):
        with pytest.raises(SceneError, match=r"no animation is .*; there are 3: 'walk', 'jump', 'walk.2'"):
            scene.at(0, wrong)  # type: ignore[arg-type]


def test_scenes_without_animation(tmp_path: Path) -> None:
    scene = scene_of(moving(nodes=[{"mesh": 0}]), tmp_path)
    assert (scene.duration, scene.animations, scene.motion) == (0.0, {}, None)
    assert scene.at(3.0) is scene
    with pytest.raises(SceneError, match="has no animation"):
        scene.at(0.0, "walk")
    for wrong in (np.nan, np.inf, "1", None):
        with pytest.raises(SettingsError, match="seconds must be"):
            scene.at(wrong)  # type: ignore[arg-type]
    with pytest.warns(GlshadowWarning, match="it has no animation: it looks the same at all times"):
        scene_of(moving(nodes=[{"mesh": 0}]), tmp_path, time=1.0)


def test_framed_keeps_the_whole_motion_in_view(tmp_path: Path) -> None:
    """The triangle falls by 10 and moves 30 aside; the ground is below its lowest place, and every corner is inside the image."""
    file = moving((0, "translation", [0, 1], [[0, 0, 0], [30, -10, 0]]))
    times = [0.0, 0.25, 0.5, 1.0]
    scene = scene_of(file, tmp_path, ground=True).framed(times)
    assert [node.name for node in scene.nodes] == ["node0", "ground"]
    assert float(scene.nodes[1].world_from_mesh[1, 3]) == -10.0
    for seconds in times:
        now = scene.at(seconds)
        assert now.camera is scene.camera
        clip = np.c_[corners(now), np.ones(3)] @ clip_from_world(scene.camera).T
        assert (np.abs(clip[:, :2]) <= clip[:, 3:]).all()
    bare = scene_of(file, tmp_path).framed(times)
    assert [node.name for node in bare.nodes] == ["node0"]
    assert bare.framed([]) is bare


def clip_from_world(camera: Any) -> Array:
    """Of a square image, without depth."""
    eye, target = np.asarray(camera.position), np.asarray(camera.target)
    back = (eye - target) / np.linalg.norm(eye - target)
    right = np.cross(camera.up, back)
    right /= np.linalg.norm(right)
    axes = np.stack([right, np.cross(back, right), back])
    scale = 1.0 / np.tan(np.radians(camera.fov_y) / 2)
    rows = np.zeros((4, 4))
    rows[:2, :3], rows[:2, 3] = scale * axes[:2], -scale * axes[:2] @ eye
    rows[3, :3], rows[3, 3] = -back, back @ eye
    return rows


def test_instances_move_with_their_node(tmp_path: Path) -> None:
    file = moving((0, "translation", [0, 1], [[0, 0, 0], [0, 6, 0]]))
    places = {"TRANSLATION": file.add([[1.0, 0, 0], [2, 0, 0]])}
    file.json["nodes"][0]["extensions"] = {"EXT_mesh_gpu_instancing": {"attributes": places}}
    now = scene_of(file, tmp_path).at(0.5)
    assert [node.world_from_mesh[:3, 3].tolist() for node in now.nodes] == [[1, 3, 0], [2, 3, 0]]


@pytest.mark.parametrize("keys", [(0, 1), (1, 0)])
def test_what_vanishes_is_not_seen(tmp_path: Path, renderer: gs.Renderer, keys: tuple[int, int]) -> None:
    """A file of one node that grows from nothing, or shrinks to it: an image without it, not an error in the middle of a video."""
    values = [[key] * 3 for key in keys]
    file = moving((0, "scale", [0, 1], values), nodes=[{"mesh": 0, "translation": [3, 2, 1]}])
    scene = scene_of(file, tmp_path).framed([0.0, 1.0])
    seen = scene.at(float(keys.index(1)))
    assert np.array_equal(corners(seen), FACE + np.array([3, 2, 1]))
    gone = scene.at(float(keys.index(0)))
    assert np.array_equal(gone.bounds.mean(axis=0).round(6), (3, 2, 1))
    assert np.array_equal(corners(gone.at(float(keys.index(1)))), corners(seen))
    outputs = ("alpha",)
    assert renderer.render(seen, size=(32, 24), samples=1, outputs=outputs).alpha.any()
    with pytest.warns(GlshadowWarning, match="nothing is in view"):
        assert not renderer.render(gone, size=(32, 24), samples=1, outputs=outputs).alpha.any()


def test_nothing_to_see_at_rest(tmp_path: Path) -> None:
    file = moving((0, "scale", [0, 1], [[1, 1, 1], [2, 2, 2]]), nodes=[{"mesh": 0, "scale": [0, 0, 0]}])
    with pytest.warns(
        GlshadowWarning, match="nothing can be seen of the pose of its nodes: it is shown at the beginning"
    ):
        scene = scene_of(file, tmp_path)
    np.testing.assert_array_equal(corners(scene), FACE)
    np.testing.assert_array_equal(corners(scene.at(1.0)), 2 * FACE)


# -- hostile files

BROKEN = {
    "nan times": ([np.nan, 1], "key times that are not finite"),
    "unordered times": ([1, 0], "not in ascending order"),
    "too few values": ([0, 1, 2], "2 values for 3 key times"),
}


@pytest.mark.parametrize("case", BROKEN)
def test_broken_channels_are_left_out_by_name(tmp_path: Path, case: str) -> None:
    times, said = BROKEN[case]
    file = moving((0, "translation", times, [[0, 0, 0], [9, 9, 9]]), (0, "scale", [0, 1], [[1, 1, 1], [2, 2, 2]]))
    with pytest.warns(GlshadowWarning, match=rf"1 animation channel\(s\) left out: animation 'animation0'.*{said}"):
        scene = scene_of(file, tmp_path)
    np.testing.assert_array_equal(corners(scene.at(1.0)), 2 * FACE)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"target": {"node": 99, "path": "scale"}}, r"refers to nodes\[99\]"),
        ({"target": {"node": "0", "path": "scale"}}, r"refers to nodes\['0'\]"),
        ({"target": {"path": "scale"}}, "no node is named"),
        ({"target": {"node": 0, "path": "colour"}}, "it animates 'colour', which is unknown"),
        ({"target": {"node": 0, "path": ["scale"]}}, "which is unknown"),
        ({"target": 3}, "a target must be an object"),
        ({"sampler": 9}, "it has no sampler 9"),
        ({"sampler": None}, "it has no sampler None"),
        ({"target": {"node": 1, "path": "scale"}}, r"nodes\[1\] has a matrix"),
        ({"target": {"path": "pointer"}}, "KHR_animation_pointer to 'None'"),
        (
            {
                "target": {
                    "path": "pointer",
                    "extensions": {"KHR_animation_pointer": {"pointer": "/materials/0/alphaCutoff"}},
                }
            },
            "KHR_animation_pointer to '/materials/0/alphaCutoff', which stays as it is",
        ),
    ],
)
def test_channels_to_what_is_not_there(tmp_path: Path, change: dict[str, Any], said: str) -> None:
    nodes: list[dict[str, Any]] = [{"mesh": 0}, {"matrix": np.eye(4).ravel().tolist()}]
    file = moving((0, "scale", [0, 1], [[1, 1, 1], [2, 2, 2]]), nodes=nodes)
    file.json["animations"][0]["channels"][0] |= change
    with pytest.warns(GlshadowWarning, match=said):
        scene = scene_of(file, tmp_path)
    assert scene.animations == {}


@pytest.mark.parametrize(
    ("values", "sampler", "said"),
    [
        ([[1, 1, 1], [np.inf, 1, 1]], {}, "values that are not finite"),
        ([[1, 1], [2, 2]], {}, "must be VEC3"),
        ([[1, 1, 1], [2, 2, 2]], {"interpolation": "BEZIER"}, "the interpolation 'BEZIER' is unknown"),
        ([[1, 1, 1], [2, 2, 2]], {"interpolation": "CUBICSPLINE"}, "2 values for 2 key times"),
    ],
)
def test_broken_samplers(tmp_path: Path, values: Any, sampler: dict[str, Any], said: str) -> None:
    with pytest.warns(GlshadowWarning, match=said):
        assert scene_of(moving((0, "scale", [0, 1], values), **sampler), tmp_path).duration == 0.0


def test_rotations_of_length_zero(tmp_path: Path) -> None:
    file = moving((0, "rotation", [0, 1], [[0, 0, 0, 0], [0, 0, 0, 1]]))
    with pytest.warns(GlshadowWarning, match="rotations of length zero"):
        assert scene_of(file, tmp_path).animations == {}
    spline = np.zeros((6, 4))
    spline[1], spline[4] = (0, 0, 0, 1), (0, 0, 0, -1)
    scene = scene_of(moving((0, "rotation", [0, 1], spline), interpolation="CUBICSPLINE"), tmp_path)
    with pytest.raises(SceneError, match=r"nodes\[0\]: its rotation .* is not a quaternion"):
        scene.at(0.5)


def test_many_keys_in_a_small_file(tmp_path: Path) -> None:
    """1 kB that declares 2^26 keys without data: refused by the limits before anything is made, in no time."""
    file = moving()
    file.json["animations"] = [
        {
            "samplers": [{"input": file.declare(2**26, "SCALAR"), "output": file.declare(2**26, "VEC3")}],
            "channels": [{"sampler": 0, "target": {"node": 0, "path": "scale"}}],
        }
    ]
    path = file.save(tmp_path / "keys.glb")
    assert path.stat().st_size < 2048
    began = time.monotonic()
    with pytest.raises(SceneError, match=r"keys.glb: animation 'animation0'.input: .*the limit is 200"):
        gs.load(path)
    assert time.monotonic() - began < 1.0


def test_overflow_at_a_time_is_named(tmp_path: Path) -> None:
    nodes = [{"mesh": 0, "scale": [1e30] * 3}, {"children": [0]}, {"mesh": 0}]
    file = moving((1, "scale", [0, 1], [[1e-30] * 3, [3e38] * 3]), nodes=nodes)
    scene = scene_of(file, tmp_path, time=0.0)
    with pytest.raises(SceneError):
        scene.at(1.0)
