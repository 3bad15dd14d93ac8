"""Points and lines: their settings, their default radii, and readers of files and of other libraries' objects."""

from __future__ import annotations

import base64
import json
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pyrender
import pytest
import trimesh

import glshadow as gs
from glshadow.core.srgb import linear_from_srgb
from glshadow.errors import SceneError
from glshadow.scene.capsules import TUBE_SHARE, Capsules, median_distance

from .glb import Glb

PLACES = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 2.0, 0.0]], dtype=np.float32)


def _only(scene: gs.Scene) -> Capsules:
    (node,) = scene.nodes
    assert isinstance(node.mesh, Capsules)
    return node.mesh


def test_default_radius_is_half_the_median_distance() -> None:
    rng = np.random.default_rng(0)
    points = rng.normal(size=(200, 3))
    apart = np.linalg.norm(points[:, None] - points, axis=-1)
    np.fill_diagonal(apart, np.inf)
    assert median_distance(points) == pytest.approx(np.median(apart.min(axis=1)), rel=1e-12)
    assert gs.Points(points).radius[0] == 0.5 * median_distance(points)
    assert gs.Points(np.repeat(points, 3, axis=0)).radius[0] == 0.5 * median_distance(points)  # duplicates count once
    line = gs.Lines([[0.0, 0.0, 0.0], [3.0, 4.0, 0.0]])
    assert line.radius[0] == TUBE_SHARE * 5.0


def test_bounds_hold_balls_under_any_matrix() -> None:
    matrix = np.diag([4.0, 1.0, 0.5, 1.0])
    node = gs.Node(gs.Points([[0.0, 0.0, 0.0], [1.0, 1.0, 1.0]], radius=0.5), matrix)
    radius = 0.5 * 2.0 ** (1.0 / 3.0)  # the cube root of the determinant
    low, high = gs.Scene([node]).bounds
    assert np.allclose(low, -radius)
    assert np.allclose(high, np.array([4.0, 1.0, 0.5]) + radius)
    ground = gs.Scene([node]).with_ground().nodes[1]
    assert ground.world_from_mesh[1, 3] == pytest.approx(-radius)


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: gs.Points([[0.0, np.nan, 0.0]], 1.0), "not finite"),
        (lambda: gs.Points([[0.0, 0.0]], 1.0), r"\(V, 3\)"),
        (lambda: gs.Points("cloud"), "got 'cloud'"),
        (lambda: gs.Points([[0.0, 0.0, 0.0]]), "Points need a radius"),
        (lambda: gs.Points(PLACES, radius=0.0), "larger than 0"),
        (lambda: gs.Points(PLACES, radius=[1.0, 2.0]), "one number or 3"),
        (lambda: gs.Points(PLACES, colors=np.full((3, 3), 2.0)), "from 0 to 1"),
        (
            lambda: gs.Points(PLACES, colors=np.ones((2, 4))),
            r"Points colors must have shape \(3, 3\) or \(3, 4\), got \(2, 4\)",
        ),
        (lambda: gs.Lines(PLACES, radius=1.0, colors=[1.0, 0.0, 0.0]), r"Lines colors must have shape .* got \(3,\)"),
        (lambda: gs.Points(PLACES, material=gs.Material(alpha_mode=gs.AlphaMode.BLEND)), "opaque"),
        (lambda: gs.Points(PLACES, material=gs.Material(roughness=0.5)), "matte, without"),
        (lambda: gs.Scene([gs.Node(gs.Points(PLACES), np.diag([1.0, 0.0, 1.0, 1.0]))]), "flattened"),
        (lambda: gs.Lines(PLACES, [[0, 3]]), "index 3 is out of range"),
        (lambda: gs.Lines(PLACES, [[0.5, 1.0]]), "integers"),
        (lambda: gs.Lines(PLACES, [0, 1, 2]), r"\(S, 2\)"),
        (lambda: gs.Lines([[0.0, 0.0, 0.0]] * 2), "Lines need a radius"),
    ],
)
def test_bad_input_is_named(make: Any, said: str) -> None:
    with pytest.raises(SceneError, match=said):
        make()


