"""Every hostile file has its expected outcome: it loads, loads with a warning, or raises a SceneError; nothing else."""

import importlib.util
import json
import re
import shutil
import struct
import tracemalloc
import warnings
from pathlib import Path

import numpy as np
import pytest

from glshadow.errors import GlshadowWarning, SceneError
from glshadow.io.load import load

from ..pace import at_most

LOADS = "loads"
MESHOPT = importlib.util.find_spec("meshopt") is not None
DRACO = importlib.util.find_spec("DracoPy") is not None

# file -> LOADS, ("warns", pattern) or ("fails", pattern); the patterns are matched against the message
OUTCOMES: dict[str, str | tuple[str, str]] = {
    "Box_Draco.glb": LOADS if DRACO else ("fails", "KHR_draco_mesh_compression.*pip install DracoPy"),
    "BoxMeshopt.glb": LOADS if MESHOPT else ("fails", "EXT_meshopt_compression"),
    "milk_truck_quantized.glb": LOADS,
    "simple_instancing.glb": LOADS,
    "SimpleSparseAccessor.gltf": LOADS,
    "ZeroLengthBufferView.gltf": ("warns", "1 of 4 vertices are far outside the range"),
    "IndexOutOfRange.gltf": (
        "warns",
        "'Mesh' primitive 0: index 255 is out of range, it has 24 vertices.*: 1 of 12 triangles left out",
    ),
    "AllIndicesOutOfRange.gltf": ("fails", "index 65535 is out of range.*36 of 36"),
    "index_buffer_oob.gltf": ("fails", "nothing to render: it has no scene"),
    "index_buffer_primitive_restart.gltf": ("fails", "nothing to render"),
    "index_buffer_degenerate_triangle.gltf": ("fails", "nothing to render"),
    "BoxWithInfinites.glb": ("fails", "24 of 24 vertices have coordinates that are not finite"),
    "made_cube_inf_vertex.glb": (
        "warns",
        "1 of 8 vertices have coordinates that are not finite.*: 4 of 12 triangles left out",
    ),
    "made_cube_nan_vertex.glb": (
        "warns",
        "1 of 8 vertices have coordinates that are not finite.*: 4 of 12 triangles left out",
    ),
    "made_cube_all_nan.glb": ("fails", "8 of 8 vertices have coordinates that are not finite"),
    "made_unused_nan_vertex.glb": LOADS,
    "made_nan.stl": ("warns", "1 of 2 facets left out: their coordinates are not finite"),
    "draco_inf_nan.obj": ("fails", "3 of 3 vertices have coordinates that are not finite"),
    "draco_float_inf_point_cloud.ply": ("warns", "3 of 16 points are not finite"),
    "invalid_elements_float.gltf": ("fails", "nothing to render"),
    "made_all_degenerate.glb": ("fails", "nothing to render: its size is zero"),
    "draco_degenerate_mesh.obj": ("fails", "nothing to render: its size is zero"),
    "made_collinear_triangles.glb": ("fails", "all its triangles have zero area"),
    "draco_deg_faces.obj": LOADS,
    "made_single_triangle.glb": LOADS,
    "made_zero_thickness_plane_xz.glb": LOADS,
    "made_single_sided_plane.glb": LOADS,
    "made_needle.glb": LOADS,
    "made_duplicate_coplanar.glb": LOADS,
    "draco_non_manifold_wrap.obj": LOADS,
    "joined_tetrahedra.obj": LOADS,
    "busted.STL": LOADS,
    "made_mixed_winding.glb": LOADS,
    "soup.stl": LOADS,
    "BoxBadNormals.glb": LOADS,
    "no_indices_3storybuilding.glb": LOADS,
    "Mesh_PrimitiveMode_04.gltf": LOADS,
    "BoxInterleaved.glb": LOADS,
    "made_index_only_no_tri_multiple.glb": ("warns", "4 indices are not a multiple of 3.*: the last 1 left out"),
    "mesh_primitive_no_position.gltf": ("fails", "nothing to render"),
    "made_cube_mirrored.glb": LOADS,
    "draco_one_face_123_mirror.gltf": LOADS,
    "made_cube_singular_matrix.glb": LOADS,
    "made_cube_zero_scale.glb": ("fails", "nothing to render: its size is zero"),
    "node_matrix_indecomposable.gltf": ("fails", "nothing to render"),
    "node_infinite_transform.gltf": ("fails", "nothing to render"),
    "node_rotation_non_unit.gltf": ("fails", "nothing to render"),
    "RecursiveNodes.gltf": ("fails", "cycle"),
    "node_node_loop.gltf": ("fails", "cycle"),
    "magnum_scene-invalid-cycle-deep.gltf": ("fails", "cycle"),
    "node_node_parent_override.gltf": ("fails", "two parents"),
    "magnum_scene-invalid-multiple-parents.gltf": ("fails", "two parents"),
    "made_deep_nodes_2000.glb": LOADS,
    "made_cube_at_1e7.glb": ("warns", "1 mesh.* float32 has steps of 1,.*already lost in the file"),
    "made_cube_node_1e9.glb": LOADS,
    "made_far_outlier.glb": ("warns", "smaller than one texel"),
    "made_cube_1e-6.glb": LOADS,
    "made_cube_1e-25.glb": ("fails", "its size is 1e-25"),
    "made_cube_1e30.glb": ("fails", r"its size is 1e\+30"),
    "draco_one_face_123_cesium_rtc.gltf": ("warns", "CESIUM_RTC"),
    "magnum_required-extensions-unsupported.gltf": ("fails", "EXT_lights_image_based"),
    "MissingBin.gltf": ("fails", "'BoxTextured0.bin' is missing"),
    "magnum_buffer-invalid-short-size-embedded.gltf": ("fails", "nothing to render"),
    "IncorrectVertexArrays.gltf": ("warns", "TruncatedCube"),
    "made_missing_texture.obj": ("warns", "'not_there.png' that it names is missing"),
    "made_missing_mtl.obj": ("warns", "'does_not_exist.mtl' that it names is missing"),
    "fox.glb": LOADS,
    "alpha_blend_mode_test.glb": LOADS,
    "nancolor.obj": ("warns", "colours are not finite"),
    "made_alpha_mask_checker.glb": LOADS,
    "made_alpha_blend_half.glb": LOADS,
    "obj_points.obj": LOADS,
    "obj_wireframe.obj": LOADS,
    "ply_points_bin.ply": LOADS,
    "points_emptyface.ply": LOADS,
    "empty.obj": ("fails", "nothing to render"),
    "empty.ply": ("fails", "nothing to render"),
    "empty.stl": ("fails", "nothing to render"),
    "empty_nodes.glb": ("fails", "nothing to render"),
    "magnum_empty.gltf": ("fails", "nothing to render"),
    "NoScene.gltf": ("fails", "nothing to render: it has no scene"),
    "SceneWithoutNodes.gltf": ("fails", "nothing to render: its scene has no nodes"),
    "magnum_scene-default-none.gltf": ("fails", "nothing to render"),
    "glb_truncated_chunk_data.glb": ("fails", "declares 48 bytes, the file has 47"),
    "glb_chunk_too_big.glb": ("fails", "broken GLB"),
    "glb_length_mismatch.glb": ("fails", "declares 49 bytes, the file has 48"),
    "glb_empty_file.glb": ("fails", "the file is empty"),
    "glb_invalid_magic.glb": ("fails", "not a GLB file"),
    "magnum_error.gltf": ("fails", "not valid glTF: asset must be an object"),
    "magnum_mesh-no-indices-no-vertices-no-buffer-uri.glb": ("fails", "nothing to render"),
    "node_unresolved_mesh.gltf": ("fails", "nothing to render"),
    "malformed.obj": ("warns", "index 0; indices of OBJ begin at 1"),
    "notenoughindices.obj": ("warns", "1 face.* with fewer than 3 corners"),
    "negative_indices.obj": LOADS,
    "polygonfaces.obj": ("warns", "'surface.mtl' that it names is missing"),
    "jacked.obj": ("warns", "'nonexistent.mtl' that it names is missing"),
    "draco_eof_test.obj": LOADS,
    "draco_extra_vertex.obj": LOADS,
    "OutOfMemory.off": ("fails", "declares more than the file can hold"),
    "multibody.stl": LOADS,
    "mirror.ply": LOADS,
    "7_8ths_cube.stl": LOADS,
}

