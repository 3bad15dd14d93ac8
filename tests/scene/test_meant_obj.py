"""OBJ and MTL as they are meant: objects and groups as nodes, smoothing groups, Tr, map_d, names of files outside the folder."""

import time
import warnings
from pathlib import Path

import numpy as np
import pytest

import glshadow as gs
from glshadow import image
from glshadow.errors import GlshadowWarning
from glshadow.io.load import load
from glshadow.scene.mesh import AlphaMode

from .test_meant_files import load_text, triangles

PLACES = "".join(f"v {x} {y} 0\n" for y in range(3) for x in range(3))  # a grid of 3 x 3
CELLS = ("f 1 2 5 4\n", "f 2 3 6 5\n", "f 4 5 8 7\n", "f 5 6 9 8\n")


@pytest.fixture(scope="session")
def meant(models: Path) -> Path:
    """Folder of the cases."""
    return models.parent / "cases" / "meant"


@pytest.mark.parametrize(
    ("before", "expected"),
    [
        (("", "", "", ""), [("mesh", 8)]),
        (("o a\n", "", "", ""), [("a", 8)]),
        (("g a\n", "", "", ""), [("a", 8)]),
        (("g default\n", "", "g off\n", ""), [("mesh", 8)]),
        (("o a\n", "o b\n", "", "o c\n"), [("a", 2), ("b", 4), ("c", 2)]),
        (("", "o b\n", "", ""), [("mesh", 2), ("b", 6)]),
        (("o a\n", "o a\n", "", ""), [("a", 2), ("a 2", 6)]),
        (("g a\n", "g b\n", "g a\n", "g b\n"), [("a", 4), ("b", 4)]),
        (("g a b\n", "g b\n", "", ""), [("a b", 2), ("b", 6)]),
        (("o a\ng x\n", "g y\n", "o b\ng x\n", ""), [("a/x", 2), ("a/y", 2), ("b/x", 4)]),
        (("o a\ng a\n", "o b\ng b\n", "", ""), [("a", 2), ("b", 6)]),
        (("o wheel front\r\n", "o  wheel\tback \n", "", ""), [("wheel front", 2), ("wheel back", 6)]),
        (("o a\n", "usemtl m\n", "o b\n", ""), [("a", 2), ("a 2", 2), ("b", 4)]),
        (("o a\no unused\n", "usemtl m\n", "usemtl n\n", ""), [("unused", 2), ("m", 2), ("n", 4)]),
    ],
)
def test_objects_and_groups_are_nodes(tmp_path, before, expected):
    text = PLACES + "".join(word + cell for word, cell in zip(before, CELLS, strict=True))
    (tmp_path / "a.mtl").write_text("newmtl m\nnewmtl n\n")
    scene = load_text(tmp_path / "a.obj", f"mtllib a.mtl\n{text}")
    assert triangles(scene) == expected
    assert all(len(node.mesh.positions) <= 3 * len(node.mesh.triangles) for node in scene.nodes)
    corners = [node.mesh.positions[node.mesh.triangles] for node in scene.nodes]
    areas = np.linalg.norm(np.cross(*np.moveaxis(np.diff(np.concatenate(corners), axis=1), 1, 0)), axis=1)
    assert 0.5 * areas.sum() == 4.0


def test_a_node_has_the_vertices_that_it_uses(tmp_path):
    text = PLACES + "".join(f"v {k} 9 9\n" for k in range(1000)) + "o a\n" + CELLS[0] + "o b\n" + CELLS[3]
    scene = load_text(tmp_path / "a.obj", text)
    assert [len(node.mesh.positions) for node in scene.nodes] == [4, 4]
    assert scene.bounds.tolist() == [[0, 0, 0], [2, 2, 0]]


def grid_of_groups(folder, count):
    places = "".join(f"v {k} 0 0\nv {k} 1 0\nv {k + 1} 0 0\n" for k in range(count))
    (folder / f"{count}.obj").write_text(
        places + "".join(f"g part{k}\nf {3 * k + 1} {3 * k + 2} {3 * k + 3}\n" for k in range(count))
    )
    return folder / f"{count}.obj"


