"""`load` with the real models, with trimesh's and pyrender's objects, and with cameras and lights in files."""

import json
import subprocess
import sys
import warnings
from collections import Counter
from pathlib import Path

import numpy as np
import pytest
import trimesh

from glshadow.core.cameras import PerspectiveCamera
from glshadow.core.spaces import orthographic
from glshadow.errors import GlshadowWarning, SceneError, SettingsError
from glshadow.io.load import load
from glshadow.lights import DirectionalLight, PointLight, RectLight, SkyLight, SpotLight
from glshadow.scene.box import default_sun
from glshadow.scene.mesh import AlphaMode
from glshadow.scene.nodes import Scene

from .glb import Glb

# name: (rendered triangles, nodes, distinct meshes, world extents, distinct images): as stated in the models' README
MODELS = {
    "house_scene.glb": (10_497, 2, 2, (0.503, 0.187, 0.504), 1),
    "japanese_bridge_garden.glb": (21_883, 13, 13, (11.36, 7.01, 11.37), 0),
    "dungeon_instances.glb": (324_691, 1_044, 18, (65.35, 5.0, 65.14), 1),
    "bicycle.glb": (276_540, 33, 33, (4.699, 2.503, 1.357), 0),
    "chess_board.glb": (178_848, 8, 8, (337.1, 43.6, 273.0), 0),
    "flight_helmet/flight_helmet.gltf": (94_722, 6, 6, (0.367, 0.716, 0.372), 5),
    "milk_truck.glb": (3_624, 5, 4, (4.869, 2.583, 2.792), 1),
    "cesium_man.glb": (4_672, 1, 1, (0.312, 1.507, 1.138), 1),
    "athlete_robot.stl": (25_372, 1, 1, (6.65, 7.53, 1.80), 0),
    "demosthenes_bust.obj": (16_719, 1, 1, (1.751, 2.694, 1.535), 0),
    "terrain_jacksboro.ply": (275_772, 1, 1, (29_905, 31_783, 840), 0),
    "brain_cortex.ply": (608_752, 1, 1, (142.9, 164.7, 114.1), 0),
}
SMOOTH = {"bicycle.glb": False, "athlete_robot.stl": False, "demosthenes_bust.obj": True, "milk_truck.glb": True}


def quiet_load(path, **options):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", GlshadowWarning)
        return load(path, **options)


def world(scene):
    return np.concatenate(
        [n.mesh.positions @ n.world_from_mesh[:3, :3].T + n.world_from_mesh[:3, 3] for n in scene.nodes]
    )


@pytest.mark.parametrize("name", MODELS)
def test_facts_of_the_models(models, name):
    triangles, nodes, meshes, extents, textured = MODELS[name]
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        scene = load(models / name)
    assert not caught
    assert sum(len(node.mesh.triangles) for node in scene.nodes) == triangles
    assert len(scene.nodes) == nodes
    distinct = {id(node.mesh): node.mesh for node in scene.nodes}
    assert len(distinct) == meshes
    # 1e-3 relative: the digits that the README gives
    np.testing.assert_allclose(np.ptp(world(scene), axis=0), extents, rtol=1e-3, atol=5e-3 * max(extents) / 10)
    pictures = [mesh for mesh in distinct.values() if mesh.material.texture is not None]
    assert len({id(mesh.material.texture) for mesh in pictures}) == textured
    assert all(mesh.uv is not None for mesh in pictures)
    if name in SMOOTH:
        assert any(mesh.normals is not None for mesh in distinct.values()) == SMOOTH[name]
    assert scene.name == name.split("/")[-1].rsplit(".", 1)[0]
    assert load(models / name, look="plain").lights == (default_sun(),)