COMPANIONS = {".bin", ".mtl", ".md"}


def test_no_file_without_an_outcome(models):
    files = {path.name for path in (models / "hostile").iterdir() if path.suffix not in COMPANIONS}
    assert files == set(OUTCOMES)


@pytest.mark.parametrize("name", OUTCOMES)
def test_outcome(models, name, capfd):
    path = models / "hostile" / name
    kind, pattern = (LOADS, "") if OUTCOMES[name] == LOADS else OUTCOMES[name]
    with at_most(5.0):  # a hundred times the slowest file's need; without limits the 2,000 nodes take minutes
        check_outcome(path, kind, pattern)
    printed = capfd.readouterr()
    assert printed.out + printed.err == "", "a loader's log lines leaked"


def check_outcome(path, kind, pattern):
    if kind == "fails":
        with pytest.raises(SceneError, match=pattern) as raised:
            load(path)
        assert str(raised.value).startswith(path.name)
    else:
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            scene = load(path)
        assert {warning.category for warning in caught} <= {GlshadowWarning}
        messages = [str(warning.message) for warning in caught]
        assert all(message.startswith(path.name) for message in messages)
        assert all(warning.filename == __file__ for warning in caught), "a warning must point at the call of load"
        assert bool(messages) == (kind == "warns"), messages
        assert kind == LOADS or any(re.search(pattern, message) for message in messages), messages
        assert np.isfinite(scene.bounds).all()
        for node in scene.nodes:
            assert node.mesh.normals is None or np.allclose(np.linalg.norm(node.mesh.normals, axis=1), 1.0, atol=1e-6)