def test_thousands_of_groups_cost_linear_time(tmp_path):
    """Four times as many take four times as long; if each looked through all vertices, sixteen times."""

    def seconds(count):
        path = grid_of_groups(tmp_path, count)
        taken = []
        for _ in range(3):
            start = time.process_time()
            assert len(load(path).nodes) == count
            taken.append(time.process_time() - start)
        return min(taken)

    assert seconds(4000) < 8.0 * seconds(1000)


def test_more_groups_than_nodes_may_be_are_merged(tmp_path):
    with pytest.warns(GlshadowWarning, match="its 5001 groups are more than 5000: .* into 1 node"):
        assert len(load(grid_of_groups(tmp_path, 5001)).nodes) == 1


# --- smoothing groups ---


def normals_at(scene, place):
    """Normals of the vertices at a place, of all nodes, in their order."""
    found = []
    for node in scene.nodes:
        mesh = node.mesh
        at = (mesh.positions == place).all(axis=1)
        found += [] if mesh.normals is None else mesh.normals[at].tolist()
    return np.reshape(found, (-1, 3))


def test_smooth_case_is_a_sphere(meant):
    """An icosphere of radius 1 around the origin: by symmetry its normals are nearly its positions."""
    (node,) = load(meant / "smooth.obj").nodes
    cosine = np.einsum("ij,ij->i", node.mesh.normals, node.mesh.positions)
    # 2e-4, one degree: a vertex of the icosphere is not quite symmetrical
    assert cosine.min() > 1.0 - 2e-4
    assert len(node.mesh.positions) == 162  # none is split


FOLD = "v -1 0 0\nv 0 1 0\nv 0 1 -2\nv -1 0 -2\nv 1 0 0\nv 1 0 -2\n"  # a roof of 90 degrees along z
ROOF = ("f 1 2 3 4\n", "f 2 5 6 3\n")
UP, LEFT, RIGHT = [0.0, 1.0, 0.0], [-(0.5**0.5), 0.5**0.5, 0.0], [0.5**0.5, 0.5**0.5, 0.0]


@pytest.mark.parametrize(
    ("before", "smooth", "ridge"),
    [
        (("s 1\n", ""), None, [UP]),
        (("s 7\n", "s 7\n"), None, [UP]),
        (("s on\n", ""), None, [UP]),
        (("s 1\n", "s 2\n"), None, []),
        (("s 1\n", "s off\n"), None, []),
        (("s 0\n", ""), None, []),
        (("", ""), None, []),
        (("", ""), 91.0, [UP]),
        (("", ""), 90.0, []),
        (("s 1\n", ""), 30.0, []),  # what is asked for comes first
        (("o a\ns 1\n", "o b\n"), None, [UP, UP]),  # smooth across the border of two nodes
    ],
)
def test_smoothing_groups(tmp_path, before, smooth, ridge):
    (tmp_path / "a.obj").write_text(FOLD + "".join(a + b for a, b in zip(before, ROOF, strict=True)))
    found = normals_at(load(tmp_path / "a.obj", smooth=smooth), (0, 1, 0))
    # 1e-7: float32
    np.testing.assert_allclose(found, np.reshape(ridge, (-1, 3)), atol=1e-7)


def test_normals_of_the_file_come_first(tmp_path):
    """A face with normals keeps them; the other one, in its smoothing group, gets the mean of both faces."""
    text = FOLD + "vn 0 0 1\ns 1\nf 1//1 2//1 3//1 4//1\n" + ROOF[1]
    found = normals_at(load_text(tmp_path / "a.obj", text), (0, 1, 0))
    np.testing.assert_allclose(sorted(found.tolist()), [[0, 0, 1], UP], atol=1e-7)


