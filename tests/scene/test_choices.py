"""What a caller chooses of a file: one of its cameras, and smooth normals; with the command line."""

import json
import pickle
import warnings
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from click.testing import CliRunner

import glshadow as gs
from glshadow.cli import main
from glshadow.errors import GlshadowWarning, SceneError, SettingsError
from glshadow.io.from_pyrender import read_pyrender
from glshadow.io.load import load

from .glb import Glb

PLACES = [[-1, 0, 0], [1, 0, 0], [0, 1, 0]]


def several(path: Path, *lenses, **more) -> Path:
    """A file of a triangle and a camera for each lens, at x = 0, 1, 2; the nodes are named A, B, C."""
    nodes = [{"camera": k, "translation": [k, 0, 5], "name": "ABC"[k % 3]} for k in range(len(lenses))]
    glb = Glb(nodes=[{"mesh": 0}, *nodes], cameras=list(lenses), **more)
    glb.mesh({"attributes": {"POSITION": glb.add(PLACES)}})
    return glb.save(path)


WIDE = {"type": "perspective", "perspective": {"yfov": 1.0, "znear": 0.1}}
TELE = {"type": "perspective", "perspective": {"yfov": 0.5, "znear": 0.1}}
FLAT = {"type": "orthographic", "orthographic": {"xmag": 2.0, "ymag": 1.5, "znear": 0.1, "zfar": 9.0}}


@pytest.fixture
def three(tmp_path):
    return several(tmp_path / "three.glb", WIDE, TELE, FLAT)


@pytest.mark.parametrize(
    ("camera", "number"),
    [(None, 0), (0, 0), (1, 1), (2, 2), ("A", 0), ("B", 1), ("C", 2), ("1", 1), (np.int64(2), 2)],
    ids=range(9),
)
def test_cameras_by_name_and_number(three, camera, number):
    scene = load(three, camera=camera)
    assert list(scene.cameras) == ["A", "B", "C"]
    assert scene.camera == list(scene.cameras.values())[number]
    assert scene.camera.position == (float(number), 0.0, 5.0)


def test_the_cameras_of_the_case(models):
    scene = load(models.parent / "cases" / "meant" / "two_cameras.glb", camera="B")
    assert list(scene.cameras) == ["A", "B"]
    assert scene.camera.position == (3.0, 0.0, 5.0)
    assert scene.camera.fov_y == pytest.approx(np.degrees(1.0))


def test_camera_whose_name_is_a_number(tmp_path):
    glb = several(tmp_path / "a.glb", WIDE, TELE)
    data = glb.read_bytes().replace(b'"name": "A"', b'"name": "1"')
    glb.write_bytes(data)
    assert load(glb, camera="1").camera.position[0] == 0.0
    assert load(glb, camera=1).camera.position[0] == 1.0


@pytest.mark.parametrize("camera", ["D", 3, "3", "-1", "9" * 30], ids=range(5))
def test_unknown_cameras_are_refused_with_those_that_there_are(three, camera):
    with pytest.raises(SceneError, match=r"three\.glb: there is no camera .*; it has 0: 'A', 1: 'B', 2: 'C'"):
        load(three, camera=camera)


def test_file_without_cameras(tmp_path):
    with pytest.raises(SceneError, match="there is no camera 'A': it has no cameras"):
        load(several(tmp_path / "a.glb"), camera="A")
    assert load(several(tmp_path / "a.glb")).cameras == {}


@pytest.mark.parametrize("camera", [-1, 1.5, "", True, [0]])
def test_camera_of_a_wrong_kind(three, camera):
    with pytest.raises(SettingsError, match="camera must be"):
        load(three, camera=camera)


def test_broken_camera_behind_the_first_is_left_out(tmp_path):
    broken = {"type": "perspective", "perspective": {"yfov": 0.0}}
    with pytest.warns(GlshadowWarning, match="camera 'B'.*yfov of its camera must be a number other than 0.*left out"):
        assert list(load(several(tmp_path / "a.glb", WIDE, broken, FLAT)).cameras) == ["A", "C"]
    with pytest.raises(SceneError, match="yfov of its camera"):
        load(several(tmp_path / "a.glb", broken, WIDE))