def world_extents(scene):
    corners = [n.mesh.positions @ n.world_from_mesh[:3, :3].T + n.world_from_mesh[:3, 3] for n in scene.nodes]
    return np.ptp(np.concatenate(corners), axis=0)


def hostile(models, name):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", GlshadowWarning)
        return load(models / "hostile" / name)


def test_loaded_geometry_is_correct(models):
    assert world_extents(hostile(models, "SimpleSparseAccessor.gltf"))[1] == 4.0  # sparse values: 2, 3, 4
    quantized = world_extents(hostile(models, "milk_truck_quantized.glb"))
    # 1e-3: int16 steps of a truck of 4.9 m are 1.5e-4
    np.testing.assert_allclose(quantized, world_extents(load(models / "milk_truck.glb")), atol=1e-3)
    instanced = hostile(models, "simple_instancing.glb")
    assert len(instanced.nodes) == 125
    assert len({id(node.mesh) for node in instanced.nodes}) == 1
    assert np.isfinite(hostile(models, "made_unused_nan_vertex.glb").nodes[0].mesh.positions).all()
    assert hostile(models, "made_unused_nan_vertex.glb").bounds[1].tolist() == [0.5, 0.5, 0.5]
    signs = [np.linalg.det(n.world_from_mesh[:3, :3]) for n in hostile(models, "made_cube_mirrored.glb").nodes]
    assert min(signs) < 0 < max(signs)
    far = hostile(models, "made_cube_node_1e9.glb")
    difference = far.nodes[1].world_from_mesh[:3, 3] - far.nodes[0].world_from_mesh[:3, 3]
    assert abs(np.abs(difference).max() - 64.0) == 0.0
    strip = hostile(models, "Mesh_PrimitiveMode_04.gltf").nodes[0].mesh
    corners = strip.positions[strip.triangles]
    facing = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])[:, 2]
    assert (facing > 0).all() or (facing < 0).all()  # every second triangle of a strip has reversed winding
    assert len(hostile(models, "polygonfaces.obj").nodes[0].mesh.triangles) == 3
    assert len(hostile(models, "multibody.stl").nodes) == 2


def test_alpha_modes(models):
    cutoffs = sorted(
        node.mesh.material.cutoff
        for node in hostile(models, "alpha_blend_mode_test.glb").nodes
        if node.mesh.material.alpha_mode.value == "MASK"
    )
    assert cutoffs == [0.25, 0.5, 0.75]
    checker = hostile(models, "made_alpha_mask_checker.glb").nodes[0].mesh
    assert checker.material.alpha_mode.value == "MASK"
    assert checker.material.double_sided
    assert np.mean(checker.material.texture[..., 3] >= 128) == 0.5