@pytest.mark.parametrize("suffix", ["stl", "ply", "off"])
def test_crease_angle_of_other_formats(tmp_path, suffix):
    """The roof as a file without normals."""
    places = np.array([[float(w) for w in line.split()[1:]] for line in FOLD.splitlines()])
    faces = [[0, 1, 2], [0, 2, 3], [1, 4, 5], [1, 5, 2]]
    rows = "".join(f"{x:g} {y:g} {z:g}\n" for x, y, z in places)
    lists = "".join(f"3 {a} {b} {c}\n" for a, b, c in faces)
    facets = "".join(
        "facet normal 0 0 0\nouter loop\n"
        + "".join("vertex {:g} {:g} {:g}\n".format(*places[k]) for k in face)
        + "endloop\nendfacet\n"
        for face in faces
    )
    text = {
        "stl": f"solid a\n{facets}endsolid a\n",
        "off": f"OFF\n6 4 0\n{rows}{lists}",
        "ply": "ply\nformat ascii 1.0\nelement vertex 6\nproperty float x\nproperty float y\nproperty float z\nelement face 4\n"
        f"property list uchar int vertex_indices\nend_header\n{rows}{lists}",
    }[suffix]
    (tmp_path / f"a.{suffix}").write_text(text)
    for smooth, ridge in ((None, []), (90.0, []), (91.0, [UP]), (180, [UP])):
        found = np.unique(normals_at(load(tmp_path / f"a.{suffix}", smooth=smooth), (0, 1, 0)), axis=0)
        np.testing.assert_allclose(found, np.reshape(ridge, (-1, 3)), atol=1e-7)


def test_smooth_shading_reaches_the_image(meant):
    """A smooth sphere has many more grey levels than its 320 flat faces show."""
    with gs.Renderer() as renderer:
        shown = [
            renderer.render(
                load(meant / "smooth.obj", smooth=smooth), size=(96, 96), samples=1, outputs=("linear",)
            ).linear
            for smooth in (0, None)
        ]
    flat, smooth = (len(np.unique(np.round(each[..., 0], 5))) for each in shown)
    assert flat < 320
    assert smooth > 4 * flat


# --- MTL ---

LEAF = "mtllib m.mtl\nv -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nusemtl leaf\nf 1/1 2/2 3/3 4/4\n"


def material(folder, lines, obj=LEAF):
    (folder / "m.mtl").write_text(f"newmtl leaf\n{lines}\n")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", GlshadowWarning)
        return load_text(folder / "a.obj", obj).nodes[0].mesh.material


@pytest.mark.parametrize(
    ("lines", "alpha"),
    [("Tr 0.8", 0.2), ("Tr 0.25", 0.75), ("tr .5", 0.5), ("Tr 0", 1.0), ("d 0.3\nTr 0.9", 0.3), ("Tr 0.9\nd 0.3", 0.3),
     ("d 1\nTr 1", 1.0), ("Tr 1", 1.0), ("Tr glass", 1.0), ("d -halo 0.5", 0.5)],
)  # fmt: skip
def test_tr_and_d(tmp_path, lines, alpha):
    found = material(tmp_path, lines)
    assert found.color[3] == pytest.approx(alpha)
    assert found.alpha_mode is (AlphaMode.BLEND if alpha < 1.0 else AlphaMode.OPAQUE)


def test_tr_case(meant):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", GlshadowWarning)
        glass = {node.name: node.mesh.material for node in load(meant / "tr.obj").nodes}["glass"]
    assert glass.color[3] == pytest.approx(0.2)


MASK = np.array([[0, 255], [255, 0]], dtype=np.uint8)


def pictures(folder):
    """A grey mask, the same as alpha of a red picture, as its green channel; a soft one; a larger red picture."""
    image.write(folder / "grey.png", np.repeat(MASK[..., None], 3, axis=2))
    red = np.zeros((2, 2, 4), dtype=np.uint8)
    red[..., 0], red[..., 3] = 255, MASK
    image.write(folder / "alpha.png", red)
    green = np.full((2, 2, 3), 255, dtype=np.uint8)
    green[..., 1] = MASK
    image.write(folder / "green.png", green)
    image.write(folder / "soft.png", np.full((2, 2, 3), 128, dtype=np.uint8))
    image.write(folder / "red.png", np.full((4, 4, 3), (255, 0, 0), dtype=np.uint8))