@pytest.mark.parametrize("name", ["milk_truck.glb", "house_scene.glb", "chess_board.glb", "demosthenes_bust.obj"])
def test_positions_equal_those_of_trimesh_bit_for_bit(models, name):
    theirs = trimesh.load_scene(models / name, process=False)
    scene = load(models / name)
    expected = {
        tuple(row) for geometry in theirs.geometry.values() for row in geometry.triangles.reshape(-1, 3).tolist()
    }
    ours = {tuple(row) for node in scene.nodes for row in node.mesh.positions[node.mesh.triangles.ravel()].tolist()}
    assert ours == expected


def test_materials_of_the_models(models):
    house = load(models / "house_scene.glb")
    masks = [node.mesh.material for node in house.nodes if node.mesh.material.alpha_mode is AlphaMode.MASK]
    assert [(mask.cutoff, mask.texture.shape, mask.double_sided) for mask in masks] == [(0.5, (1024, 1024, 4), False)]
    helmet = quiet_load(models / "flight_helmet" / "flight_helmet.gltf")
    modes = Counter(node.mesh.material.alpha_mode for node in helmet.nodes)
    assert modes == {AlphaMode.OPAQUE: 5, AlphaMode.BLEND: 1}
    garden = load(models / "japanese_bridge_garden.glb")
    assert all(node.mesh.material.double_sided for node in garden.nodes)
    dungeon = load(models / "dungeon_instances.glb")
    assert len({id(node.mesh.material.texture) for node in dungeon.nodes}) == 1  # one image, decoded once
    mirrored = sum(np.linalg.det(node.world_from_mesh[:3, :3]) < 0 for node in dungeon.nodes)
    assert 0 < mirrored < len(dungeon.nodes)
    truck = load(models / "milk_truck.glb")
    wheels = [node for node in truck.nodes if sum(other.mesh is node.mesh for other in truck.nodes) == 2]
    assert len(wheels) == 2
    assert wheels[0].name != wheels[1].name


def test_uv_equal_those_of_trimesh(models):
    """trimesh, too, has v upwards: the same point of the image for the same corner."""
    theirs = next(iter(trimesh.load_scene(models / "cesium_man.glb", process=False).geometry.values()))
    mesh = quiet_load(models / "cesium_man.glb").nodes[0].mesh
    expected = np.sort(theirs.visual.uv[theirs.faces].reshape(-1, 2), axis=0)
    # 1e-6: float32
    np.testing.assert_allclose(np.sort(mesh.uv[mesh.triangles].reshape(-1, 2), axis=0), expected, atol=1e-6)
    picture = np.asarray(theirs.visual.material.baseColorTexture.convert("RGBA"))
    # 2 of 255: two JPEG decoders
    assert np.abs(mesh.material.texture.astype(int) - picture).max() <= 2


@pytest.mark.parametrize(
    ("axis", "expected"), [(None, (1, 2, 3)), ("y", (1, 2, 3)), ("z", (1, 3, -2)), ("x", (-2, 1, 3))]
)
def test_up_axis(axis, expected):
    mesh = trimesh.Trimesh([[0, 0, 0], [1, 0, 0], [1, 2, 3]], [[0, 1, 2]], process=False)
    scene = load(mesh, up_axis=axis)
    node = scene.nodes[0]
    assert (node.world_from_mesh[:3, :3] @ (1.0, 2.0, 3.0)).tolist() == list(expected)
    assert np.linalg.det(node.world_from_mesh) == 1.0


def test_up_axis_turns_cameras_and_lights():
    box = trimesh.creation.box()
    lights = (
        DirectionalLight(direction=(0, 0, -1)),
        SpotLight(position=(0, 0, 4), direction=(0, 0, -1)),
        PointLight(position=(1, 2, 3)),
        RectLight(position=(0, 0, 4), direction=(0, 0, -1), up=(0, 1, 0)),
        SkyLight(direction=(0, 0, -1)),
    )
    built = Scene(load(box).nodes, PerspectiveCamera((0, -5, 1), (0, 0, 0), (0, 0, 1)), lights, "built")
    turned = load(built, up_axis="z")
    assert turned.camera.position == (0, 1, 5)
    assert turned.camera.up == (0, 1, 0)
    assert turned.lights[0].direction == (0, -1, 0)
    assert turned.lights[1].position == (0, 4, 0)
    assert turned.lights[1].direction == (0, -1, 0)
    assert turned.lights[2].position == (1, 3, -2)
    assert turned.lights[3].position == (0, 4, 0)
    assert turned.lights[3].direction == (0, -1, 0)
    assert turned.lights[3].up == (0, 0, -1)
    assert turned.lights[4].direction == (0, -1, 0)
    assert load(Scene(built.nodes, None, ())).lights == ()  # no light is not the same as no value
    with pytest.raises(SettingsError, match="up_axis"):
        load(built, up_axis="w")


