"""Skins at rest: vertices transformed by the joints of the file's nodes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from glshadow.core.spaces import Array, translation
from glshadow.errors import GlshadowWarning, SceneError
from glshadow.io.load import load
from glshadow.scene.mesh import Mesh
from glshadow.scene.nodes import Scene
from glshadow.scenes import shapes

from .glb import Glb

HALF_TURN_X = [-np.sqrt(0.5), 0.0, 0.0, np.sqrt(0.5)]  # quaternion: -90 degrees about x, z becomes y
BAR = np.array([[0.0, 0, 0], [0, 2, 0], [1, 1, 0]])


def arm(
    joints: Any, weights: Any, nodes: list[dict[str, Any]], skin: dict[str, Any] | None = None, **attributes: Any
) -> Glb:
    """The triangle BAR on node 0, skinned by joints 1 and 2; arrays among the attributes become accessors."""
    file = Glb(nodes=[{"mesh": 0, "skin": 0, "name": "body", "translation": [7, 7, 7], "scale": [3, 3, 3]}, *nodes])
    given = {"POSITION": BAR, **attributes}
    made = {name: file.add(values) for name, values in given.items()}
    for number, (joint, weight) in enumerate(zip(joints, weights, strict=True)):
        made[f"JOINTS_{number}"] = file.add(joint, "uint8")
        made[f"WEIGHTS_{number}"] = file.add(weight)
    file.mesh({"attributes": made})
    bind = np.stack([np.eye(4), translation((0.0, -1.0, 0.0))])
    file.json["skins"] = [{"joints": [1, 2], "inverseBindMatrices": file.add(bind), **(skin or {})}]
    return file


FIRST, SECOND, BOTH = (1, 0, 0, 0), (0, 1, 0, 0), (0.25, 0.75, 0, 0)
JOINTS = [[(0, 1, 0, 0)] * 3]
WEIGHTS = [[FIRST, SECOND, BOTH]]
BENT: list[dict[str, Any]] = [
    {"children": [2], "translation": [10, 0, 0]},
    {"translation": [0, 1, 0], "rotation": [0, 0, np.sqrt(0.5), np.sqrt(0.5)]},  # a quarter turn about z
]


def bent() -> Array:
    """BAR by hand: the second joint rotates about (10, 1, 0)."""
    first = np.add(BAR, (10, 0, 0))
    up = BAR - (0, 1, 0)
    second = np.add(np.stack([-up[:, 1], up[:, 0], up[:, 2]], axis=1), (10, 1, 0))
    return np.stack([first[0], second[1], 0.25 * first[2] + 0.75 * second[2]])


def the_mesh(scene: Scene) -> Mesh:
    (node,) = scene.nodes
    np.testing.assert_array_equal(node.world_from_mesh, np.eye(4))  # its own transform is ignored
    return node.mesh


def test_vertices_follow_their_joints(tmp_path: Path) -> None:
    scene = load(arm(JOINTS, WEIGHTS, BENT).save(tmp_path / "arm.glb"))
    np.testing.assert_allclose(the_mesh(scene).positions, bent(), atol=1e-6)  # float32 quaternions and weights


def test_normals_follow_their_joints(tmp_path: Path) -> None:
    """A joint that is scaled along y alone tilts the normals of its slopes the other way."""
    stretched: list[dict[str, Any]] = [{}, {"scale": [1, 4, 1]}]
    slope = np.array([[1.0, 1, 0], [1, 1, 0], [1, 1, 0]]) / np.sqrt(2.0)
    file = arm([[(1, 0, 0, 0)] * 3], [[FIRST] * 3], stretched, {"joints": [1, 2]}, NORMAL=slope)
    mesh = the_mesh(load(file.save(tmp_path / "arm.glb")))
    wanted = np.array([4.0, 1.0, 0.0]) / np.sqrt(17.0)  # the inverse transpose, (1, 1 / 4), normalised
    assert mesh.normals is not None
    np.testing.assert_allclose(mesh.normals, np.tile(wanted, (3, 1)), atol=1e-6)


def test_more_than_four_joints(tmp_path: Path) -> None:
    """The same weights in two sets, integers that the file does not mark as normalised."""
    file = arm([[(0, 0, 0, 0)] * 3, [(1, 0, 0, 0)] * 3], [[FIRST] * 3] * 2, BENT)
    attributes = file.json["meshes"][0]["primitives"][0]["attributes"]
    attributes["WEIGHTS_0"] = file.add([(255, 0, 0, 0), (0, 0, 0, 0), (51, 0, 0, 0)], "uint8")
    # 1 to 3, whatever the sum
    attributes["WEIGHTS_1"] = file.add([(0, 0, 0, 0), (255, 0, 0, 0), (153, 0, 0, 0)], "uint8")
    np.testing.assert_allclose(the_mesh(load(file.save(tmp_path / "arm.glb"))).positions, bent(), atol=1e-6)


def person(**body: Any) -> Glb:
    """As Blender exports characters: centimetres with z up, beside an armature that rotates and scales them."""
    positions, triangles = shapes.box((40.0, 40.0, 180.0), (0.0, 0.0, 90.0))
    file = Glb(
        nodes=[
            {"name": "hips"},
            {"name": "Armature", "rotation": HALF_TURN_X, "scale": [0.01] * 3, "children": [0]},
            {"mesh": 0, "skin": 0, "name": "Body", **body},
            {"name": "root", "children": [1, 2]},
        ],
        skins=[{"joints": [0]}],
    )
    attributes = {
        "POSITION": file.add(positions),
        "JOINTS_0": file.add(np.zeros((len(positions), 4)), "uint8"),
        "WEIGHTS_0": file.add(np.tile(FIRST, (len(positions), 1))),
    }
    file.mesh({"attributes": attributes, "indices": file.add(triangles.reshape(-1, 1), "uint32")})
    return file


@pytest.mark.parametrize("hidden", [False, True], ids=["in the scene", "joints outside the scene"])
@pytest.mark.parametrize("body", [{}, {"scale": [100, 100, 100], "translation": [3, 4, 5]}], ids=["still", "moved"])
def test_character_in_centimetres_stands_on_the_ground(tmp_path: Path, body: dict[str, Any], hidden: bool) -> None:
    file = person(**body)
    if hidden:
        file.json["scenes"] = [{"nodes": [2]}]
    bounds = load(file.save(tmp_path / "person.glb")).bounds
    np.testing.assert_allclose(bounds, [[-0.2, 0.0, -0.2], [0.2, 1.8, 0.2]], atol=1e-6)  # float32 scale of 0.01


def test_two_skins_of_one_mesh_are_two_bodies(tmp_path: Path) -> None:
    file = person()
    file.json["nodes"] += [{"mesh": 0, "skin": 1}, {"translation": [5, 0, 0], "scale": [0.01] * 3}]
    file.json["skins"] += [{"joints": [5]}]
    one, other = load(file.save(tmp_path / "two.glb")).nodes
    assert one.mesh is not other.mesh
    np.testing.assert_allclose(other.mesh.bounds.mean(axis=0), (5.0, 0.0, 0.9), atol=1e-5)


def test_skinned_node_without_joint_attributes_stays_in_place(tmp_path: Path) -> None:
    file = person(translation=[0, 1, 0])
    attributes = file.json["meshes"][0]["primitives"][0]["attributes"]
    del attributes["JOINTS_0"], attributes["WEIGHTS_0"]
    with pytest.warns(
        GlshadowWarning, match="1 primitive.* of skinned nodes have no joints: drawn where their node is"
    ):
        (node,) = load(file.save(tmp_path / "person.glb")).nodes
    assert node.world_from_mesh[:3, 3].tolist() == [0, 1, 0]


def test_mesh_with_joints_but_without_skin_follows_its_node(tmp_path: Path) -> None:
    file = person(translation=[0, 1, 0])
    del file.json["nodes"][2]["skin"]
    (node,) = load(file.save(tmp_path / "person.glb")).nodes
    assert node.world_from_mesh[:3, 3].tolist() == [0, 1, 0]
    assert node.mesh.bounds[1].tolist() == [20, 20, 180]


def test_cesium_man_has_the_pose_of_its_nodes(models: Path) -> None:
    """Extents by an independent rule: vertex by vertex, in plain Python, from the file's numbers."""
    from glshadow.io.gltf.accessor import read_floats, read_whole
    from glshadow.io.gltf.document import open_document
    from glshadow.io.limits import Budget

    document = open_document(models / "cesium_man.glb", Budget())
    nodes, skin = document.json["nodes"], document.json["skins"][0]
    parent = {child: k for k, node in enumerate(nodes) for child in node.get("children", ())}

    def world(index: int) -> Array:
        node = nodes[index]
        local = np.reshape(node.get("matrix", np.eye(4)), (4, 4)).T
        if "rotation" in node:
            x, y, z, w = node["rotation"]
            columns = [
                [1 - 2 * (y * y + z * z), 2 * (x * y + z * w), 2 * (x * z - y * w)],
                [2 * (x * y - z * w), 1 - 2 * (x * x + z * z)],
            ]
            columns[1].append(2 * (y * z + x * w))
            columns.append([2 * (x * z + y * w), 2 * (y * z - x * w), 1 - 2 * (x * x + y * y)])
            local = np.eye(4)
            local[:3, :3] = np.transpose(columns) * node.get("scale", 1.0)
            local[:3, 3] = node.get("translation", 0.0)
        return world(parent[index]) @ local if index in parent else local

    attributes = document.json["meshes"][0]["primitives"][0]["attributes"]
    bind = read_floats(document, skin["inverseBindMatrices"], ("MAT4",), "")
    position = read_floats(document, attributes["POSITION"], ("VEC3",), "")
    weights = read_floats(document, attributes["WEIGHTS_0"], ("VEC4",), "")
    assert weights.sum(axis=1).min() < 0.7  # a real file whose weights do not add up to one: they are normalised
    weights /= weights.sum(axis=1, keepdims=True)
    joints = read_whole(document, attributes["JOINTS_0"], ("VEC4",), "")
    matrices = [world(joint) @ bind[k].reshape(4, 4).T for k, joint in enumerate(skin["joints"])]
    some = range(0, len(position), 37)
    by_hand = [
        sum(w * (matrices[j] @ (*position[i], 1.0))[:3] for j, w in zip(joints[i], weights[i], strict=True))
        for i in some
    ]
    mesh = the_mesh(load(models / "cesium_man.glb"))
    np.testing.assert_allclose(mesh.positions[list(some)], by_hand, atol=2e-6)  # the weights' float32 sum
    assert mesh.bounds[0, 1] == pytest.approx(0.0, abs=1e-3)