@pytest.mark.parametrize(
    "lines",
    ["map_d grey.png", "map_d alpha.png", "map_d -imfchan g green.png", "map_d -imfchan m alpha.png", "map_d -imfchan l grey.png",
     "map_Kd red.png\nmap_d grey.png", "map_d grey.png\nmap_Kd red.png", "map_Kd alpha.png\nmap_d alpha.png", "MAP_D grey.png"],
)  # fmt: skip
def test_binary_masks_cut(tmp_path, lines):
    pictures(tmp_path)
    found = material(tmp_path, lines)
    assert found.alpha_mode is AlphaMode.MASK
    side = len(found.texture) // 2
    np.testing.assert_array_equal(found.texture[..., 3], np.kron(MASK, np.ones((side, side), dtype=np.uint8)))
    if "Kd" in lines:
        assert (found.texture[..., :3] == (255, 0, 0)).all()


@pytest.mark.parametrize(("lines", "alpha"), [("map_d soft.png", 1.0), ("map_d grey.png\nd 0.5", 0.5)])
def test_other_masks_blend(tmp_path, lines, alpha):
    pictures(tmp_path)
    found = material(tmp_path, lines)
    assert found.alpha_mode is AlphaMode.BLEND
    assert found.color[3] == alpha


def test_soft_edges_of_a_binary_mask_cut(tmp_path):
    """A disc whose edge is antialiased, as masks of leaves are."""
    x, y = np.meshgrid(np.arange(64) - 31.5, np.arange(64) - 31.5)
    disc = np.clip(24.5 - np.hypot(x, y), 0.0, 1.0)
    image.write(tmp_path / "disc.png", np.repeat(np.round(255 * disc).astype(np.uint8)[..., None], 3, axis=2))
    assert material(tmp_path, "map_d disc.png").alpha_mode is AlphaMode.MASK


def test_mapd_case_is_cut_in_picture_and_shadow(meant):
    """Where its mask is 0 there is nothing, and the wall behind it is lit there."""
    leaf = load(meant / "mapd.obj").nodes[0]
    mask = leaf.mesh.material.texture[..., 3]
    assert set(np.unique(mask)) == {0, 255}
    wall = gs.Mesh([[-4, -4, -1], [4, -4, -1], [4, 4, -1], [-4, 4, -1]], [[0, 1, 2], [0, 2, 3]])
    scene = gs.Scene([leaf, gs.Node(wall, name="wall")])
    sun = gs.DirectionalLight(direction=(0, 0, -1))
    camera = gs.OrthographicCamera((0, 0, 5), (0, 0, 0), height=2.0)
    with gs.Renderer() as renderer:
        frame = renderer.render(scene, camera, sun, (64, 64), outputs=("node", "visibility"), samples=1)
        behind = gs.OrthographicCamera((0, 0, -0.5), (0, 0, -1), height=2.0)
        shadow = renderer.render(scene, behind, sun, (64, 64), outputs=("visibility",), samples=1).visibility[0]
    side = 64 // len(mask)
    there = np.kron(mask, np.ones((side, side), dtype=np.uint8)) > 127
    inner = np.pad(there[2:-2, 2:-2], 2)  # texels blend over the border of the image, which repeats
    for found in (frame.node == 0, shadow < 0.5):
        share = float((found == there)[2:-2, 2:-2].mean())
        assert share > 0.9, share
    assert 0.0 < inner.mean() < 1.0


@pytest.mark.parametrize("name", ["../secret.png", "/etc/secret.png", "C:\\secret.png", "a/../../secret.png"])
def test_files_outside_the_folder_are_called_so(tmp_path, name):
    (tmp_path / "in").mkdir()
    image.write(tmp_path / "secret.png", np.zeros((2, 2, 3), dtype=np.uint8))
    (tmp_path / "in/m.mtl").write_text(f"newmtl leaf\nmap_Kd {name}\n")
    with pytest.warns(GlshadowWarning, match="that it names is outside the model's folder: drawn without it"):
        load_text(tmp_path / "in/a.obj", LEAF)