def test_ground(models):
    scene = load(models / "athlete_robot.stl", up_axis="z", ground=True, name="rover")
    assert scene.name == "rover"
    assert scene.nodes[-1].name == "ground"
    model = load(models / "athlete_robot.stl", up_axis="z")
    lowest, diagonal = world(model)[:, 1].min(), np.linalg.norm(np.ptp(model.bounds, axis=0))
    height = scene.nodes[-1].world_from_mesh[1, 3]
    # before a floor of the model at the same height, and nearer than anyone sees
    assert lowest - 2e-4 * diagonal < height < lowest - 5e-5 * diagonal
    assert load(model, ground=True, look="plain").nodes[-1].world_from_mesh[1, 3] == lowest


# --- trimesh objects ---


def test_trimesh_normals_are_used_only_if_they_were_set():
    ball = trimesh.creation.icosphere(subdivisions=1)
    assert load(ball).nodes[0].mesh.normals is None
    _ = ball.vertex_normals
    assert load(ball).nodes[0].mesh.normals is None  # computed by trimesh: reading them must not change the image
    given = trimesh.Trimesh(ball.vertices, ball.faces, vertex_normals=ball.vertices, process=False)
    np.testing.assert_allclose(load(given).nodes[0].mesh.normals, ball.vertices, atol=1e-6)


def test_trimesh_scene_shares_meshes_and_keeps_its_camera():
    scene = trimesh.Scene()
    box = trimesh.creation.box()
    scene.add_geometry(box, node_name="a", geom_name="box")
    pose = trimesh.transformations.translation_matrix((1e9, 0, 3))
    scene.graph.update(frame_to="b", matrix=pose, geometry="box")
    loaded = load(scene)
    assert [node.name for node in loaded.nodes] == ["a", "b"]
    assert loaded.nodes[0].mesh is loaded.nodes[1].mesh
    assert loaded.nodes[1].world_from_mesh[0, 3] == 1e9
    scene.graph.update(frame_to="b", matrix=trimesh.transformations.translation_matrix((2, 0, 3)))
    scene.camera = trimesh.scene.cameras.Camera(resolution=(200, 100), fov=(60.0, 40.0))
    scene.camera_transform = trimesh.transformations.translation_matrix((0, 0, 9))
    camera = load(scene).camera
    assert camera.position == (0, 0, 9)
    assert camera.fov_y == pytest.approx(40.0)
    np.testing.assert_allclose(np.asarray(camera.target)[:2], 0.0)


def test_trimesh_colours():
    box = trimesh.creation.box()
    box.visual.face_colors = (255, 0, 0, 255)
    assert load(box).nodes[0].mesh.material.color == (1.0, 0.0, 0.0, 1.0)
    box.visual.face_colors = (188, 188, 188, 255)
    # sRGB 188 is linear 0.503 (IEC 61966-2-1)
    assert load(box).nodes[0].mesh.material.color[0] == pytest.approx(0.503, abs=1e-3)


def test_trimesh_objects_without_triangles():
    with pytest.raises(SceneError, match="nothing to render"):
        load(trimesh.Scene())


def test_far_away_trimesh_object_keeps_float64():
    box = trimesh.creation.box()
    box.apply_translation((1e7, 0, 0))
    assert np.ptp(load(box).nodes[0].mesh.positions[:, 0]) == 1.0


# --- OBJ ---


