"""Many nodes with one mesh: instanced drawing gives the same image as drawing each by itself."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import glshadow as gs
from glshadow.core.spaces import transform, translation
from glshadow.geometry.adjacency import NONE
from glshadow.gl.scene import drawing, runs
from glshadow.renderer import Renderer
from glshadow.scene.mesh import AlphaMode, Material, Mesh
from glshadow.scene.nodes import Node, Scene
from glshadow.scenes import shapes

OUTPUTS = ("image", "visibility", "triangle", "node", "normal")


def crowds() -> Scene:
    """Balls with smooth normals, cards with holes and open rectangles, rotated, stretched, mirrored, and two that only cast."""
    random = np.random.default_rng(8)
    positions, triangles = shapes.icosphere(1, 0.4)
    texture = np.full((8, 8, 4), 255, dtype=np.uint8)
    texture[2:6, 2:6, 3] = 0
    card = shapes.rectangle((-0.4, -0.4, 0.0), (0.8, 0.0, 0.0), (0.0, 0.8, 0.0))
    uv = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], dtype=np.float32)
    meshes = (
        Mesh(
            positions, triangles, normals=(positions / 0.4).astype(np.float32), material=Material((0.8, 0.4, 0.3, 1.0))
        ),
        Mesh(*card, uv=uv, material=Material(texture=texture, alpha_mode=AlphaMode.MASK)),
        Mesh(*card),
    )
    nodes = []
    for k in range(60):
        matrix = translation(random.uniform((-4.0, 0.3, -4.0), (4.0, 2.5, 4.0)))
        matrix[:3, :3] = np.linalg.qr(random.normal(size=(3, 3)))[0] * random.uniform(0.5, 1.5, 3)
        nodes.append(Node(meshes[k % 3], matrix, f"{k}", receives=k != 4, catches=k in (7, 8)))
    return Scene(tuple(nodes), gs.PerspectiveCamera((5.0, 5.0, 7.0), (0.0, 0.5, 0.0)), name="crowds").with_ground()


@pytest.mark.parametrize("samples", [1, 4])
def test_instanced_drawing_equals_separate_draws(monkeypatch: pytest.MonkeyPatch, samples: int) -> None:
    monkeypatch.setattr(runs, "AT_ONCE", 200)  # triangles: two balls per draw
    frames = []
    for many in (8, 1000):
        monkeypatch.setattr(drawing, "_MANY", many)
        with Renderer("egl") as renderer:
            frames.append(renderer.render(crowds(), size=(160, 100), samples=samples, outputs=OUTPUTS))
    for name in OUTPUTS:
        np.testing.assert_array_equal(getattr(frames[0], name), getattr(frames[1], name), err_msg=name)
    assert len(np.unique(frames[0].node)) > 40


def test_separate_draws_after_instances_test_rays_against_the_right_triangles(monkeypatch: pytest.MonkeyPatch) -> None:
    """A node by itself, twelve instances that are drawn together, then more nodes by themselves, with the first one's program."""
    random = np.random.default_rng(3)
    culls = Material(cull_back_faces=True)
    one, few, many = (Mesh(*shapes.icosphere(level, 0.4), material=culls) for level in (2, 1, 4))
    nodes = [Node(one, translation((0.0, 0.5, 0.0)), "first")]
    for k in range(18):
        matrix = translation(random.uniform((-3.0, 0.3, -3.0), (3.0, 2.5, 3.0)))
        matrix[0, 0] = -1.0 if k >= 12 and k % 2 else 1.0
        nodes.append(Node(few if k < 12 else many, matrix, f"{k}"))
    scene = Scene(tuple(nodes), gs.PerspectiveCamera((5.0, 5.0, 7.0), (0.0, 0.5, 0.0)), name="two meshes").with_ground()
    frames = []
    for least in (8, 1000):
        monkeypatch.setattr(drawing, "_MANY", least)
        with Renderer("egl") as renderer:
            frames.append(renderer.render(scene, size=(320, 200), samples=1, outputs=OUTPUTS))
    for name in OUTPUTS:
        np.testing.assert_array_equal(getattr(frames[0], name), getattr(frames[1], name), err_msg=name)


def test_small_texture_buffer_splits_instanced_draws() -> None:
    """A buffer that holds the matrices of nine nodes of twenty."""
    scene = crowds()
    with Renderer("egl") as renderer:
        expected = renderer.render(scene, size=(160, 100), outputs=("triangle", "image"), samples=1)
        caps = renderer._context.caps
        renderer._cache.seen = None
        renderer._context.caps = replace(caps, max_texture_buffer_size=7 * 9)
        again = renderer.render(scene, size=(160, 100), outputs=("triangle", "image"), samples=1)
    np.testing.assert_array_equal(again.triangle, expected.triangle)
    np.testing.assert_array_equal(again.image, expected.image)


def test_batched_planes_and_adjacency_equal_those_of_each_node() -> None:
    """Planes and adjacency of small meshes, large meshes and instances between them, against each node's own float64."""
    scene = crowds()
    with Renderer("egl") as renderer:
        renderer.render(scene, size=(16, 16), samples=1)
        gpu = renderer._cache.scene.thing
        with renderer._context.drawing():
            planes = np.frombuffer(gpu.planes.buffer.read(), np.float32).reshape(-1, 4)
            across = np.frombuffer(gpu.world.neighbours.buffer.read(), np.uint32).reshape(-1, 4)[:, :3]
    for node, first in zip(gpu.nodes, gpu.first.tolist(), strict=True):
        rows = slice(first, first + len(node.mesh.triangles))
        a, b, c = (transform(node.world_from_mesh, node.mesh.positions[node.mesh.triangles[:, k]]) for k in range(3))
        normal = np.cross(b - a, c - a) * np.sign(np.linalg.det(node.world_from_mesh[:3, :3]))
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        expected = np.column_stack([normal, (normal * (a - gpu.origin)).sum(axis=1)])
        # vertices are float32: a unit in the last place of 0.4 over edges of 0.2, and of places up to 20
        np.testing.assert_allclose(planes[rows], expected, atol=2e-6)
        own = node.mesh.neighbours
        np.testing.assert_array_equal(across[rows], np.where(own == NONE, NONE, own + np.uint32(first)))