def test_scene_says_what_it_has() -> None:
    scene = gs.Scene([gs.Points(PLACES), gs.Lines(PLACES)])
    assert "3 points, 2 line segments" in repr(scene)
    assert repr(scene.nodes[0].mesh).startswith("Points(3 points")


PLY = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"


def test_ply_without_faces_is_points_and_with_edges_lines(tmp_path: Path) -> None:
    rows = "".join(f"{x} {y} {z} 255 0 {k}\n" for k, (x, y, z) in enumerate(PLACES.tolist()))
    colored = PLY + "property uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n" + rows
    (tmp_path / "points.ply").write_text(colored)
    points = _only(gs.load(tmp_path / "points.ply"))
    assert isinstance(points, gs.Points)
    assert np.array_equal(points.positions, PLACES)
    assert points.colors is not None
    assert np.array_equal(points.colors[0], [1.0, 0.0, 0.0, 1.0])
    rows = "".join(f"{x} {y} {z}\n" for x, y, z in PLACES.tolist())
    edges = "element edge 2\nproperty int vertex1\nproperty int vertex2\nend_header\n" + rows + "0 1\n1 2\n"
    (tmp_path / "lines.ply").write_text(PLY + edges)
    lines = _only(gs.load(tmp_path / "lines.ply"))
    assert isinstance(lines, gs.Lines)
    assert np.array_equal(lines.ends, [[0, 1], [1, 2]])


@pytest.mark.parametrize("rest", ["", "l 1 2 3\n", "f 1 2 3\n", "f 1 2 3 4\n"])
def test_coordinates_near_the_end_of_float64_are_refused_by_name(tmp_path: Path, rest: str) -> None:
    """Without a warning of numpy, which the settings of the tests turn into an error of another kind."""
    (tmp_path / "far.obj").write_text("v 1e308 0 0\nv -1e308 0 0\nv 0 1e308 0\nv 0 0 -1e308\n" + rest)
    with pytest.raises(SceneError, match=r"1e\+308 (from the origin|are too large)|coordinates overflow"):
        gs.load(tmp_path / "far.obj")


def test_gaussian_splats_are_points_of_their_base_colours(tmp_path: Path) -> None:
    """0.5 + Y f_dc in sRGB, where Y = 1 / (2 sqrt(pi)), the spherical harmonic of degree 0."""
    header = PLY + "".join(f"property float f_dc_{k}\n" for k in range(3)) + "property float opacity\nend_header\n"
    rows = "".join(f"{x} {y} {z} 0 {10 * k} -9 0.5\n" for k, (x, y, z) in enumerate(PLACES.tolist()))
    (tmp_path / "splats.ply").write_text(header + rows)
    with pytest.warns(gs.GlshadowWarning, match="Gaussian splats are drawn as points of their base colours"):
        points = _only(gs.load(tmp_path / "splats.ply"))
    assert isinstance(points, gs.Points)
    assert points.colors is not None
    half = float(linear_from_srgb(np.array(0.5)))
    np.testing.assert_allclose(points.colors[:, :3], [[half, half, 0], [half, 1, 0], [half, 1, 0]], atol=1e-7)


