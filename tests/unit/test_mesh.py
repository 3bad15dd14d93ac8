"""Meshes and scenes: refused input, closedness, and the defaults that frame a scene."""

from __future__ import annotations

import numpy as np
import pytest

from glshadow.core.cameras import PerspectiveCamera
from glshadow.core.spaces import Array, perspective, project, translation
from glshadow.errors import SceneError
from glshadow.geometry.welding import welded
from glshadow.lights import PointLight
from glshadow.scene.box import box_corners, default_camera, default_sun
from glshadow.scene.mesh import Mesh
from glshadow.scene.nodes import Node, Scene

# -x +x -y +y -z +z, turned outward
QUADS = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
PICKS = np.array([[i, j, k] for i in (0, 1) for j in (0, 1) for k in (0, 1)], dtype=np.float64)
BOX = np.array([[a, b, c] for q in QUADS for a, b, c in ((q[0], q[1], q[2]), (q[0], q[2], q[3]))])


def box(low: Array | tuple[float, ...] = (0, 0, 0), high: Array | tuple[float, ...] = (1, 1, 1)) -> Mesh:
    low, high = np.asarray(low, dtype=np.float64), np.asarray(high, dtype=np.float64)
    return Mesh(low + PICKS * (high - low), BOX)


def joined(*meshes: Mesh) -> Mesh:
    offsets = np.cumsum([0, *(len(mesh.positions) for mesh in meshes[:-1])])
    return Mesh(
        np.concatenate([mesh.positions for mesh in meshes]),
        np.concatenate([mesh.triangles + offset for mesh, offset in zip(meshes, offsets, strict=True)]),
    )


def inverted(mesh: Mesh) -> Mesh:
    return Mesh(mesh.positions, mesh.triangles[:, ::-1])


def soup(mesh: Mesh) -> Mesh:
    """Every triangle with three vertices of its own."""
    return Mesh(mesh.positions[mesh.triangles.ravel()], np.arange(3 * len(mesh.triangles)).reshape(-1, 3))


def flipped(mesh: Mesh, triangle: int) -> Mesh:
    triangles = mesh.triangles.copy()
    triangles[triangle] = triangles[triangle, ::-1]
    return Mesh(mesh.positions, triangles)


def bow_tie(end: float) -> Mesh:
    """A prism over a quadrilateral whose sides cross if `end` is larger than -0.5."""
    across = np.array([[-0.5, -0.5], [0.5, end], [0.5, -0.4], [-0.5, 0.5]])[::-1]
    below, above = (np.column_stack([across[:, 0], np.full(4, y), across[:, 1]]) for y in (-0.5, 0.5))
    sides = [[k, 4 + k, (k + 1) % 4] for k in range(4)] + [[(k + 1) % 4, 4 + k, 4 + (k + 1) % 4] for k in range(4)]
    mesh = Mesh(np.concatenate([below, above]), np.array([[0, 1, 2], [0, 2, 3], [4, 6, 5], [4, 7, 6], *sides]))
    a, b, c = mesh.positions[mesh.triangles].transpose(1, 0, 2)
    return mesh if np.einsum("ij,ij->", a, np.cross(b, c)) > 0.0 else inverted(mesh)


def scene(*meshes: Mesh) -> Scene:
    return Scene(tuple(Node(mesh, np.eye(4), f"node{k}") for k, mesh in enumerate(meshes)))


