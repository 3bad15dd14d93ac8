"""OBJ and MTL files as exporters write them, deviating from the specification, each with the correct result."""

import warnings

import numpy as np
import pytest
from PIL import Image

from glshadow.core.srgb import linear_from_srgb
from glshadow.errors import GlshadowWarning, SceneError
from glshadow.io.load import load
from glshadow.scene.mesh import AlphaMode

from .test_dialects import ARROW, SQUARE, area, colors, loaded

CORNERS = "".join(f"v {x:g} {y:g} {z:g}\n" for x, y, z in SQUARE) + "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nvn 0 0 1\n"
PLATE = CORNERS + "f 1 2 3\nf 1 3 4\n"


@pytest.mark.parametrize(
    "text",
    [
        PLATE,
        PLATE.replace("\n", "\r"),
        PLATE.replace("\n", "\r\n"),
        PLATE.replace("\nv", "\rv").replace("\nf", "\r\nf"),
        PLATE.strip(),
        PLATE.replace("f 1 2 3", "f 1 \\\n 2 \\\r\n 3"),
        PLATE.replace("v ", " \t v\t").replace("f ", "\tf   "),
        PLATE.replace("f 1 2 3", "f 1 2 3 # all of it\n#f 9 9 9"),
        PLATE.replace("f 1 3 4", "g side\ns off\nf 1 3 4"),
        CORNERS + "f 1 2 3 4\n",
        CORNERS + "f 1/1 2/2 3/3 4/4\n",
        CORNERS + "f 1//1 2//1 3//1 4//1\n",
        CORNERS + "f 1/1/1 2/2/1 3//1 4/4\n",
        CORNERS + "f 1/ 2// 3 4\n",
        CORNERS + "f -4 -3 -2 -1\nv 9 9 9\n",
        CORNERS + "f -4/-4/-1 2/2/1 -2/-2/-1 4/4/1\n",
        CORNERS.replace(" 0\n", " 0 1.0\n") + "f 1 2 3 4\n",
    ],
)
def test_obj(tmp_path, text):
    scene = loaded(tmp_path / "plate.obj", text)
    assert scene.bounds.tolist() == [[0, 0, 0], [2, 3, 0]]
    assert area(scene) == (6.0, 6.0)


def test_obj_normals_of_corners(tmp_path):
    text = CORNERS + "vn 0 0 -7\nf 1//1 2//1 3//1\nf 1//2 3//2 4//2\n"
    mesh = loaded(tmp_path / "a.obj", text).nodes[0].mesh
    assert mesh.normals[mesh.triangles][:, :, 2].tolist() == [[1, 1, 1], [-1, -1, -1]]
    assert len(mesh.positions) == 6


def test_obj_concave(tmp_path):
    corners = "".join(f"v {x:g} {y:g} {z:g}\n" for x, y, z in ARROW)
    for order in ("1 2 3 4", "2 3 4 1", "3 4 1 2", "4 1 2 3"):
        assert area(loaded(tmp_path / "a.obj", f"{corners}f {order}\n")) == pytest.approx((2.0, 2.0), rel=1e-15)


@pytest.mark.parametrize(("red", "half"), [("1 0 0", "0.5019607843137255 0 0"), ("255 0 0", "128 0 0")])
def test_obj_vertex_colours(tmp_path, red, half):
    """After the position, in sRGB; a vertex without is white, and a fourth number alone is a weight."""
    text = f"v 0 0 0 {red}\nv 1 0 0 {half}\nv 0 1 0\nv 1 1 0 0.5\nf 1 2 3\nf 2 4 3\n"
    found = colors(loaded(tmp_path / "a.obj", text))
    expected = {
        (0, 0, 0): (1, 0, 0, 1),
        (1, 0, 0): (linear_from_srgb(128 / 255), 0, 0, 1),
        (0, 1, 0): (1,) * 4,
        (1, 1, 0): (1,) * 4,
    }
    for place, color in expected.items():
        np.testing.assert_allclose(found[place], color, atol=1e-5)  # float32, rounded to five digits


def test_obj_material_groups_become_nodes(tmp_path):
    (tmp_path / "m.mtl").write_text("newmtl a\nKd 1 0 0\nnewmtl b\nKd .5\nd 0.25\n")
    text = f"mtllib m.mtl\n{CORNERS}o one\nf 1 2 3\nusemtl a\nf 1 3 4\nusemtl b\nf 1 2 4\nusemtl a\nf 2 3 4\nusemtl c\n"
    scene = loaded(tmp_path / "a.obj", text)
    assert [(node.name, len(node.mesh.triangles)) for node in scene.nodes] == [("one", 1), ("a", 2), ("b", 1)]
    assert [node.mesh.material.color for node in scene.nodes] == [(1, 1, 1, 1), (1, 0, 0, 1), (0.5, 0.5, 0.5, 0.25)]
    assert scene.nodes[2].mesh.material.alpha_mode is AlphaMode.BLEND


