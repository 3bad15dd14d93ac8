"""Nodes that exactly coincide with others are not drawn, and meshes of the same arrays share GPU buffers."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

import glshadow as gs
from glshadow.core.spaces import translation
from glshadow.frame import Frame
from glshadow.geometry.adjacency import NONE
from glshadow.gl.scene.meshes import Shape
from glshadow.renderer import Renderer
from glshadow.scene.mesh import AlphaMode, Material, Mesh
from glshadow.scene.nodes import Node, Scene
from glshadow.scenes import shapes

SIZE = (96, 64)
CAMERA = gs.PerspectiveCamera((2.0, 3.0, 4.0), (0.0, 0.3, 0.0))
SUN = gs.DirectionalLight(direction=(-0.4, -1.0, -0.3))
OUTPUTS = ("image", "visibility", "triangle", "depth", "shadow_maps")


def parts() -> tuple[Node, Node]:
    ground = Mesh(*shapes.rectangle((-3.0, 0.0, 3.0), (6.0, 0.0, 0.0), (0.0, 0.0, -6.0)))
    box = Mesh(*shapes.box((1.0, 1.0, 1.0), (0.0, 0.5, 0.0)), material=Material((1.0, 0.5, 0.2, 1.0)))
    return Node(ground, np.eye(4), "ground"), Node(box, np.eye(4), "box")


def drawn(renderer: Renderer, *nodes: Node) -> Frame:
    return renderer.render(Scene(nodes, CAMERA), lights=[SUN], size=SIZE, outputs=OUTPUTS, samples=1)


def assert_same(one: Frame, other: Frame) -> None:
    for name in ("image", "visibility", "triangle", "depth"):
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name), err_msg=name)
    np.testing.assert_array_equal(one.shadow_maps[0], other.shadow_maps[0])


def test_duplicate_nodes_change_nothing(renderer: Renderer) -> None:
    """No pixel changes, whether duplicates share the mesh or only its triangles, in another colour; and they are not drawn."""
    ground, box = parts()
    blue = replace(box.mesh, material=Material((0.0, 0.0, 1.0, 1.0)))
    alone = drawn(renderer, ground, box)
    again = drawn(renderer, ground, box, replace(box, name="again"), Node(blue, np.eye(4), "blue"))
    assert_same(alone, again)
    assert again.used[0].draws == alone.used[0].draws
    assert renderer._cache.scene.thing is not None
    assert renderer._cache.scene.thing.copies.tolist() == [False, False, True, True]


def test_different_nodes_are_no_duplicates(renderer: Renderer) -> None:
    ground, box = parts()
    mask = Material((1.0, 1.0, 1.0, 0.2), alpha_mode=AlphaMode.MASK)
    others = (
        Node(box.mesh, translation((1.5, 0.0, 0.0)), "moved"),
        replace(box, name="casts nothing", casts=False),
        replace(box, name="receives nothing", receives=False),
        Node(replace(box.mesh, material=mask), np.eye(4), "cut out"),
        Node(replace(box.mesh, material=Material(alpha_mode=AlphaMode.BLEND)), np.eye(4), "blended"),
        Node(Mesh(box.mesh.positions.copy(), box.mesh.triangles), np.eye(4), "equal, not the same"),
    )
    drawn(renderer, ground, box, *others)
    assert renderer._cache.scene.thing is not None
    copies = dict(
        zip(
            (node.name for node in renderer._cache.scene.thing.nodes),
            renderer._cache.scene.thing.copies.tolist(),
            strict=True,
        )
    )
    assert copies.pop("blended")  # of a node that does not cast either
    assert not any(copies.values()), copies


def test_duplicate_behind_a_cut_out_node_is_drawn(renderer: Renderer) -> None:
    ground, box = parts()
    hole = Node(replace(box.mesh, material=Material((1, 1, 1, 0.2), alpha_mode=AlphaMode.MASK)), np.eye(4), "hole")
    seen = drawn(renderer, ground, hole, box).triangle
    assert seen is not None
    assert (seen >= 2 + 12).any()


def test_meshes_of_the_same_arrays_share_buffers_and_textures() -> None:
    picture = np.full((4, 4, 4), 200, dtype=np.uint8)
    positions, triangles = shapes.box((1.0, 1.0, 1.0))
    positions, triangles = np.ascontiguousarray(positions), np.ascontiguousarray(triangles, dtype=np.int32)
    uv = np.zeros((len(positions), 2), dtype=np.float32)
    colors = ((1.0, 0.0, 0.0, 1.0), (0.0, 1.0, 0.0, 1.0))
    meshes = [Mesh(positions, triangles, uv=uv, material=Material(color, picture)) for color in colors]
    nodes = [Node(mesh, translation((2.0 * k, 0.0, 0.0)), str(k)) for k, mesh in enumerate(meshes)]
    with Renderer("egl") as renderer:
        drawn(renderer, *nodes)
        one, other = (renderer._cache.meshes.get(mesh) for mesh in meshes)
        assert one.shape is other.shape
        assert one.texture is other.texture
        first, position = nodes[1], one.shape.positions
        del meshes, nodes[0], one
        for _ in range(2):  # buffers of a deleted mesh are freed after the next frame
            alone = drawn(renderer, first)
        assert position.size > 0  # not freed: the other mesh uses it
        assert alone.image.any()


def test_adjacency_follows_the_float32_positions() -> None:
    """A crack of 1e-12 exists in float64 only: on the GPU the triangles are neighbours, and the mesh is open all the same."""
    positions, triangles = shapes.box((1.0, 1.0, 1.0))
    apart = positions[triangles].reshape(-1, 3)
    apart[:3] += 1e-12
    corners = np.arange(len(apart)).reshape(-1, 3)
    whole, cracked = Mesh(positions[triangles].reshape(-1, 3), corners), Mesh(apart, corners)
    assert (cracked.neighbours == NONE).any()
    with Renderer("egl") as renderer, renderer._context.drawing():
        shape = Shape(renderer._context, cracked)
        np.testing.assert_array_equal(shape.neighbours, whole.neighbours)
        assert not shape.closed
        shape.release()