@pytest.mark.parametrize(
    ("joints", "weights", "skin", "said"),
    [
        ([[(0, 2, 0, 0)] * 3], WEIGHTS, {}, "joint 2 is out of range, its skin has 2 joints"),
        (JOINTS, [[FIRST, (np.nan, 0, 0, 0), FIRST]], {}, "1 of 3 vertices have joint weights that are not finite"),
        (JOINTS, [[FIRST, (np.inf, 0, 0, 0), FIRST]], {}, "1 of 3 vertices have joint weights that are not finite"),
        (JOINTS, WEIGHTS, {"joints": []}, "joints must be an array of nodes"),
        (JOINTS, WEIGHTS, {"joints": [1, 99]}, r"skins\[0\].joints refers to nodes\[99\]"),
        (JOINTS, WEIGHTS, {"joints": [1, 2, 0]}, "2 inverse bind matrices for 3 joints"),
        (JOINTS, WEIGHTS, {"inverseBindMatrices": 0}, "must be MAT4"),
        (JOINTS, WEIGHTS, {"inverseBindMatrices": 99}, r"accessors\[99\]"),
    ],
)
def test_broken_skins_are_refused(tmp_path: Path, joints: Any, weights: Any, skin: dict[str, Any], said: str) -> None:
    with pytest.raises(SceneError, match=said):
        load(arm(joints, weights, BENT, skin).save(tmp_path / "arm.glb"))