def test_obj_material(tmp_path):
    from PIL import Image

    Image.new("P", (2, 2), 1).save(tmp_path / "picture.png")
    (tmp_path / "m.mtl").write_text(
        "newmtl red\nKd 0.123456 0.5 1\n\nnewmtl pic\nKd 1 1 1\nmap_Kd -s 1 1 1 picture.png\n"
    )
    corners = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\n"
    (tmp_path / "m.obj").write_text(f"mtllib m.mtl\n{corners}usemtl red\nf 1/1 2/2 3/3\nusemtl pic\nf 3/3 2/2 1/1\n")
    scene = load(tmp_path / "m.obj")
    plain = [n.mesh.material for n in scene.nodes if n.mesh.material.texture is None]
    pictured = [n.mesh for n in scene.nodes if n.mesh.material.texture is not None]
    assert [material.color for material in plain] == [(0.123456, 0.5, 1.0, 1.0)]
    assert [mesh.material.texture.shape for mesh in pictured] == [(2, 2, 4)]
    assert {tuple(row) for row in pictured[0].uv.tolist()} == {(0, 0), (1, 0), (0, 1)}


# --- glTF made here ---


def gltf(folder, **changes):
    document = {
        "asset": {"version": "2.0"},
        "scenes": [{"nodes": [0, 1, 2, 3, 4]}],
        "nodes": [
            {"mesh": 0, "name": "same"},
            {"mesh": 0, "name": "same", "scale": [-1, 1, 1]},
            {"camera": 0, "translation": [0, 1, 8]},
            {
                "extensions": {"KHR_lights_punctual": {"light": 0}},
                "rotation": [-0.7071067811865476, 0, 0, 0.7071067811865476],
            },
            {"extensions": {"KHR_lights_punctual": {"light": 1}}, "translation": [0, 5, 0]},
        ],
        "cameras": [{"type": "perspective", "perspective": {"yfov": 0.5, "znear": 0.1}}],
        "extensions": {
            "KHR_lights_punctual": {
                "lights": [
                    {"type": "directional", "color": [1, 0.5, 0.25], "intensity": 3},
                    {
                        "type": "spot",
                        "intensity": 40,
                        "range": 20,
                        "spot": {"innerConeAngle": 0.1, "outerConeAngle": 0.2},
                    },
                ]
            }
        },
        "materials": [
            {
                "pbrMetallicRoughness": {"baseColorFactor": [0.5, 0.25, 0.125, 0.5], "baseColorTexture": {"index": 0}},
                "alphaMode": "MASK",
                "alphaCutoff": 0.3,
                "doubleSided": True,
            },
            {},
        ],
        "textures": [{"source": 0}],
        "images": [{"uri": "picture.png"}],
        "meshes": [
            {
                "primitives": [
                    {"attributes": {"POSITION": 0, "TEXCOORD_0": 1, "COLOR_0": 2}, "material": 0},
                    {"attributes": {"POSITION": 0}, "material": 1},
                ]
            }
        ],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"},
            {"bufferView": 1, "componentType": 5121, "count": 3, "type": "VEC2", "normalized": True},
            {"bufferView": 2, "componentType": 5123, "count": 3, "type": "VEC3", "normalized": True},
        ],
        "bufferViews": [
            {"buffer": 0, "byteLength": 36},
            {"buffer": 0, "byteOffset": 36, "byteLength": 12, "byteStride": 4},
            {"buffer": 0, "byteOffset": 48, "byteLength": 24, "byteStride": 8},
        ],
        "buffers": [{"byteLength": 72, "uri": "data%20file.bin"}],
    }
    document.update(changes)
    positions = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], dtype="<f4").tobytes()
    uv = np.array([[0, 255, 9, 9], [255, 255, 9, 9], [0, 0, 9, 9]], dtype="u1").tobytes()
    color = np.array([[65535, 32768, 0, 7]] * 3, dtype="<u2").tobytes()
    (folder / "data file.bin").write_bytes(positions + uv + color)
    from PIL import Image

    picture = Image.new("RGBA", (3, 2), (10, 20, 30, 40))
    picture.putpixel((0, 0), (200, 100, 50, 255))
    picture.save(folder / "picture.png")
    (folder / "made.gltf").write_text(json.dumps(document))
    return folder / "made.gltf"


