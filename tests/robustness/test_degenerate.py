"""Small cases of what the fuzzer found: one for each cause that was fixed."""

import warnings

import numpy as np
import pytest

import glshadow as gs
from glshadow.scenes import shapes

from . import mutated_files, verdict


@pytest.fixture(scope="module")
def renderer():
    with gs.Renderer() as renderer:
        yield renderer


def solid(positions, triangles):
    return gs.Scene((gs.Node(gs.Mesh(positions, triangles), np.eye(4), "solid"),))


def test_edge_on_surface_shows_what_rays_hit(renderer):
    """The eye lies in the plane of a needle's cap, whose fragments have no depth; one ray runs through the needle to its far end."""
    half = 9236.691467016617
    scene = solid(*shapes.box((2 * half, 2e-8 * half, 2e-8 * half)))
    camera = gs.PerspectiveCamera(
        (-half, 4.282950519132855e-05, -5.475211350190919e-05),
        up=(0.7232112427580216, 0.0891171367717086, 0.7034480689858998),
        fov_y=75.27758405774615,
        near=2.002e-5 * half,  # a derived one would show the sides from inside
    )
    frame = renderer.render(scene, camera, (), (17, 63), outputs=("depth", "triangle"), samples=1)
    truth = gs.trace(scene, camera, gs.DirectionalLight(), (17, 63), samples=1)
    assert np.argwhere(truth.triangle >= 0).tolist() == [[31, 8]]
    np.testing.assert_array_equal(frame.triangle, truth.triangle)
    assert frame.depth[31, 8] == np.float32(2.0 * half)


@pytest.mark.parametrize("value", [np.nan, np.inf])
@pytest.mark.parametrize("name", ["TRANSLATION", "ROTATION", "SCALE"])
def test_instances_at_non_finite_places_are_refused(name, value, tmp_path):
    document, binary = mutated_files.box_document(plane=True)
    columns = 4 if name == "ROTATION" else 3
    rows = np.ones((2, columns), dtype="<f4")
    rows[1, 0] = value
    document["accessors"].append({"bufferView": 1, "componentType": 5126, "count": 2, "type": f"VEC{columns}"})
    document["bufferViews"].append({"buffer": 0, "byteOffset": len(binary), "byteLength": rows.nbytes})
    document["buffers"][0]["byteLength"] = len(binary) + rows.nbytes
    document["nodes"][0]["extensions"] = {"EXT_mesh_gpu_instancing": {"attributes": {name: 1}}}
    path = tmp_path / "instances.glb"
    path.write_bytes(mutated_files.pack(document, binary + rows.tobytes()))
    with pytest.raises(
        gs.SceneError, match=rf"instances\.glb: .*nodes\[0\] instancing: 1 of 2 {name} values are not finite"
    ):
        gs.load(path)


def test_narrow_view_far_from_the_origin(renderer):
    """All corners of the frustum's near face are one point in float64, so the frustum's planes must not be derived from them."""
    place = np.array([228910.85582940138, 65704.6251557398, -194688.26556936547])
    positions, triangles = shapes.rectangle((-1, 0, 1), (2, 0, 0), (0, 0, -2))
    scene = solid(positions * 0.13 + place, triangles)
    camera = gs.PerspectiveCamera(tuple(place + np.array([-6e-10, 9.2e-10, 1.3e-9])), tuple(place), fov_y=1e-3)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", gs.GlshadowWarning)
        result = verdict.judged(lambda: verdict.checked_render(renderer, scene, camera, None, (46, 73)))
    assert result.kind != verdict.FAIL, f"{result.cause}\n{result.detail}"