def test_obj_points_and_lines_beside_faces(tmp_path: Path) -> None:
    (tmp_path / "some.mtl").write_text("newmtl red\nKd 1 0 0\n")
    text = "mtllib some.mtl\nv 0 0 0\nv 1 0 0\nv 0 2 0\np 1 2\nusemtl red\nl 1/1 2/2 3/3\nl -1 -3 # back\nf 1 2 3\n"
    (tmp_path / "all.obj").write_text(text)
    scene = gs.load(tmp_path / "all.obj")
    _, points, lines = (node.mesh for node in scene.nodes)
    assert isinstance(points, gs.Points)
    assert np.array_equal(points.positions, PLACES[:2])
    assert isinstance(lines, gs.Lines)
    assert np.array_equal(lines.positions[lines.ends], PLACES[[[0, 1], [1, 2], [2, 0]]])
    assert lines.material.color == (1.0, 0.0, 0.0, 1.0)
    (tmp_path / "beyond.obj").write_text("v 0 0 0\nv 1 0 0\nl 1 3\n")
    with pytest.raises(SceneError, match="nothing to render: its lines: 1 of 1 lines left out: one refers to vertex 2"):
        gs.load(tmp_path / "beyond.obj")
    (tmp_path / "zero.obj").write_text("v 0 0 0\nv 1 0 0\np 0\n")
    with pytest.raises(SceneError, match="nothing to render: 1 of 1 points left out: one refers to vertex -1"):
        gs.load(tmp_path / "zero.obj")


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("cloud.obj", "# a cloud\nv 0 0 0 255 0 0\nv 1 0 0 255 0 0\nv 0 2 0 255 0 0\n"),
        ("cloud.off", "COFF\n3 0 0\n0 0 0 255 0 0\n1 0 0 255 0 0\n0 2 0 255 0 0\n"),
    ],
)
def test_vertices_alone_are_points(tmp_path: Path, name: str, text: str) -> None:
    (tmp_path / name).write_text(text)
    points = _only(gs.load(tmp_path / name))
    assert isinstance(points, gs.Points)
    assert np.array_equal(points.positions, PLACES)
    assert points.material.color == (1.0, 0.0, 0.0, 1.0)


@pytest.mark.parametrize(
    ("statement", "left"), [("p 1 2 9\np 0 3 -7", [0, 1, 2]), ("l 1 2 9\nl -9 1\nl 2 3", [0, 1, 1, 2])]
)
def test_points_and_lines_without_a_vertex_are_left_out(tmp_path: Path, statement: str, left: list[int]) -> None:
    (tmp_path / "a.obj").write_text(f"v 0 0 0\nv 1 0 0\nv 0 2 0\n{statement}\n")
    with pytest.warns(gs.GlshadowWarning, match="[23] of [46] (points|lines) left out: one refers to vertex 8"):
        mesh = _only(gs.load(tmp_path / "a.obj"))
    used = mesh.positions if isinstance(mesh, gs.Points) else mesh.positions[mesh.ends].reshape(-1, 3)
    assert np.array_equal(used, PLACES[left])


def test_edges_of_ply_and_lines_of_gltf_without_a_vertex_are_left_out(tmp_path: Path) -> None:
    rows = "".join(f"{x} {y} {z}\n" for x, y, z in PLACES.tolist())
    edges = "element edge 2\nproperty int vertex1\nproperty int vertex2\nend_header\n" + rows + "0 1\n1 9\n"
    (tmp_path / "lines.ply").write_text(PLY + edges)
    glb = Glb(nodes=[{"mesh": 0}])
    glb.mesh({"attributes": {"POSITION": glb.add(PLACES)}, "indices": glb.add([0, 1, 9], "uint8"), "mode": 3})
    for path in (tmp_path / "lines.ply", glb.save(tmp_path / "lines.glb")):
        with pytest.warns(gs.GlshadowWarning, match="1 of 2 lines left out: one refers to vertex 9, but there are 3"):
            assert _only(gs.load(path)).count == 1


@pytest.mark.parametrize(("mode", "ends"), [(1, [[0, 1]]), (2, [[0, 1], [1, 2], [2, 0]]), (3, [[0, 1], [1, 2]])])
def test_gltf_lines(tmp_path: Path, mode: int, ends: list[list[int]]) -> None:
    lines = _only(gs.load(_gltf(tmp_path, mode)))
    assert isinstance(lines, gs.Lines)
    assert np.array_equal(lines.positions[lines.ends], PLACES[ends])