def test_gltf_camera_and_lights(tmp_path):
    scene = load(gltf(tmp_path))
    assert scene.camera.position == (0, 1, 8)
    assert scene.camera.fov_y == pytest.approx(np.degrees(0.5))
    assert scene.camera.near is None
    np.testing.assert_allclose(np.subtract(scene.camera.target, scene.camera.position)[:2], 0.0)
    sun, spot = scene.lights
    np.testing.assert_allclose(sun.direction, (0, -1, 0), atol=1e-15)  # -z turned down
    assert (sun.color, sun.intensity) == ((1, 0.5, 0.25), 3)
    assert (spot.position, spot.intensity, spot.range, spot.falloff) == ((0, 5, 0), 40, 20, 2)
    np.testing.assert_allclose((spot.inner_angle, spot.outer_angle), np.degrees((0.1, 0.2)))


def test_gltf_orthographic_camera(tmp_path):
    lens = {"xmag": 2.0, "ymag": 1.5, "znear": 0.1, "zfar": 100.0}
    cameras = [{"type": "orthographic", "orthographic": lens}]
    camera = load(gltf(tmp_path, cameras=cameras)).camera
    assert (camera.position, camera.height) == ((0, 1, 8), 3.0)
    assert (camera.near, camera.far) == (None, None)
    np.testing.assert_allclose(camera.window((200, 100)), (-3.0, 3.0, -1.5, 1.5))
    turned = load(gltf(tmp_path, cameras=cameras), up_axis="z").camera
    assert (turned.position, turned.height) == ((0, 8, -1), 3.0)
    lens["ymag"] = -1.5
    assert load(gltf(tmp_path, cameras=cameras)).camera.height == 3.0


@pytest.mark.parametrize(
    ("kind", "lens", "message"),
    [
        ("orthographic", {"xmag": 1.0, "ymag": 0.0}, "ymag of its camera must be a number other than 0, got 0"),
        ("orthographic", {"xmag": 1.0}, "ymag of its camera must be a number other than 0, got None"),
        ("orthographic", {"ymag": "1"}, "ymag of its camera must be a number other than 0, got '1'"),
        ("orthographic", {"ymag": 1e30}, "OrthographicCamera height must be a finite number in"),
        ("perspective", {"yfov": [1]}, "yfov of its camera must be a number other than 0"),
        ("perspective", {"yfov": 4.0}, "PerspectiveCamera fov_y must be a finite number in"),
        ("perspective", [], "its camera"),
    ],
    ids=range(7),
)
def test_gltf_camera_refused(tmp_path, kind, lens, message):
    with pytest.raises(SceneError, match=message):
        load(gltf(tmp_path, cameras=[{"type": kind, kind: lens}]))


def test_gltf_camera_can_be_named_if_the_first_is_broken(tmp_path):
    glb = Glb(nodes=[{"mesh": 0}, {"camera": 0, "name": "bad"}, {"camera": 1}, {"camera": 2}])
    lens = {"type": "perspective", "name": "good", "perspective": {"yfov": 0.5}}
    glb.json["cameras"] = [{"type": "perspective", "perspective": {"yfov": 4.0}}, lens, lens]
    glb.mesh({"attributes": {"POSITION": glb.add([[0, 0, 0], [1, 0, 0], [0, 1, 0]])}})
    path = glb.save(tmp_path / "a.glb")
    with pytest.raises(SceneError, match=r"camera 'bad': .*fov_y.*: name another one, of good, node3$"):
        load(path)
    assert list(load(path, camera="good").cameras) == ["good", "node3"]  # the camera's own name, if its node has none


