"""Scenes from meshes alone: defaults of a node, unique names, and the effect of a ground on bounds."""

from __future__ import annotations

import numpy as np
import pytest

import glshadow as gs
from glshadow.scenes import shapes


def block(size: float = 1.0) -> gs.Mesh:
    positions, triangles = shapes.box((size,) * 3)
    return gs.Mesh(positions, triangles)


def test_node_and_scene_need_only_a_mesh() -> None:
    mesh = block()
    node = gs.Node(mesh)
    np.testing.assert_array_equal(node.world_from_mesh, np.eye(4))
    scene = gs.Scene([mesh, node])
    assert [each.mesh for each in scene.nodes] == [mesh, mesh]
    assert [each.name for each in scene.nodes] == ["node", "node 2"]
    with pytest.raises(gs.SceneError, match=r"nodes\[1\] must be Node"):
        gs.Scene([mesh, "mesh"])  # type: ignore[list-item]


def test_numbered_names_avoid_given_ones() -> None:
    mesh = block()
    given = [gs.Node(mesh, name=name) for name in ("a", "a 2", "a", "b", "a", "a 2")]
    scene = gs.Scene(given)
    assert [node.name for node in scene.nodes] == ["a", "a 2", "a 3", "b", "a 4", "a 2 2"]
    assert [node.name for node in given] == ["a", "a 2", "a", "b", "a", "a 2"]  # names that other nodes have as well
    moved = scene.moved({"a 3": np.diag([2.0, 2.0, 2.0, 1.0])})
    assert [node.world_from_mesh[0, 0] for node in moved.nodes] == [1.0, 1.0, 2.0, 1.0, 1.0, 1.0]


def test_bounds_exclude_the_ground_but_extent_includes_it() -> None:
    bare = gs.Scene([block()])
    scene = bare.with_ground()
    np.testing.assert_array_equal(scene.bounds, bare.bounds)
    assert (scene.extent[0, [0, 2]] < bare.extent[0, [0, 2]]).all()
    np.testing.assert_array_equal(gs.Scene([scene.nodes[-1]]).bounds, gs.Scene([scene.nodes[-1]]).extent)


def test_render_adds_a_ground_to_any_scene() -> None:
    scene = gs.Scene([block()])
    frame = gs.render(scene, size=(32, 24), ground=True, outputs="node")
    assert [node.name for node in frame.scene.nodes] == ["node", "ground"]
    assert (frame.node == 1).any()


def test_load_takes_meshes_nodes_and_lists_of_them() -> None:
    mesh = block()
    for source in (mesh, gs.Node(mesh), [mesh, gs.Node(mesh)], (mesh,)):
        assert all(node.mesh is mesh for node in gs.load(source, look="plain").nodes)
    with pytest.raises(gs.SceneError, match=r"nodes\[1\] must be Node"):
        gs.load([mesh, "mesh"])