def test_gltf_points(tmp_path: Path) -> None:
    points = _only(gs.load(_gltf(tmp_path, 0)))
    assert isinstance(points, gs.Points)
    assert np.array_equal(points.positions, PLACES)
    assert points.material.color == (0.25, 0.5, 1.0, 1.0)


def _gltf(folder: Path, mode: int) -> Path:
    uri = "data:application/octet-stream;base64," + base64.b64encode(PLACES.tobytes()).decode()
    primitive = {"attributes": {"POSITION": 0}, "mode": mode, "material": 0}
    document = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [primitive]}],
        "materials": [{"pbrMetallicRoughness": {"baseColorFactor": [0.25, 0.5, 1.0, 1.0]}}],
        "buffers": [{"byteLength": 36, "uri": uri}],
        "bufferViews": [{"buffer": 0, "byteLength": 36}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}],
    }
    path = folder / "loose.gltf"
    path.write_text(json.dumps(document))
    return path


def test_trimesh_clouds_and_paths() -> None:
    points = _only(gs.load(trimesh.PointCloud(PLACES, colors=[[255, 0, 0, 255], [0, 255, 0, 255], [0, 0, 255, 255]])))
    assert isinstance(points, gs.Points)
    assert points.colors is not None
    assert np.array_equal(points.colors, np.c_[np.eye(3), np.ones(3)])
    lines = _only(gs.load(trimesh.load_path(PLACES)))
    assert isinstance(lines, gs.Lines)
    assert np.allclose(lines.positions[lines.ends], PLACES[[[0, 1], [1, 2]]])


def test_pyrender_points() -> None:
    scene = pyrender.Scene()
    scene.add(pyrender.Mesh.from_points(PLACES, colors=np.c_[np.eye(3), np.ones(3)]))
    points = _only(gs.load(scene))
    assert isinstance(points, gs.Points)
    assert np.array_equal(points.positions, PLACES)
    assert points.colors is not None
    assert np.array_equal(points.colors[:, :3], np.eye(3))


def _of_open3d(name: str, **members: Any) -> Any:
    """An object as Open3D's: classes of that module with these members; the library itself is not needed to read them."""
    module = ModuleType("open3d")
    kind = type(name, (), {"__module__": module.__name__})
    made = kind()
    vars(made).update(members)
    return made


def test_open3d_clouds_and_line_sets() -> None:
    cloud = _only(gs.load(_of_open3d("PointCloud", points=PLACES, colors=np.eye(3))))
    assert isinstance(cloud, gs.Points)
    assert cloud.colors is not None
    assert np.array_equal(cloud.colors[:, :3], np.eye(3))
    lines = _only(gs.load(_of_open3d("LineSet", points=PLACES, lines=np.array([[0, 1], [1, 2]]), colors=np.eye(3)[:2])))
    assert isinstance(lines, gs.Lines)
    assert np.array_equal(lines.positions[lines.ends], PLACES[[[0, 1], [1, 2]]])
    assert lines.colors is not None
    assert np.array_equal(lines.colors[lines.ends[1], :3], [[0.0, 1.0, 0.0]] * 2)


def test_points_that_are_not_finite_are_left_out_with_a_note() -> None:
    cloud = trimesh.PointCloud(np.concatenate([PLACES, [[np.nan, 0.0, 0.0]]]))
    with pytest.warns(gs.GlshadowWarning, match="1 of 4 points are not finite"):
        assert _only(gs.load(cloud)).count == 3


def test_nothing_is_described_by_its_kind() -> None:
    assert repr(gs.Points(np.zeros((0, 3)))).startswith("Points(0 points, ")
    assert repr(gs.Lines(PLACES, np.zeros((0, 2), dtype=int), radius=1.0)).startswith("Lines(0 line segments, ")


def test_what_knows_triangles_only_refuses(tmp_path: Path) -> None:
    scene = gs.Scene([gs.Points(PLACES)], name="cloud")
    with pytest.raises(SceneError, match="cloud: a page does not support points"):
        gs.export_page(scene, tmp_path)
