"""Who darkens: closed forms, Embree's own first hit, every triangle in float64, and the scene without the named node."""

from __future__ import annotations

import numpy as np
import pytest

import glshadow as gs
from glshadow.core.spaces import Array, world_positions

from ..outlines.solids import box, sheet, torus

DOWN = gs.DirectionalLight(direction=(0.0, -1.0, 0.0))
SLANT = gs.DirectionalLight(direction=(-1.0, -2.0, 0.5))
NEAR = gs.PointLight(position=(1.1, 5.0, 1.6))
SIZE = (96, 72)


def several() -> gs.Scene:
    nodes = [
        gs.Node(box((-1, 0.5, -1), (1, 1, 1)), name="low"),
        gs.Node(torus(1.2, 0.3, 2.5), name="ring"),
        gs.Node(box((-0.4, 3, -0.4), (0.4, 3.5, 0.4)), name="high"),
    ]
    camera = gs.PerspectiveCamera((4.0, 6.0, 7.0), (0.0, 1.0, 0.0), fov_y=50.0)
    floor = gs.Node(sheet([(-6, 0, 6), (6, 0, 6), (6, 0, -6), (-6, 0, -6)]), name="floor", ground=True)
    return gs.Scene([*nodes, floor], camera=camera)


def corners(scene: gs.Scene) -> tuple[Array, Array]:
    """Corners (T, 3, 3) of all triangles and their nodes (T,)."""
    parts = [world_positions(n.mesh.positions, n.world_from_mesh, np.zeros(3))[n.mesh.triangles] for n in scene.nodes]
    return np.concatenate(parts), np.repeat(np.arange(len(parts)), [len(each) for each in parts])


def brute(scene: gs.Scene, points: Array, aim: Array, end: Array, own: Array) -> tuple[Array, Array]:
    """Nodes and distances of the first triangles that rays meet, each tested in float64 (Moeller, Trumbore 1997)."""
    triangles, owner = corners(scene)
    a, e, f = triangles[:, 0], triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
    node, nearest = np.full(len(points), -1), np.full(len(points), np.inf)
    for i in range(len(points)):
        p = np.cross(aim[i], f)
        det = (e * p).sum(axis=1)
        safe = np.where(det == 0.0, 1.0, det)
        s = points[i] - a
        u, q = (s * p).sum(axis=1) / safe, np.cross(s, e)
        v, t = (q * aim[i]).sum(axis=1) / safe, (f * q).sum(axis=1) / safe
        hit = (det != 0.0) & (u >= 0) & (v >= 0) & (u + v <= 1) & (t > 1e-6) & (t < end[i] - 1e-6)
        hit &= np.arange(len(a)) != own[i]
        if hit.any():
            k = np.where(hit, t, np.inf).argmin()
            node[i], nearest[i] = owner[k], t[k]
    return node, nearest


def test_the_caster_nearest_to_the_point_is_named_with_its_distance() -> None:
    scene = several()
    points = [(0.0, 0.0, 0.0), (1.2, 0.0, 0.0), (0.0, 1.25, 0.0), (0.0, 3.25, 0.0), (2.0, 0.0, 0.0), (0.0, 9.0, 0.0)]
    found = gs.blockers(scene, points, DOWN)
    names = [scene.nodes[i].name if i >= 0 else None for i in found.node[0]]
    assert names == ["low", "ring", "high", "high", None, None]
    np.testing.assert_allclose(found.distance[0], [0.5, 2.2, 1.75, 0.25, np.inf, np.inf], atol=1e-12)
    owner = corners(scene)[1]
    assert [owner[i] if i >= 0 else -1 for i in found.triangle[0]] == found.node[0].tolist()


@pytest.mark.parametrize("light", [SLANT, NEAR], ids=lambda each: each.spelling)
def test_every_triangle_in_float64_agrees(rng: np.random.Generator, light: gs.Light) -> None:
    scene = several()
    points = rng.uniform((-3, 0, -3), (3, 4, 3), size=(400, 3))
    aim, end = light.to_light(points)
    found = gs.blockers(scene, points, light)
    node, distance = brute(scene, points, aim, end, np.full(400, -1))
    np.testing.assert_array_equal(found.node[0], node)
    np.testing.assert_allclose(found.distance[0], distance, rtol=1e-9)
    assert len(np.unique(node)) == 4  # free, and three nodes


def test_first_hits_are_those_of_embree_itself(rng: np.random.Generator) -> None:
    from embreex.mesh_construction import TriangleMesh
    from embreex.rtcore_scene import EmbreeScene

    scene = several()
    triangles, owner = corners(scene)
    embree = EmbreeScene(robust=True)
    TriangleMesh(embree, triangles.astype(np.float32))
    points = rng.uniform((-3, 0.01, -3), (3, 4, 3), size=(2000, 3))
    aim = np.ascontiguousarray(SLANT.to_light(points)[0])
    first = embree.run(points.astype(np.float32), aim.astype(np.float32))
    expected = np.where(first >= 0, owner[first], -1)
    differ = gs.blockers(scene, points, SLANT).node[0] != expected
    assert differ.mean() < 2e-3  # silhouettes, by float32's rounding