@pytest.mark.parametrize(
    ("text", "pattern"),
    [
        (CORNERS + "f 1 2 9\n", "vertex 8, but there are 4, counted from 0"),
        (CORNERS + "f 1 0 2\n", "nothing to render: the face 'f 1 0 2' uses index 0"),
        (PLATE + "f 1 2 x\n", "'x' is not an integer"),
        (PLATE + "f 1 2 99999999999999999999\n", "'99999999999999999999' is not an integer"),
        (PLATE + "f 1 2 /3\n", "a corner without a vertex"),
        (PLATE + "v 0 0 zero\n", "'v': 'zero' is not a number"),
        ("v 0 0\n" + PLATE, "1 of 5 vertices have coordinates that are not finite"),
    ],
)
def test_broken_obj(tmp_path, text, pattern):
    with pytest.raises(SceneError, match=pattern):
        loaded(tmp_path / "a.obj", text)


@pytest.mark.parametrize(
    ("face", "pattern"),
    [
        ("f 1 0 2", "'f 1 0 2' uses index 0"),
        ("f 1 2 -5", "'f 1 2 -5' counts back beyond the first of 4"),
        ("f 1 2 9", "vertex 8, but there are 4"),
    ],
)
def test_face_without_a_vertex_is_left_out(tmp_path, face, pattern):
    with pytest.warns(GlshadowWarning) as caught:
        scene = loaded(tmp_path / "a.obj", f"{CORNERS}f 1 2 3\n{face}\n{face}\nf 1 3 4\n")
    said = [str(each.message) for each in caught]
    assert any(pattern in each for each in said)
    assert any("2 of 4 faces left out" in each for each in said)
    assert len(said) == len(set(said)) <= 2
    assert scene.nodes[0].mesh.triangles.tolist() == [[0, 1, 2], [0, 2, 3]]


def test_coordinate_that_counts_back_beyond_the_first_is_missing(tmp_path):
    with pytest.warns(GlshadowWarning) as caught:
        mesh = loaded(tmp_path / "a.obj", CORNERS + "vn 0 1 0\nf 1//-9 2//-1 3//-1\n").nodes[0].mesh
    assert "counts back beyond the first of 2 elements" in str(caught[0].message)
    assert "1 corner(s) refer to normals that do not exist" in str(caught[1].message)
    assert mesh.normals.tolist() == [[0, 0, 1], [0, 1, 0], [0, 1, 0]]


def test_references_to_missing_attributes_are_noted(tmp_path):
    with pytest.warns(GlshadowWarning, match=r"1 corner\(s\) refer to normals that do not exist"):
        mesh = load_text(tmp_path, CORNERS + "f 1//1 2//1 3//7\n").nodes[0].mesh
    assert mesh.normals.tolist() == [[0, 0, 1]] * 3  # the face's normal, if there is none


def load_text(folder, text):
    (folder / "a.obj").write_text(text)
    return load(folder / "a.obj")


# --- MTL ---


@pytest.fixture
def pictures(tmp_path):
    """tex/red one.png of 2 x 2, and plain.png of 3 x 3."""
    (tmp_path / "tex").mkdir()
    Image.new("RGB", (2, 2), (255, 0, 0)).save(tmp_path / "tex" / "red one.png")
    Image.new("RGB", (3, 3), (0, 0, 255)).save(tmp_path / "plain.png")
    return tmp_path


def textured(folder, line):
    """The mesh of a plate whose material has that line."""
    (folder / "m.mtl").write_text(f"newmtl my mat\nKd 1 1 1\n{line}\n")
    faces = "f 1/1 2/2 3/3\nf 1/1 3/3 4/4\n"
    (mesh,) = (node.mesh for node in load_text(folder, f"mtllib m.mtl\n{CORNERS}usemtl my mat\n{faces}").nodes)
    return mesh


@pytest.mark.parametrize(
    ("line", "size"),
    [
        ("map_Kd tex/red one.png", 2),
        ("map_Kd  tex\\red one.png  ", 2),
        ('map_Kd "tex/red one.png"', 2),
        ("\tmap_kd\ttex/red one.png", 2),
        ("map_Kd -bm 1 -o 0 0 0 tex/red one.png", 2),
        ("map_Kd -s 1 1 1 -blendu on -boost 2 -clamp off -imfchan m -mm 0 1 -t 0.000 0.000 tex/red one.png", 2),
        ("map_Kd -s 1 -o 0 0 tex/red one.png", 2),
        ("map_Kd plain.png", 3),
        ("map_Kd C:\\Users\\somebody\\plain.png", 3),
        ("map_Kd /home/somebody/plain.png", 3),
        ("map_Kd some words plain.png", 3),
    ],
)
def test_map_options(pictures, line, size):
    mesh = textured(pictures, line)
    assert mesh.material.texture.shape == (size, size, 4)
    assert mesh.uv[mesh.triangles[0]].tolist() == [[0, 0], [1, 0], [1, 1]]


@pytest.mark.parametrize(("written", "there"), [("PLAIN.PNG", "plain.png"), ("Tex\\Red One.PNG", "tex/red one.png")])
def test_file_name_of_other_case_is_found(pictures, written, there):
    with pytest.warns(GlshadowWarning, match=f"exists as '{there}': used"):
        assert textured(pictures, f"map_Kd {written}").material.texture is not None