def test_more_broken_skins_are_refused(tmp_path: Path) -> None:
    for changes, said in (
        ({"nodes": [{"mesh": 0, "skin": 1}]}, r"refers to skins\[1\]"),
        (
            {"nodes": [{"mesh": 0, "skin": 0}, {"scale": [1e308] * 3, "children": [2]}, {"scale": [1e308] * 3}]},
            "overflows",
        ),
    ):
        file = arm(JOINTS, WEIGHTS, BENT)
        file.json.update(changes)
        with pytest.raises(SceneError, match=said):
            load(file.save(tmp_path / "arm.glb"))
    file = arm(JOINTS, WEIGHTS, BENT)
    file.json["skins"][0]["inverseBindMatrices"] = file.add(np.full((2, 4, 4), np.nan))
    with pytest.raises(SceneError, match="2 of 2 inverse bind matrices are not finite"):
        load(file.save(tmp_path / "arm.glb"))
    file = arm(JOINTS, WEIGHTS, BENT)
    file.json["meshes"][0]["primitives"][0]["attributes"]["JOINTS_0"] = file.add([(0, 0, 0, 0)] * 3)
    with pytest.raises(SceneError, match="JOINTS_0 must be unsigned integers, got float32"):
        load(file.save(tmp_path / "arm.glb"))