@pytest.mark.parametrize(
    ("light", "note"),
    [
        ({"type": "area"}, "must be directional, point or spot, got 'area': left out"),
        ({"type": "point", "intensity": "x"}, "is not valid glTF"),
        ({"type": "directional", "color": [1, 2]}, "color"),
        ({"type": "point", "intensity": -1.0}, "intensity"),
        ([], "must be an object"),
    ],
)
def test_gltf_broken_light_is_left_out(tmp_path, light, note):
    extension = {"KHR_lights_punctual": {"lights": [light, {"type": "spot"}]}}
    with pytest.warns(GlshadowWarning, match=f"{note}.*left out|{note}"):
        scene = load(gltf(tmp_path, extensions=extension))
    assert [type(each) for each in scene.lights] == [SpotLight]


def test_gltf_spot_with_an_inner_angle_beyond_its_outer_one(tmp_path):
    spot = {"type": "spot", "spot": {"innerConeAngle": 0.5, "outerConeAngle": 0.25}}
    with pytest.warns(GlshadowWarning, match="inner angle of 28.6479 degrees: narrowed to its outer one, 14.3239"):
        scene = load(gltf(tmp_path, extensions={"KHR_lights_punctual": {"lights": [{"type": "point"}, spot]}}))
    assert scene.lights[1].inner_angle == scene.lights[1].outer_angle


def test_gltf_unknown_camera_is_left_out(tmp_path):
    with pytest.warns(GlshadowWarning, match="is fisheye, which is not supported"):
        scene = load(gltf(tmp_path, cameras=[{"type": "fisheye", "fisheye": {}}]))
    assert scene.camera.fov_y <= 35.0  # derived


def test_gltf_material_and_nodes(tmp_path):
    scene = load(gltf(tmp_path))
    assert [node.name for node in scene.nodes] == ["same", "same 2", "same.1", "same.1 2"]  # two materials, two nodes
    assert scene.nodes[0].mesh is scene.nodes[2].mesh
    assert np.linalg.det(scene.nodes[2].world_from_mesh) == -1.0
    mesh = scene.nodes[0].mesh
    # vertex colours that are all one colour are multiplied in; 1e-4: 16 bits
    np.testing.assert_allclose(mesh.material.color, (0.5, 0.125, 0.0, 0.5), atol=1e-4)
    assert (mesh.material.alpha_mode, mesh.material.cutoff, mesh.material.double_sided) == (AlphaMode.MASK, 0.3, True)
    assert mesh.uv.tolist() == [[0, 0], [1, 0], [0, 1]]  # glTF's v = 1 is the bottom
    assert mesh.material.texture[0, 0].tolist() == [200, 100, 50, 255]  # row 0 is the top
    assert mesh.material.texture[1, 2].tolist() == [10, 20, 30, 40]  # not multiplied by alpha


def test_gltf_texture_transform(tmp_path):
    moved = {"offset": [0.5, 0.25], "scale": [2, 3]}
    texture = {"index": 0, "extensions": {"KHR_texture_transform": moved}}
    mesh = load(gltf(tmp_path, materials=[{"pbrMetallicRoughness": {"baseColorTexture": texture}}, {}])).nodes[0].mesh
    # v down: (0, 1) -> (0.5, 3.25); v up: 1 - 3.25
    np.testing.assert_allclose(mesh.uv, [[0.5, -2.25], [2.5, -2.25], [0.5, 0.75]])


@pytest.mark.parametrize("broken", [b"", b"not a picture", b"\x89PNG\r\n\x1a\n and then nothing"])
def test_gltf_broken_image_is_a_warning(tmp_path, broken):
    path = gltf(tmp_path)
    (tmp_path / "picture.png").write_bytes(broken)
    with pytest.warns(GlshadowWarning, match="drawn without this texture"):
        scene = load(path)
    assert scene.nodes[0].mesh.material.texture is None