def test_map_scale_and_offset(pictures):
    mesh = textured(pictures, "map_Kd -s 2 3 1 -o 0.5 -0.25 plain.png")
    assert mesh.uv[mesh.triangles[0]].tolist() == [[0.5, -0.25], [2.5, -0.25], [2.5, 2.75]]


@pytest.mark.parametrize(
    ("line", "pattern"),
    [
        ("map_Kd -t 0.5 0 0 plain.png", "-t of its maps"),
        ("map_Kd plain.png\nmap_d -s 2 2 plain.png", "its map_d is placed as its map_Kd is"),
        ("d 0", "has an opacity of 0: drawn opaque"),
        ("disp plain.png\nmap_Pr plain.png", "disp, map_Pr of its materials: not drawn"),
        ("Kd 1 red 1", "is not three numbers"),
        ("Kd 2 1 1", "is clipped to 0..1"),
        ("map_Kd gone.png", "'gone.png' that it names is missing"),
        ("map_Kd -unknown plain.png", "is missing"),
        ("map_Kd m.mtl", "'m.mtl' cannot be decoded"),
        ("map_Kd ../plain.png", "outside the model's folder"),
    ],
)
def test_unsupported_statements_warn(pictures, line, pattern):
    if line == "map_Kd -unknown plain.png":
        line = "map_Kd -unknown word"
    with pytest.warns(GlshadowWarning, match=pattern):
        textured(pictures, line)


def test_several_libraries(pictures):
    (pictures / "a.mtl").write_text("newmtl a\nKd 1 0 0\n")
    (pictures / "b c.mtl").write_bytes("newmtl gr\xfcn\nKd 0 1 0\n".encode("latin-1"))
    text = f"mtllib a.mtl missing.mtl\nmtllib b c.mtl\n{CORNERS}usemtl a\nf 1 2 3\nusemtl grün\nf 1 3 4\n"
    with pytest.warns(GlshadowWarning, match=r"'missing\.mtl' that it names is missing"):
        scene = load_text(pictures, text)
    assert [node.mesh.material.color[:3] for node in scene.nodes] == [(1, 0, 0), (0, 1, 0)]


def test_many_missing_files_are_counted(pictures):
    (pictures / "m.mtl").write_text("".join(f"newmtl m{k}\nmap_Kd gone{k}.png\n" for k in range(200)))
    faces = "".join(f"usemtl m{k}\nf 1 2 3\n" for k in range(200))
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        load_text(pictures, f"mtllib m.mtl\n{CORNERS}{faces}")
    assert 1 < len(caught) < 60


@pytest.mark.parametrize(
    ("statement", "files"),
    [
        ("mtllib one\\ file.mtl", ["one file.mtl"]),
        ("mtllib missing.mtl one\\ file.mtl", ["one file.mtl"]),
        ("mtllib one file.mtl two files.mtl", ["one file.mtl", "two files.mtl"]),
    ],
)
def test_names_of_libraries_with_spaces(tmp_path, statement, files):
    for number, name in enumerate(files):
        (tmp_path / name).write_text(f"newmtl m{number}\nKd 0 {number} 1\n")
    text = f"{statement}\n{CORNERS}usemtl m0\nf 1 2 3\nusemtl m{len(files) - 1}\nf 1 3 4\n"
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message=".*missing.mtl")
        scene = loaded(tmp_path / "a.obj", text)
    assert [node.mesh.material.color for node in scene.nodes] == [(0, k, 1, 1) for k in range(len(files))]


def test_materials_that_no_library_defines_are_noted(tmp_path):
    (tmp_path / "m.mtl").write_text("newmtl a\nKd 1 0 0\n")
    text = f"mtllib m.mtl\n{CORNERS}usemtl A\nf 1 2 3\nusemtl b\nf 1 3 4\n"
    with pytest.warns(GlshadowWarning, match=r"2 material\(s\) that no library defines \('A', 'b'\): drawn white"):
        loaded(tmp_path / "a.obj", text)


def test_curves_are_noted(tmp_path):
    text = PLATE + "cstype bezier\ndeg 3\ncurv 0 1 1 2 3 4\nparm u 0 1\nend\ncurv 0 1 1 2 3 4\n"
    with pytest.warns(GlshadowWarning, match="its curves and surfaces .* are not drawn") as caught:
        assert len(loaded(tmp_path / "a.obj", text).nodes[0].mesh.triangles) == 2
    assert len(caught) == 1


def test_whole_numbers_far_from_the_origin_are_not_lost(tmp_path):
    """Millimetres of a national grid are exact in float32 as in text: a warning of lost precision would be wrong."""
    far = "".join(f"v {4_600_000 + 100 * x:d} {500_000 + 100 * y:d} 0\n" for x, y in ((0, 0), (1, 0), (0, 1)))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        loaded(tmp_path / "a.obj", far + "f 1 2 3\n")
    with pytest.warns(GlshadowWarning, match="already lost in the file"):
        loaded(tmp_path / "b.obj", far.replace("4600100", "4600100.5") + "f 1 2 3\n")