def test_bad_normals_become_face_normals(models):
    mesh = hostile(models, "BoxBadNormals.glb").nodes[0].mesh
    corners = mesh.positions[mesh.triangles]
    faces = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    faces /= np.linalg.norm(faces, axis=1, keepdims=True)
    agreement = np.einsum("tij,tj->ti", mesh.normals[mesh.triangles].astype(float), faces)
    assert agreement.max() > 0.99  # a box: valid normals, and those that are replaced, equal the faces'


def test_huge_header_needs_no_memory(models):
    tracemalloc.start()
    with pytest.raises(SceneError):
        load(models / "hostile" / "OutOfMemory.off")
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 1 << 22


# --- files made here ---


def triangle(**changes):
    data = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], dtype="<f4").tobytes()
    document = {
        "asset": {"version": "2.0"},
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}],
        "bufferViews": [{"buffer": 0, "byteLength": 36}],
        "buffers": [{"byteLength": 36}],
    }
    document.update(changes)
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    size = 12 + 8 + len(text) + 8 + len(data)
    head = struct.pack("<4sII", b"glTF", 2, size) + struct.pack("<I4s", len(text), b"JSON")
    return head + text + struct.pack("<I4s", len(data), b"BIN\0") + data


def test_the_plain_triangle_loads(tmp_path):
    (tmp_path / "plain.glb").write_bytes(triangle())
    assert len(load(tmp_path / "plain.glb").nodes) == 1