def test_cameras_turn_with_the_up_axis_and_travel(three):
    scene = load(three, up_axis="z", ground=True)
    assert scene.cameras["B"].position == (1.0, 5.0, 0.0)
    assert scene.camera == scene.cameras["A"]
    again = pickle.loads(pickle.dumps(scene))
    assert again.cameras == scene.cameras
    assert load(scene, camera="C").camera == scene.cameras["C"]
    with pytest.raises(SceneError, match="mapping from names to cameras"):
        gs.Scene(scene.nodes, cameras={"A": 1})


def test_command_line(three, tmp_path):
    """The camera that is chosen is the one that is drawn, and the report says so."""
    found = {}
    for camera in ("A", "2"):
        output = tmp_path / f"{camera}.png"
        result = CliRunner().invoke(
            main, ["render", str(three), "--camera", camera, "--size", "48x32", "-o", str(output), "--json"]
        )
        assert result.exit_code == 0, result.output
        found[camera] = json.loads(result.stdout)
    with gs.Renderer() as renderer:
        for camera in found:
            frame = renderer.render(load(three, camera=camera), size=(48, 32))
            np.testing.assert_array_equal(gs.image.read(tmp_path / f"{camera}.png")[..., :3], frame.image[..., :3])
    refused = CliRunner().invoke(main, ["render", str(three), "--camera", "D"])
    assert refused.exit_code != 0
    assert "it has 0: 'A', 1: 'B', 2: 'C'" in refused.output
    assert "--camera needs a MODEL" in CliRunner().invoke(main, ["render", "--camera", "A"]).output


class Node:
    def __init__(self, x, yfov, name=None):
        self.name, self.camera = name, SimpleNamespace(yfov=yfov, name=None)
        self.pose = np.eye(4)
        self.pose[0, 3] = x


def test_cameras_of_pyrender():
    """All of them by name, and the main one; with stand-ins for its scene."""
    nodes = [Node(0.0, 1.0, "A"), Node(1.0, 0.5), Node(2.0, 0.7, "A")]
    scene = SimpleNamespace(mesh_nodes=[], light_nodes=[], camera_nodes=nodes, main_camera_node=nodes[1],
                            get_pose=lambda node: node.pose)  # fmt: skip
    found = read_pyrender(scene)
    assert {name: camera.position[0] for name, camera in found.cameras.items()} == {
        "A": 0.0,
        "camera1": 1.0,
        "A.2": 2.0,
    }
    assert found.camera == found.cameras["camera1"]
    scene.main_camera_node, scene.camera_nodes = None, []
    assert (read_pyrender(scene).camera, read_pyrender(scene).cameras) == (None, {})


# --- smooth normals in memory ---

ROOF = np.array([[-1, 0, 0], [0, 1, 0], [0, 1, -2], [-1, 0, -2], [1, 0, 0], [1, 0, -2]], dtype=float)
FACES = np.array([[0, 1, 2], [0, 2, 3], [1, 4, 5], [1, 5, 2]])


def test_meshes_in_memory(rng):
    """Smooth or split, with their colours and coordinates; a mesh with normals, and every other node, stays the same object."""
    colors = rng.uniform(0, 1, (6, 4)).astype(np.float32)
    uv = rng.uniform(0, 1, (6, 2)).astype(np.float32)
    plain = gs.Mesh(ROOF, FACES, colors=colors, uv=uv)
    given = gs.Mesh(ROOF, FACES, np.tile([0.0, 1.0, 0.0], (6, 1)))
    scene = gs.Scene([gs.Node(plain, name="a"), gs.Node(given, name="b"), gs.Node(plain, np.diag([2.0, 1, 1, 1]), "c")])
    assert load(scene).nodes[0].mesh is plain
    assert load(scene, smooth=90).nodes[0].mesh is plain
    found = load(scene, smooth=91).nodes
    assert found[1].mesh is given
    assert found[0].mesh is found[2].mesh
    mesh = found[0].mesh
    assert len(mesh.positions) == 6
    for corner in range(12):
        old, new = FACES.ravel()[corner], mesh.triangles.ravel()[corner]
        np.testing.assert_array_equal(mesh.positions[new], ROOF[old])
        np.testing.assert_array_equal(mesh.colors[new], colors[old])
        np.testing.assert_array_equal(mesh.uv[new], uv[old])
    ridge = mesh.normals[(mesh.positions == (0, 1, 0)).all(axis=1)]
    np.testing.assert_allclose(ridge, [[0, 1, 0]], atol=1e-7)  # float32