def test_odd_skins_are_accepted(tmp_path: Path) -> None:
    """A joint out of range with zero weight, no weights at all, a joint of zero scale: no reason to refuse a file."""
    unused = arm([[(0, 1, 77, 0)] * 3], WEIGHTS, BENT)
    np.testing.assert_allclose(the_mesh(load(unused.save(tmp_path / "a.glb"))).positions, bent(), atol=1e-6)
    with pytest.warns(GlshadowWarning, match="1 of 3 vertices have no joint weights: they follow the first joint"):
        loose = the_mesh(load(arm(JOINTS, [[FIRST, (0, 0, 0, 0), FIRST]], BENT).save(tmp_path / "b.glb")))
    np.testing.assert_allclose(loose.positions, np.add(BAR, (10, 0, 0)))
    spread = [(0.5, 0.5, 0, 0), FIRST, BOTH]
    flat = arm(JOINTS, [spread], [{}, {"scale": [0, 0, 0]}], NORMAL=np.tile((0.0, 0, 1), (3, 1)))
    mesh = the_mesh(load(flat.save(tmp_path / "c.glb")))
    np.testing.assert_allclose(mesh.positions, [[0, 0, 0], [0, 2, 0], [0.25, 0.25, 0]])
    assert mesh.normals is not None
    np.testing.assert_allclose(mesh.normals, np.tile((0.0, 0, 1), (3, 1)))


def test_without_inverse_bind_matrices_joints_place_vertices_directly(tmp_path: Path) -> None:
    file = arm([[(1, 0, 0, 0)] * 3], [[FIRST] * 3], BENT)
    del file.json["skins"][0]["inverseBindMatrices"]
    mesh = the_mesh(load(file.save(tmp_path / "arm.glb")))
    np.testing.assert_allclose(
        mesh.positions, np.add(np.stack([-BAR[:, 1], BAR[:, 0], BAR[:, 2]], axis=1), (10, 1, 0)), atol=1e-6
    )


def test_vertices_by_blocks_are_the_same(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from glshadow.io.gltf import skin

    monkeypatch.setattr(skin, "BLOCK", 2)
    np.testing.assert_allclose(
        the_mesh(load(arm(JOINTS, WEIGHTS, BENT).save(tmp_path / "arm.glb"))).positions, bent(), atol=1e-6
    )