def test_name_that_begins_with_two_dots_is_inside(tmp_path):
    image.write(tmp_path / "..red.png", np.full((2, 2, 3), (255, 0, 0), dtype=np.uint8))
    assert material(tmp_path, "map_Kd ..red.png").texture is not None


# --- emission, normal maps, samplers ---


@pytest.mark.parametrize(
    ("lines", "emission"),
    [("Ke 0.5 0.25 0", (0.5, 0.25, 0)), ("Ke 0 0 0", (0, 0, 0)), ("Ke 2", (2, 2, 2)), ("Ke a b c", (0, 0, 0)),
     ("Ke 1e9 0 -1", (65408, 0, 0)), ("map_Ke red.png", (1, 1, 1)), ("Ke 0 0 0\nmap_Ke red.png", (1, 1, 1)),
     ("Ke 3 3 3\nmap_Ke red.png", (3, 3, 3))],
)  # fmt: skip
def test_emission(tmp_path, lines, emission):
    pictures(tmp_path)
    found = material(tmp_path, lines)
    assert found.emission == emission
    assert (found.emission_map is not None) == ("map_Ke" in lines)


def test_emission_reaches_the_image(tmp_path):
    """Black but for what it emits: linear .5 is 188 of 255."""
    (tmp_path / "m.mtl").write_text("newmtl leaf\nKd 0 0 0\nKe 0.5 0.5 0.5\n")
    scene = load_text(tmp_path / "a.obj", LEAF)
    camera = gs.OrthographicCamera((0, 0, 5), (0, 0, 0), height=1.0)
    with gs.Renderer() as renderer:
        assert (renderer.render(scene, camera, (), (8, 8), ambient=0.0, samples=1).image[..., :3] == 188).all()


def normal_map(folder, name="normals.png", color=(128, 128, 255)):
    image.write(folder / name, np.full((2, 2, 3), color, dtype=np.uint8))
    return name


@pytest.mark.parametrize("statement", ["norm", "map_Bump", "bump", "map_bump -bm 0.5"])
def test_normal_maps(tmp_path, statement):
    normal_map(tmp_path)
    found = material(tmp_path, f"{statement} normals.png")
    assert (found.normal_map.pixels[..., :3] == (128, 128, 255)).all()
    assert found.texture is None


def test_height_maps_are_noted(tmp_path):
    normal_map(tmp_path, "heights.png", (90, 90, 90))
    (tmp_path / "m.mtl").write_text("newmtl leaf\nmap_Bump heights.png\n")
    with pytest.warns(GlshadowWarning, match=r"map_Bump \(a height map\) of its materials: not drawn"):
        assert load_text(tmp_path / "a.obj", LEAF).nodes[0].mesh.material.normal_map is None


def test_clamped_maps(tmp_path):
    pictures(tmp_path)
    assert material(tmp_path, "map_Kd -clamp on red.png").sampler.wrap == ("clamp", "clamp")
    assert material(tmp_path, "map_Kd -clamp off red.png").sampler.wrap == ("repeat", "repeat")
    assert material(tmp_path, "map_Ke -clamp on red.png").emission_map.sampler.wrap == ("clamp", "clamp")


def test_materials_that_differ_by_their_maps_are_not_merged(tmp_path):
    names = [normal_map(tmp_path, f"{k}.png", (128, 128, 255 - k)) for k in range(2)]
    (tmp_path / "m.mtl").write_text("".join(f"newmtl m{k}\nnorm {names[k % 2]}\n" for k in range(502)))
    places = "".join(f"v {k} 0 0\nv {k + 1} 0 0\nv {k} 1 0\n" for k in range(502)) + "vt 0 0\n"
    faces = "".join(f"usemtl m{k}\nf {3 * k + 1}/1 {3 * k + 2}/1 {3 * k + 3}/1\n" for k in range(502))
    with pytest.warns(GlshadowWarning, match="into 2 node"):
        assert len(load_text(tmp_path / "a.obj", f"mtllib m.mtl\n{places}{faces}").nodes) == 2