OPEN = Mesh(box().positions, BOX[:-2])
CLOSED_CASES = {
    "box": (box(), True),
    "box far from the origin": (box((1e7, 1e7, 1e7), (1e7 + 1, 1e7 + 1, 1e7 + 1)), True),
    "box of separate triangles": (soup(box()), True),
    "two shells apart": (joined(box(), box((3, 0, 0), (4, 1, 1))), True),
    "large box, small inverted one beside it": (joined(box(), inverted(box((3, 0, 0), (3.2, 0.2, 0.2)))), False),
    # an inverted part inside another is not detected
    "shell with an inward cavity": (joined(box(), inverted(box((0.4, 0.4, 0.4), (0.6, 0.6, 0.6)))), False),
    "box with a degenerate triangle": (Mesh(box().positions, np.vstack([BOX, [[0, 0, 1]]])), True),
    "two boxes through each other": (joined(box(), box((0.5, 0.5, 0.5), (2, 2, 2))), True),
    "bow tie, whose smaller side is turned inside out": (bow_tie(0.4), False),
    "the same cut off where it crosses itself": (bow_tie(-0.6), True),
    "open box": (OPEN, False),
    "open box of separate triangles": (soup(OPEN), False),
    "inverted box": (inverted(box()), False),
    "one triangle wound the other way": (flipped(box(), 4), False),
    "duplicated triangles": (Mesh(box().positions, np.vstack([BOX, BOX[:2]])), False),
    "the whole box twice": (joined(box(), box()), False),
    "both sides of a sheet": (Mesh(np.eye(3), np.array([[0, 1, 2], [2, 1, 0]])), False),
    "one triangle": (Mesh(np.eye(3), np.array([[0, 1, 2]])), False),
    "only degenerate triangles": (Mesh(np.eye(3), np.array([[0, 0, 1]])), False),
    "no triangle": (Mesh(np.eye(3), np.zeros((0, 3), dtype=np.int32)), False),
}


@pytest.mark.parametrize("case", CLOSED_CASES)
def test_closed(case: str) -> None:
    mesh, expected = CLOSED_CASES[case]
    assert mesh.closed is expected


def test_gap_of_one_ulp_is_open() -> None:
    """Welding is by exact position, nothing else."""
    parts = soup(box())
    positions = parts.positions.copy()
    positions[np.argmax(positions[:, 0] == 1.0), 0] = np.nextafter(1.0, 2.0)
    assert not Mesh(positions, parts.triangles).closed


def test_welded() -> None:
    positions = np.array([[0.0, 1.0, 2.0], [5.0, 0.0, 0.0], [-0.0, 1.0, 2.0], [5.0, 0.0, 1e-300], [5.0, 0.0, 0.0]])
    number = welded(positions)
    assert number[0] == number[2]  # -0 equals 0
    assert number[1] == number[4]
    assert len(set(number.tolist())) == 3
    assert set(number.tolist()) == {0, 1, 2}
    assert len(welded(np.zeros((0, 3)))) == 0


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_used_vertices_must_be_finite(bad: float) -> None:
    positions = box().positions.copy()
    positions[3, 1] = bad
    with pytest.raises(SceneError, match="1 of 8 vertices have coordinates that are not finite"):
        Mesh(positions, BOX)


def test_unused_vertices_may_have_any_value() -> None:
    mesh = Mesh(np.vstack([box().positions, [[np.nan, np.inf, 9e9]]]), BOX)
    assert np.isfinite(mesh.positions).all()
    np.testing.assert_array_equal(mesh.bounds, [[0, 0, 0], [1, 1, 1]])
    assert mesh.closed


@pytest.mark.parametrize(
    ("positions", "triangles", "message"),
    [
        (np.zeros((4, 2)), [[0, 1, 2]], r"positions \(V, 3\).*\(4, 2\)"),
        (np.eye(3), [[0, 1, 2, 0]], r"triangles \(T, 3\).*\(1, 4\)"),
        (np.eye(3), [[0, 1, 3]], "triangle index 3 is out of range: the mesh has 3 vertices"),
        (np.eye(3), [[0, -1, 2]], "triangle index -1 is out of range"),
    ],
)
def test_mesh_refuses(positions: Array, triangles: list[list[int]], message: str) -> None:
    with pytest.raises(SceneError, match=message):
        Mesh(positions, np.array(triangles))


def test_attributes_must_fit() -> None:
    with pytest.raises(SceneError, match=r"normals must have shape \(3, 3\), got \(2, 3\)"):
        Mesh(np.eye(3), np.array([[0, 1, 2]]), normals=np.zeros((2, 3), dtype=np.float32))
    with pytest.raises(SceneError, match=r"uv must have shape \(3, 2\), got \(3, 3\)"):
        Mesh(np.eye(3), np.array([[0, 1, 2]]), uv=np.zeros((3, 3), dtype=np.float32))


def test_node_needs_a_finite_matrix() -> None:
    for matrix in (np.eye(3), np.full((4, 4), np.nan)):
        with pytest.raises(SceneError, match="Node 'a' world_from_mesh must be a finite matrix"):
            Node(box(), matrix, "a")