@pytest.mark.parametrize(
    ("changes", "pattern"),
    [
        ({"buffers": [{"byteLength": 36, "uri": "../secret.bin"}]}, "leaves the model's folder"),
        ({"buffers": [{"byteLength": 36, "uri": "a/../../secret.bin"}]}, "leaves the model's folder"),
        ({"buffers": [{"byteLength": 36, "uri": "%2e%2e/secret.bin"}]}, "leaves the model's folder"),
        ({"buffers": [{"byteLength": 36, "uri": "..\\secret.bin"}]}, "leaves the model's folder"),
        ({"buffers": [{"byteLength": 36, "uri": "/etc/hostname"}]}, "leaves the model's folder"),
        ({"buffers": [{"byteLength": 36, "uri": "http://example.org/a.bin"}]}, "leaves the model's folder"),
        ({"buffers": [{"byteLength": 36, "uri": "file:///etc/hostname"}]}, "leaves the model's folder"),
        ({"buffers": [{"byteLength": 36, "uri": "data:;base64,!!"}]}, "not valid base64"),
        ({"buffers": [{"byteLength": 37}]}, "declares 37 bytes, but only 36"),
        ({"bufferViews": [{"buffer": 0, "byteLength": 40}]}, "covers bytes 0 to 40"),
        ({"bufferViews": [{"buffer": 0, "byteOffset": 4, "byteLength": 32}]}, "needs 36 bytes"),
        ({"bufferViews": [{"buffer": 0, "byteLength": 36, "byteStride": 4}]}, "4 apart"),
        ({"bufferViews": [{"buffer": -1, "byteLength": 36}]}, r"refers to buffers\[-1\]"),
        ({"accessors": [{"componentType": 5126, "count": 10**15, "type": "VEC3"}]}, "bytes of memory per byte read"),
        ({"accessors": [{"bufferView": 0, "componentType": 5126, "count": "3", "type": "VEC3"}]}, "must be an integer"),
        ({"accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "MAT4"}]}, "must be VEC3"),
        ({"meshes": [{"primitives": [{"attributes": {}}]}]}, "no POSITION"),
        ({"meshes": [{"primitives": [{"attributes": {"POSITION": 7}}]}]}, r"accessors\[7\]"),
        ({"meshes": "none"}, "must be an array"),
        ({"nodes": [{"mesh": 3}]}, r"refers to meshes\[3\]"),
        ({"nodes": [{"mesh": 0, "matrix": [1e308] * 15 + [1]}]}, "not affine"),
        ({"nodes": [{"mesh": 0, "translation": [float("inf"), 0, 0]}]}, "3 finite numbers"),
        ({"nodes": [{"mesh": 0, "rotation": [0, 0, 0, 0]}]}, "not a quaternion"),
        ({"nodes": [{"children": [1], "scale": [1e200] * 3}, {"mesh": 0, "scale": [1e200] * 3}]}, "overflows"),
        ({"nodes": [{"mesh": 0, "scale": [1e-40] * 3}]}, "its size is"),
        ({"scenes": [{"nodes": [0, 0]}]}, "appears twice"),
        ({"scene": 4}, r"refers to scenes\[4\]"),
        ({"asset": {"version": "1.0"}}, "only glTF 2"),
        ({"extensionsRequired": ["VENDOR_unknown"]}, "VENDOR_unknown"),
    ],
)
def test_broken_gltf_is_refused(tmp_path, changes, pattern):
    path = tmp_path / "models" / "broken.glb"
    path.parent.mkdir()
    (tmp_path / "secret.bin").write_bytes(bytes(36))
    path.write_bytes(triangle(**changes))
    with pytest.raises(SceneError, match=pattern) as raised:
        load(path)
    assert str(raised.value).startswith("broken.glb")


def test_random_byte_changes_give_a_scene_or_a_scene_error(tmp_path, rng):
    plain = triangle()
    digits = [place for place in range(20, len(plain) - 44) if plain[place : place + 1].isdigit()]
    path = tmp_path / "fuzz.glb"
    loaded, causes = 0, []
    for turn in range(400):
        data = bytearray(plain)
        if turn % 2:
            data[rng.choice(digits)] = rng.integers(48, 58)
        else:
            data[rng.integers(0, len(data))] = rng.integers(0, 256)
        path.write_bytes(data)
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", GlshadowWarning)
                load(path)
            loaded += 1
        except SceneError as error:
            causes.append(str(error))
    assert 20 < loaded < 380
    assert not any("FloatingPointError" in cause for cause in causes)


@pytest.mark.parametrize(("name", "keep"), [("athlete_robot.stl", 0.5), ("terrain_jacksboro.ply", 0.5)])
def test_the_whole_rows_of_a_truncated_file_are_drawn(models, tmp_path, name, keep):
    """They are the first ones of the whole file, to the bit."""
    data = (models / name).read_bytes()
    (tmp_path / name).write_bytes(data[: int(len(data) * keep)])
    with pytest.warns(GlshadowWarning, match=f"{name}: its header declares .* it is cut off"):
        (part,) = load(tmp_path / name).nodes
    (whole,) = load(models / name).nodes
    count = len(part.mesh.triangles)
    assert 0.2 * len(whole.mesh.triangles) < count < len(whole.mesh.triangles)
    corners = [mesh.positions[mesh.triangles[:count]] for mesh in (part.mesh, whole.mesh)]
    np.testing.assert_array_equal(*corners)


@pytest.mark.parametrize("name", ["athlete_robot.stl", "terrain_jacksboro.ply"])
def test_a_file_cut_before_its_first_face_is_refused(models, tmp_path, name):
    (tmp_path / name).write_bytes((models / name).read_bytes()[:400])
    with pytest.raises(SceneError, match=name):
        load(tmp_path / name)


def test_relative_obj_indices_count_from_their_line(tmp_path):
    first = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf -3 -2 -1\n"
    (tmp_path / "two.obj").write_text(first + "v 0 0 5\nv 1 0 5\nv 0 1 5\nf -3 -2 -1\n")
    mesh = load(tmp_path / "two.obj").nodes[0].mesh
    heights = np.sort(mesh.positions[mesh.triangles][:, :, 2].mean(axis=1))
    assert heights.tolist() == [0.0, 5.0]


def test_nothing_outside_the_folder_is_read_for_an_obj(tmp_path, models):
    folder = tmp_path / "inside"
    folder.mkdir()
    shutil.copy(models / "hostile" / "made_missing_texture.mtl", tmp_path / "outside.mtl")
    (folder / "a.obj").write_text("mtllib ../outside.mtl\nusemtl m\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    with pytest.warns(GlshadowWarning, match="outside the model's folder"):
        load(folder / "a.obj")


@pytest.mark.parametrize(
    ("source", "pattern"), [("nowhere.glb", "file not found"), ("scene.xyz", ".glb, .gltf"), (5, "int")]
)
def test_non_models_are_refused(source, pattern, tmp_path):
    if source == "nowhere.glb":
        source = Path(tmp_path, source)
    with pytest.raises(SceneError, match=pattern):
        load(source)