def test_gltf_wide_spot_is_narrowed(tmp_path):
    wide = {"lights": [{"type": "point"}, {"type": "spot", "spot": {"outerConeAngle": np.pi / 2}}]}
    with pytest.warns(GlshadowWarning, match="narrowed to 89"):
        scene = load(gltf(tmp_path, extensions={"KHR_lights_punctual": wide}))
    assert isinstance(scene.lights[0], PointLight)
    assert scene.lights[1].outer_angle == 89.0


def test_gltf_needs_no_trimesh(models):
    """Importing trimesh takes a second, more than rendering a small model."""
    path = str(models / "chess_board.glb")
    code = f"import sys; from glshadow.io.load import load; load({path!r}); sys.exit('trimesh' in sys.modules)"
    subprocess.run([sys.executable, "-c", code], check=True, timeout=60)


# --- pyrender ---


@pytest.fixture
def pyrender():
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # deprecations of its own dependencies
        return pytest.importorskip("pyrender", reason="optional: pip install glshadow[pyrender]")


def test_pyrender_mesh_alone(pyrender):
    scene = load(pyrender.Mesh.from_trimesh(trimesh.creation.box(), smooth=False))
    assert [(node.name, len(node.mesh.triangles)) for node in scene.nodes] == [("mesh", 12)]
    with pytest.raises(SceneError, match=r"a pyrender\.PerspectiveCamera is neither a scene nor a mesh"):
        load(pyrender.PerspectiveCamera(yfov=0.6))


def test_pyrender_scene(pyrender):
    poses = np.tile(np.eye(4), (3, 1, 1))
    poses[:, 0, 3] = (0, 2, 4)
    material = pyrender.MetallicRoughnessMaterial(
        baseColorFactor=(0.5, 0.25, 0.125, 1.0), alphaMode="MASK", alphaCutoff=0.25
    )
    mesh = pyrender.Mesh.from_trimesh(trimesh.creation.box(), material=material, poses=poses, smooth=False)
    scene = pyrender.Scene()
    above = np.eye(4)
    above[1, 3] = 7.0
    scene.add(mesh, pose=above, name="boxes")
    scene.add(pyrender.PerspectiveCamera(yfov=0.6), pose=above)
    scene.add(pyrender.PointLight(intensity=50.0, range=9.0), pose=above)
    scene.add(pyrender.SpotLight(intensity=30.0, innerConeAngle=0.2, outerConeAngle=0.4), pose=above)
    scene.add(pyrender.DirectionalLight(color=(1.0, 0.5, 0.0), intensity=2.0), pose=above)
    loaded = load(scene)
    assert [node.name for node in loaded.nodes] == ["boxes[0]", "boxes[1]", "boxes[2]"]
    assert len({id(node.mesh) for node in loaded.nodes}) == 1
    assert [node.world_from_mesh[:3, 3].tolist() for node in loaded.nodes] == [[0, 7, 0], [2, 7, 0], [4, 7, 0]]
    assert loaded.nodes[0].mesh.material.color == (0.5, 0.25, 0.125, 1.0)
    assert (loaded.nodes[0].mesh.material.alpha_mode, loaded.nodes[0].mesh.material.cutoff) == (AlphaMode.MASK, 0.25)
    assert loaded.camera.position == (0, 7, 0)
    assert loaded.camera.fov_y == pytest.approx(np.degrees(0.6))
    kinds = {type(light): light for light in loaded.lights}
    assert (kinds[PointLight].position, kinds[PointLight].intensity, kinds[PointLight].range) == ((0, 7, 0), 50, 9)
    assert kinds[PointLight].falloff == kinds[SpotLight].falloff == 2.0
    np.testing.assert_allclose(kinds[SpotLight].outer_angle, np.degrees(0.4))
    assert kinds[DirectionalLight].direction == (0, 0, -1)


def test_pyrender_intrinsics(pyrender):
    scene = pyrender.Scene()
    scene.add(pyrender.Mesh.from_trimesh(trimesh.creation.box()))
    scene.add(pyrender.IntrinsicsCamera(fx=500, fy=400, cx=320, cy=240), pose=np.eye(4))
    camera = load(scene).camera
    np.testing.assert_allclose(camera.window((640, 480)), (-0.64, 0.64, -0.6, 0.6))
    # an image of another size: pixels keep their size, the principal point is 320 from its left and 240 from its top
    np.testing.assert_allclose(camera.window((320, 480)), (-0.64, 0.0, -0.6, 0.6))