def test_split_vertices_keep_their_attributes():
    """A box with rounded sides: the four walls of a prism with 24 sides are smooth, its caps are not."""
    angle = np.arange(24) * np.pi / 12
    ring = np.stack([np.cos(angle), 0 * angle, np.sin(angle)], axis=1)
    places = np.concatenate([ring, ring + np.array([0, 1, 0])])
    k = np.arange(24)
    walls = np.stack([k, k + 24, (k + 1) % 24 + 24, k, (k + 1) % 24 + 24, (k + 1) % 24], axis=1).reshape(-1, 3)
    cap = np.stack([np.zeros(22, dtype=int), np.arange(1, 23), np.arange(2, 24)], axis=1)
    mesh = gs.Mesh(places, np.concatenate([walls, cap, cap[:, ::-1] + 24]))
    made = load(mesh, smooth=30).nodes[0].mesh
    assert len(made.positions) == 96  # each of 48 once for a wall and once for a cap
    normals = made.normals[made.triangles]
    np.testing.assert_allclose(normals[:48], made.positions[made.triangles[:48]] * (1, 0, 1), atol=1e-6)
    np.testing.assert_allclose(normals[48:70], np.broadcast_to((0, -1, 0), (22, 3, 3)), atol=1e-6)
    np.testing.assert_array_equal(made.positions[made.triangles], mesh.positions[mesh.triangles])


@pytest.mark.parametrize("smooth", [-1, 181, "30", float("nan"), True])
def test_angles_that_are_refused(smooth):
    with pytest.raises(SettingsError, match="smooth must be"):
        load(gs.Mesh(ROOF, FACES), smooth=smooth)


def test_gltf_stays_flat_with_a_note(three):
    with pytest.warns(GlshadowWarning, match="smooth=30 is left out: in glTF, meshes without normals are flat"):
        assert load(three, smooth=30).nodes[0].mesh.normals is None


def test_smooth_on_the_command_line(tmp_path):
    text = "".join(f"v {x} {y} {z}\n" for x, y, z in ROOF) + "".join(
        f"f {a + 1} {b + 1} {c + 1}\n" for a, b, c in FACES
    )
    (tmp_path / "roof.obj").write_text(text)
    images = []
    for options in ((), ("--smooth", "91")):
        output = tmp_path / f"{len(images)}.png"
        result = CliRunner().invoke(
            main, ["render", str(tmp_path / "roof.obj"), "--size", "48x32", "-o", str(output), *options]
        )
        assert result.exit_code == 0, result.output
        images.append(gs.image.read(output))
    assert (images[0] != images[1]).any()
    refused = CliRunner().invoke(main, ["render", str(tmp_path / "roof.obj"), "--smooth", "200"])
    assert "is not an angle from 0 to 180 degrees" in refused.output


# --- trimesh's files ---


def test_what_trimesh_draws_is_drawn(models):
    """Every hostile file of which trimesh loads faces; but for those here, each with its reason."""
    import trimesh

    reasons = {
        "Box_Draco.glb": "trimesh draws its triangles all at one point; with DracoPy it is drawn",
        "BoxMeshopt.glb": "its data is compressed",
        "AllIndicesOutOfRange.gltf": "all indices are out of range",
        "BoxWithInfinites.glb": "all vertices are infinite",
        "made_cube_all_nan.glb": "no vertex is a number",
        "index_buffer_oob.gltf": "its mesh is in no scene",
        "index_buffer_primitive_restart.gltf": "its mesh is in no scene",
        "index_buffer_degenerate_triangle.gltf": "its mesh is in no scene",
        "made_all_degenerate.glb": "its size is zero",
        "draco_degenerate_mesh.obj": "its size is zero",
        "made_cube_zero_scale.glb": "its size is zero",
        "made_collinear_triangles.glb": "no triangle has an area",
        "made_cube_1e-25.glb": "its size is beyond float32's squares",
        "made_cube_1e30.glb": "its size is beyond float32's squares",
    }
    refused = {}
    for path in sorted((models / "hostile").iterdir()):
        if path.suffix.lower() not in (".glb", ".gltf", ".obj", ".ply", ".stl", ".off"):
            continue
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            try:
                theirs = trimesh.load_scene(path)
                if not any(len(getattr(each, "faces", ())) for each in theirs.geometry.values()):
                    continue
            except Exception:
                continue
            try:
                assert sum(len(node.mesh.triangles) for node in load(path).nodes) > 0
            except SceneError as error:
                refused[path.name] = str(error)
    assert set(refused) <= set(reasons), {name: refused[name] for name in set(refused) - set(reasons)}