def test_texture_coordinates_beyond_float32(tmp_path):
    (tmp_path / "far.obj").write_text("mtllib far.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 1e39 0\nusemtl a\nf 1/1 2/1 3/1\n")
    (tmp_path / "far.mtl").write_text("newmtl a\nmap_Kd far.png\n")
    gs.image.write(tmp_path / "far.png", np.full((2, 2, 3), 128, np.uint8))
    with pytest.warns(gs.GlshadowWarning, match="no usable texture coordinates"):
        scene = gs.load(tmp_path / "far.obj")
    assert scene.nodes[0].mesh.material.texture is None


def test_texture_transforms_beyond_float32(tmp_path):
    document, binary = mutated_files.box_document()
    info = document["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"]
    path = tmp_path / "box.glb"
    info["extensions"] = {"KHR_texture_transform": {"scale": [1e300, 1.0]}}
    path.write_bytes(mutated_files.pack(document, binary))
    with pytest.warns(gs.GlshadowWarning, match="no usable TEXCOORD_0"):
        gs.load(path)
    info["extensions"] = {"KHR_texture_transform": {"rotation": float("nan")}}
    path.write_bytes(mutated_files.pack(document, binary))
    with pytest.warns(gs.GlshadowWarning, match="KHR_texture_transform must be made of finite numbers, .*: drawn with"):
        gs.load(path)


def test_colour_above_one_is_clamped(tmp_path):
    document, binary = mutated_files.box_document()
    document["materials"][0]["pbrMetallicRoughness"]["baseColorFactor"] = [1e300, -1.0, 0.5, 1.0]
    path = tmp_path / "box.glb"
    path.write_bytes(mutated_files.pack(document, binary))
    with pytest.warns(gs.GlshadowWarning, match=r"materials\[0\]: its colour \(1e\+300, -1, 0\.5, 1\) is clipped"):
        scene = gs.load(path)
    assert (1.0, 0.0, 0.5, 1.0) in {node.mesh.material.color for node in scene.nodes}
    with pytest.raises(gs.SceneError, match=r"color must be 4 finite numbers, each in \[0, 1\]"):
        gs.Material(color=(2.0, 0.0, 0.0, 1.0))


def test_text_that_is_not_utf8_is_read(tmp_path):
    """Latin-1 in names and comments, as older exporters write it."""
    text = {
        "a.off": "OFF\n# b\xfcste\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n",
        "a.stl": "solid b\xfcste\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid\n",
        "a.ply": "ply\nformat ascii 1.0\ncomment b\xfcste\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
        "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n",
        "a.obj": "mtllib a.mtl\n# b\xfcste\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl b\xfcste\nf 1 2 3\n",
    }
    (tmp_path / "a.mtl").write_text("newmtl b\xfcste\nKd 1 0 0\n", encoding="latin-1")
    for name, content in text.items():
        (tmp_path / name).write_text(content, encoding="latin-1")
        scene = gs.load(tmp_path / name)
        assert len(scene.nodes[0].mesh.triangles) == 1
    assert scene.nodes[0].mesh.material.color == (1.0, 0.0, 0.0, 1.0)  # of a.obj


def test_position_beyond_the_coordinate_limit_is_refused():
    positions, triangles = shapes.box((1e10, 1e10, 1e10))
    matrix = np.eye(4)
    matrix[0, 3] = 1e25
    with pytest.raises(gs.SceneError, match=r"it is 1e\+25 from the origin"):
        gs.load(gs.Scene((gs.Node(gs.Mesh(positions, triangles), np.eye(4), "box"),)).moved({"box": matrix}))


def test_quaternion_of_any_length_is_normalised(tmp_path):
    document, binary = mutated_files.box_document(plane=True)
    path = tmp_path / "turned.glb"
    matrices = []
    for length in (1.0, 1e-300, 1e300):
        document["nodes"][0]["rotation"] = [0.0, 0.6 * length, 0.0, 0.8 * length]
        path.write_bytes(mutated_files.pack(document, binary))
        matrices.append(gs.load(path).nodes[0].world_from_mesh)
    np.testing.assert_allclose(matrices[1:], [matrices[0]] * 2, atol=1e-15)  # a few roundings of numbers below 1