@pytest.mark.parametrize("light", [SLANT, NEAR], ids=lambda each: each.spelling)
def test_image_names_a_blocker_exactly_where_it_is_dark(renderer: gs.Renderer, light: gs.Light) -> None:
    scene = several()
    names = ("visibility", "blocker", "blocker_distance", "node", "position", "normal", "triangle")
    frame = renderer.render(scene, lights=[light, light], size=SIZE, outputs=names, samples=1)
    assert set(frame.outputs) == set(names)
    seen = frame.node >= 0
    dark = frame.visibility[0] == 0.0
    assert (dark & seen).sum() > 300
    assert ((frame.blocker[0] >= 0)[seen] != dark[seen]).sum() <= 2  # silhouettes, by float32's rounding
    np.testing.assert_array_equal(frame.blocker[0], frame.blocker[1])
    assert np.isnan(frame.blocker_distance[:, ~seen]).all()
    assert (frame.blocker[:, ~seen] == -1).all()
    np.testing.assert_array_equal(np.isinf(frame.blocker_distance[0]), (frame.blocker[0] == -1) & seen)
    points, aims = frame.position[seen], light.to_light(frame.position[seen])
    away = (frame.normal[seen] * aims[0]).sum(axis=1) < -1e-3
    assert away.sum() > 30
    np.testing.assert_array_equal(frame.blocker[0][seen][away], frame.node[seen][away])
    assert (frame.blocker_distance[0][seen][away] == 0.0).all()
    placed = gs.blockers(scene, points, light, frame.normal[seen], frame.triangle[seen])
    np.testing.assert_array_equal(placed.node[0], frame.blocker[0][seen])
    np.testing.assert_allclose(placed.distance[0], frame.blocker_distance[0][seen], rtol=1e-4)


def test_without_the_named_node_the_point_is_lit_or_another_blocks_farther(renderer: gs.Renderer) -> None:
    scene = several()
    outputs = ("blocker", "blocker_distance", "node")
    frame = renderer.render(scene, lights=SLANT, size=SIZE, outputs=outputs, samples=1)
    for number, node in enumerate(scene.nodes):
        rest = [gs.Node(n.mesh, n.world_from_mesh, n.name, casts=n is not node) for n in scene.nodes]
        other = renderer.render(
            gs.Scene(rest, camera=scene.camera), lights=SLANT, size=SIZE, outputs=outputs, samples=1
        )
        named = (frame.blocker[0] == number) & (frame.blocker_distance[0] > 0.0)
        assert node.ground or named.any()
        assert (other.blocker[0][named] != number)[frame.node[named] != number].all()
        assert (other.blocker_distance[0][named] >= frame.blocker_distance[0][named]).all() or node.ground
        kept = (frame.blocker[0] != number) & (frame.node >= 0)
        np.testing.assert_array_equal(other.blocker[0][kept], frame.blocker[0][kept])


def test_who_neither_casts_nor_receives_nor_is_opaque_is_left_out() -> None:
    roof = sheet([(-1, 1, -1), (1, 1, -1), (1, 1, 1), (-1, 1, 1)])
    floor = sheet([(-1, 0, 1), (1, 0, 1), (1, 0, -1), (-1, 0, -1)])
    window = gs.Mesh(
        roof.positions + np.array([0, 1, 0]),
        roof.triangles,
        material=gs.Material((1, 1, 1, 0.5), alpha_mode=gs.AlphaMode.BLEND),
    )
    cut = gs.Mesh(roof.positions, roof.triangles, material=gs.Material((1, 1, 1, 0.2), alpha_mode=gs.AlphaMode.MASK))
    point = [(0.1, 0.0, 0.2)]

    def node(*nodes: gs.Node, light: gs.Light = DOWN, triangles: list[int] | None = None) -> int:
        return int(gs.blockers(gs.Scene([gs.Node(floor), *nodes]), point, light, triangles=triangles).node[0, 0])

    assert node(gs.Node(roof)) == 1
    assert node(gs.Node(roof, casts=False)) == -1
    assert node(gs.Node(window), gs.Node(roof)) == 2
    assert node(gs.Node(window)) == -1
    assert node(gs.Node(cut)) == -1
    assert node(gs.Node(roof), light=gs.DirectionalLight(direction=(0, -1, 0), shadow=None)) == -1
    assert node(gs.Node(roof), triangles=[0]) == 1
    deaf = gs.Scene([gs.Node(floor, receives=False), gs.Node(roof)])
    assert gs.blockers(deaf, point, DOWN, triangles=[0]).node[0, 0] == -1