def test_scene_needs_something_to_render() -> None:
    with pytest.raises(SceneError, match="no triangles"):
        Scene(())
    with pytest.raises(SceneError, match="no triangles"):
        scene(Mesh(np.eye(3), np.zeros((0, 3), dtype=np.int32)))
    with pytest.raises(SceneError, match="size is zero"):
        scene(Mesh(np.ones((3, 3)), np.array([[0, 1, 2]])))


def test_bounds_enclose_the_rotated_boxes() -> None:
    quarter = np.array([[0.0, 0, 1, 10], [0, 1, 0, 0], [-1, 0, 0, 0], [0, 0, 0, 1]])  # about y
    turned = Scene((Node(box((0, 0, 0), (1, 2, 3)), quarter, "a"),))
    np.testing.assert_allclose(turned.bounds, [[10, 0, -1], [13, 2, 0]], atol=1e-15)
    corners = box_corners(*turned.boxes)
    assert corners.shape == (1, 8, 3)
    np.testing.assert_allclose(np.unique(corners[0], axis=0).shape, (8, 3))


def test_moved_shares_meshes_and_keeps_the_original() -> None:
    before = scene(box(), box((3, 0, 0), (4, 1, 1)))
    after = before.moved({"node1": translation((0, 5, 0))})
    assert after.nodes[0] is before.nodes[0]
    assert after.nodes[1].mesh is before.nodes[1].mesh
    np.testing.assert_array_equal(after.bounds, [[0, 0, 0], [4, 6, 1]])
    np.testing.assert_array_equal(before.bounds, [[0, 0, 0], [4, 1, 1]])
    assert after.camera == before.camera  # a moving object does not move the camera
    assert after.lights == before.lights
    with pytest.raises(SceneError, match=r"'nobody'.*node0, node1"):
        before.moved({"nobody": np.eye(4)})
    with pytest.raises(SceneError, match="must be"):
        before.moved({"node0": np.eye(3)})


def test_ground_touches_the_lowest_point() -> None:
    before = scene(box((2, -3, 5), (4, 1, 6)))
    after = before.with_ground()
    size = np.sqrt(4.0 + 16.0 + 1.0)
    ground = after.nodes[-1]
    assert ground.name == "ground"
    assert after.nodes[:-1] == before.nodes
    assert after.camera == before.camera  # frames the object, not the plane
    corners = project(ground.world_from_mesh, ground.mesh.positions)[:, :3]
    np.testing.assert_array_equal(corners[:, 1], -3.0)
    np.testing.assert_allclose(corners.mean(axis=0), [3.0, -3.0, 5.5], rtol=1e-14)
    np.testing.assert_allclose(np.ptp(corners, axis=0), [3 * size, 0.0, 3 * size], rtol=1e-14)
    a, b, c = corners[ground.mesh.triangles[0]]
    assert np.cross(b - a, c - a)[1] > 0  # faces up


@pytest.mark.parametrize("size", [(1280, 720), (640, 640), (200, 100)])
@pytest.mark.parametrize("shape", [(1, 1, 1), (100, 1, 1), (1, 100, 1), (1, 1, 100), (1e-3, 2e-3, 1e-3), (1, 1, 0)])
@pytest.mark.parametrize("offset", [0.0, -1e4])
def test_default_camera_frames_the_box(size: tuple[int, int], shape: tuple[float, ...], offset: float) -> None:
    bounds = offset + np.array([np.zeros(3), shape])
    camera = default_camera(bounds)
    corners = box_corners(bounds[None], np.eye(4)[None])[0]
    clip = project(perspective(*camera.window(size), 1e-6, 1e9) @ camera.view_from_world, corners)
    assert (clip[:, 3] > 0).all()
    ndc = clip[:, :2] / clip[:, 3:]
    assert np.abs(ndc).max() < 1.0
    assert np.abs(ndc).max() > 0.2  # and not tiny in the image


def test_given_lights_and_camera_replace_the_defaults() -> None:
    plain = scene(box())
    assert plain.lights == (default_sun(),)
    assert plain.camera == default_camera(plain.bounds)
    assert default_sun().direction[1] < 0
    camera, point_light = PerspectiveCamera((1, 2, 3)), PointLight(position=(0, 5, 0))
    given = Scene(plain.nodes, camera, [point_light])  # type: ignore[arg-type]
    assert given.camera is camera
    assert given.lights == (point_light,)
    assert Scene(plain.nodes, None, ()).lights == ()  # type: ignore[arg-type]