def test_pyrender_orthographic(pyrender):
    scene = pyrender.Scene()
    scene.add(pyrender.Mesh.from_trimesh(trimesh.creation.box()))
    camera = pyrender.OrthographicCamera(xmag=5.0, ymag=1.5)
    scene.add(camera, pose=trimesh.transformations.translation_matrix((1, 2, 3)))
    loaded = load(scene).camera
    assert (loaded.position, loaded.height) == ((1, 2, 3), 3.0)
    for size in [(640, 480), (100, 300)]:
        theirs = camera.get_projection_matrix(*size)
        np.testing.assert_allclose(orthographic(*loaded.window(size), 0.05, 100.0)[:2], theirs[:2], rtol=1e-12)


def test_blend_without_transparency_is_opaque(pyrender, tmp_path):
    """pyrender's own default material is BLEND; if it cast nothing, every shadow would be missing."""
    scene = pyrender.Scene()
    scene.add(pyrender.Mesh.from_trimesh(trimesh.creation.box()))
    assert load(scene).nodes[0].mesh.material.alpha_mode is AlphaMode.OPAQUE
    see_through = {"pbrMetallicRoughness": {"baseColorFactor": [1, 1, 1, 0.5]}, "alphaMode": "BLEND"}
    loaded = load(gltf(tmp_path, materials=[{"alphaMode": "BLEND"}, see_through]))
    modes = [node.mesh.material.alpha_mode for node in loaded.nodes[:2]]
    assert modes == [AlphaMode.OPAQUE, AlphaMode.BLEND]


def test_pyrender_texture(pyrender):
    box = trimesh.creation.box()
    pixels = np.zeros((2, 2, 3), dtype=np.uint8)
    pixels[0, 0] = 255
    box.visual = trimesh.visual.TextureVisuals(uv=box.vertices[:, :2] + 0.5, image=None)
    texture = pyrender.Texture(source=pixels, source_channels="RGB")
    scene = pyrender.Scene()
    mesh = pyrender.Mesh.from_trimesh(box, material=pyrender.MetallicRoughnessMaterial(baseColorTexture=texture))
    mesh.primitives[0].texcoord_0 = np.asarray(mesh.primitives[0].positions)[:, :2] + 0.5
    scene.add(mesh)
    loaded = load(scene).nodes[0].mesh
    assert loaded.material.texture[0, 0].tolist() == [255, 255, 255, 255]
    np.testing.assert_allclose(loaded.uv, loaded.positions[:, :2] + 0.5)


# --- PLY ---


def test_ply_missing_image_is_a_warning_and_trimesh_stays_quiet(tmp_path, caplog):
    head = "ply\nformat ascii 1.0\ncomment TextureFile gone.png\nelement vertex 3\n"
    head += "".join(f"property float {name}\n" for name in ("x", "y", "z", "nx", "ny", "nz"))
    head += "element face 1\nproperty list uchar int vertex_indices\nend_header\n"
    (tmp_path / "a.ply").write_text(head + "0 0 0 0 0 2\n1 0 0 0 0 2\n0 1 0 0 0 2\n3 0 1 2\n")
    with pytest.warns(GlshadowWarning, match=r"'gone\.png' that it names is missing"):
        scene = load(tmp_path / "a.ply")
    assert scene.nodes[0].mesh.normals.tolist() == [[0, 0, 1]] * 3  # the file's, normalised
    assert not caplog.records


def test_obj_with_a_latin1_comment_loads(tmp_path: Path) -> None:
    path = tmp_path / "old.obj"
    path.write_bytes(b"# Gr\xf6sse\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    assert len(load(path).nodes[0].mesh.triangles) == 1