def test_balls_and_tubes_are_named_and_the_nearest_wins() -> None:
    balls = gs.Points(np.array([[0.0, 1.0, 0.0], [0.0, 3.0, 0.0], [2.0, 1.0, 0.0]]), radius=0.5)
    tube = gs.Lines(np.array([[-1.0, 2.0, 0.0], [1.0, 2.0, 0.0]]), radius=0.25)
    scene = gs.Scene([gs.Node(balls, name="balls"), gs.Node(tube, name="tube"), *several().nodes[3:]])
    found = gs.blockers(scene, [(0, 0, 0), (0.6, 0, 0), (2, 0, 0), (0, 2.6, 0), (3, 0, 0)], DOWN)
    assert found.node[0].tolist() == [0, 1, 0, 0, -1]
    np.testing.assert_allclose(
        found.distance[0, :4], [0.5, 1.75, 0.5, 0.0], atol=1e-12
    )  # the last one is inside a ball


def test_the_first_of_many_overlapping_balls_is_named(rng: np.random.Generator) -> None:
    centres, radius = rng.uniform((-1, 1, -1), (1, 4, 1), size=(200, 3)), rng.uniform(0.05, 0.4, size=200)
    balls = [gs.Node(gs.Points(centres[k : k + 1], radius=radius[k])) for k in range(200)]
    points = rng.uniform((-1, 0, -1), (1, 0.5, 1), size=(300, 3)) * (1.0, 0.0, 1.0)
    found = gs.blockers(gs.Scene([*balls, *several().nodes[3:]]), points, DOWN)
    across = ((centres[:, None, ::2] - points[None, :, ::2]) ** 2).sum(axis=-1)
    half = radius[:, None] ** 2 - across
    bottom = np.where(half > 0.0, centres[:, None, 1] - np.sqrt(np.maximum(half, 0.0)), np.inf)
    expected = np.where(np.isinf(bottom.min(axis=0)), -1, bottom.argmin(axis=0))
    np.testing.assert_array_equal(found.node[0], expected)
    np.testing.assert_allclose(found.distance[0], bottom.min(axis=0), rtol=1e-9)
    assert len(np.unique(expected)) > 30


def test_smooth_meshes_are_as_dark_as_in_the_image(renderer: gs.Renderer) -> None:
    scene = gs.scenes.ball(subdivisions=3).scene
    assert any(node.mesh.normals is not None for node in scene.nodes)
    frame = renderer.render(scene, lights=SLANT, size=SIZE, outputs=("visibility", "blocker", "node"), samples=1)
    seen = frame.node >= 0
    assert ((frame.blocker[0] >= 0) != (frame.visibility[0] == 0.0))[seen].mean() < 2e-3


def test_a_scene_moved_and_scaled_has_the_same_blockers(rng: np.random.Generator) -> None:
    from ..outlines.solids import moved

    scene = several()
    points = rng.uniform((-3, 0, -3), (3, 4, 3), size=(300, 3))
    found = gs.blockers(scene, points, SLANT)
    tiny = gs.blockers(moved(scene, 1e-6, np.zeros(3)), 1e-6 * points, SLANT)
    np.testing.assert_array_equal(tiny.node, found.node)
    np.testing.assert_allclose(tiny.distance, 1e-6 * found.distance, rtol=1e-9)
    far = np.array([1e7, 0.0, -1e7])
    np.testing.assert_array_equal(gs.blockers(moved(scene, 1.0, far), points + far, SLANT).node, found.node)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"points": [(0, 0)]}, r"points must be an array \(N, 3\) of finite numbers"),
        ({"points": [(0, 0, np.nan)]}, r"points must be an array \(N, 3\) of finite numbers"),
        ({"points": [(0, 0, 1e30)]}, "points must be within"),
        ({"triangles": [0, 1]}, r"triangles must be an array \(1,\) of integers"),
        ({"triangles": [10**6]}, "numbers of the scene's .* triangles, or -1 for none: got 1000000"),
        ({"triangles": [-2]}, "got -2"),
        ({"normals": [(0, 1, 0)]}, "normals need triangles"),
        ({"normals": [(0, 1)], "triangles": [0]}, r"normals must be an array \(1, 3\)"),
        ({"lights": "sun"}, "lights"),
    ],
    ids=["shape", "nan", "far", "count", "number", "negative", "alone", "normals", "lights"],
)
def test_what_is_wrong_is_named(arguments: dict[str, object], message: str) -> None:
    with pytest.raises(gs.SettingsError, match=message):
        gs.blockers(several(), **{"points": [(0, 0, 0)], **arguments})  # type: ignore[arg-type]


def test_no_points_have_no_blockers() -> None:
    assert gs.blockers(several(), np.zeros((0, 3)), [DOWN, SLANT]).node.shape == (2, 0)


def test_all_names_what_the_gpu_draws(renderer: gs.Renderer) -> None:
    frame = renderer.render(several(), size=(16, 9), outputs="all")
    assert "blocker" not in frame.outputs
    with pytest.raises(gs.MissingOutput, match='has no "blocker"'):
        frame.blocker  # noqa: B018
