"""Files broken in part or written in another dialect, each with its right scene: the shared cases, and more of their kinds."""

import re
import struct
import warnings
from pathlib import Path

import numpy as np
import pytest

import glshadow as gs
from glshadow.core.srgb import linear_from_srgb
from glshadow.errors import GlshadowWarning, SceneError
from glshadow.io.load import load
from glshadow.scene.mesh import AlphaMode

from .glb import Glb
from .test_dialects import BYTES, FACETS, PLACE, SQUARE, area, loaded, ply

QUAD = [[0, 1, 2], [0, 2, 3]]
LIST = "uchar int vertex_indices"


@pytest.fixture(scope="session")
def meant(models: Path) -> Path:
    """Folder of the cases."""
    return models.parent / "cases" / "meant"


def triangles(scene):
    return [(node.name, len(node.mesh.triangles)) for node in scene.nodes]


# file: names and triangles of its nodes, its note, area and area towards +z
CASES = {
    "bom.obj": ([("mesh", 1)], None, (2.0, 2.0)),
    "utf16.obj": ([("mesh", 1)], None, (0.5, 0.5)),
    "objects.obj": ([("part0", 2), ("part1", 2), ("part2", 2)], None, (6.0, 6.0)),
    "color_magics.stl": ([("mesh", 2)], None, (4.0, 4.0)),
    "header_note.ply": ([("mesh", 1)], "'Made by a tool that forgot the word comment' of its header is not", (0.5, 0.5)),
    "row_surplus.ply": ([("mesh", 2)], "2 rows of 'face' are longer than its header says: 12 surplus words skipped", (1.0, 1.0)),
    "end_header_crlf.ply": ([("mesh", 1)], None, (0.5, 0.5)),
    "nan.ply": ([("mesh", 2)], "1 of 3 faces left out: 1 of 5 vertices have coordinates that are not finite", (4.0, 4.0)),
    "short.ply": ([("mesh", 2)], "3 rows of 'face', of which 1 are there", (4.0, 4.0)),
    "one_without_position.glb": ([("node0", 2)], r"meshes\[1\] primitive 0 has no POSITION.*left out", (4.0, 4.0)),
    "one_bad_mesh.glb": ([("node0", 2)], r"meshes\[1\] primitive 0: index 9 is out of range.*left out", (4.0, 4.0)),
    "seven_indices.glb": ([("node0", 2)], "7 indices are not a multiple of 3.*the last 1 left out", (4.0, 4.0)),
    "glb_trailing.glb": ([("node0", 2)], r"1 byte\(s\) behind the 628 that its header declares", (4.0, 0.0)),
}  # fmt: skip


@pytest.mark.parametrize("name", CASES)
def test_case(meant, name):
    nodes, note, areas = CASES[name]
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        scene = load(meant / name)
    said = [str(each.message) for each in caught]
    assert bool(said) == (note is not None), said
    assert note is None or any(re.search(note, each) for each in said), said
    assert triangles(scene) == nodes
    assert area(scene) == areas


# --- byte order marks ---

FORMS = {
    "obj": "".join(f"v {x:g} {y:g} {z:g}\n" for x, y, z in SQUARE) + "f 1 2 3 4\n",
    "off": "OFF\n4 1 0\n" + "".join(f"{x:g} {y:g} {z:g}\n" for x, y, z in SQUARE) + "4 0 1 2 3\n",
    "ply": ply("ascii", ("vertex", PLACE, SQUARE.tolist()), ("face", [LIST], [[[0, 1, 2, 3]]])).decode(),
    "stl": "solid a\n" + "".join("facet normal 0 0 1\nouter loop\n" + "".join(f"vertex {x:g} {y:g} {z:g}\n" for x, y, z in facet)
                                 + "endloop\nendfacet\n" for facet in FACETS) + "endsolid a\n",
}  # fmt: skip
MARKED = ["utf-8-sig", "utf-16", "utf-16-be", "utf-32", "utf-32-be"]


@pytest.mark.parametrize("encoding", MARKED)
@pytest.mark.parametrize("suffix", FORMS)
def test_text_with_a_byte_order_mark(tmp_path, suffix, encoding):
    text = FORMS[suffix] if encoding in ("utf-8-sig", "utf-16", "utf-32") else "\ufeff" + FORMS[suffix]
    assert area(loaded(tmp_path / f"a.{suffix}", text.encode(encoding))) == (6.0, 6.0)


@pytest.mark.parametrize("encoding", MARKED[:2])
def test_material_library_with_a_byte_order_mark(tmp_path, encoding):
    (tmp_path / "a.mtl").write_bytes("newmtl a\nKd 1 0 0\n".encode(encoding))
    scene = loaded(tmp_path / "a.obj", f"mtllib a.mtl\nusemtl a\n{FORMS['obj']}")
    assert scene.nodes[0].mesh.material.color == (1, 0, 0, 1)


def test_binary_stl_whose_header_begins_like_a_mark_is_not_text(tmp_path):
    facets = b"".join(struct.pack("<12fH", 0, 0, 1, *facet.ravel(), 0) for facet in FACETS)
    scene = loaded(tmp_path / "a.stl", b"\xff\xfe".ljust(80, b"\0") + struct.pack("<I", 2) + facets)
    assert area(scene) == (6.0, 6.0)


# --- PLY ---


def test_ply_without_surplus_keeps_rows_over_the_ends_of_lines(tmp_path):
    """What is not a row per line is read as a stream of numbers, as before."""
    text = FORMS["ply"].replace("4 0 1 2 3", "4 0 1\n2 3")
    assert area(loaded(tmp_path / "a.ply", text)) == (6.0, 6.0)


def test_ply_surplus_of_vertices_and_of_lists(tmp_path):
    text = FORMS["ply"].replace("\n2 3 0\n", "\n2 3 0 7 7 7\n").replace("4 0 1 2 3", "4 0 1 2 3 9")
    with pytest.warns(GlshadowWarning) as caught:
        scene = load_text(tmp_path / "a.ply", text)
    assert area(scene) == (6.0, 6.0)
    said = [str(each.message).partition(": ")[2] for each in caught]
    assert said == [f"1 rows of {name!r} are longer than its header says: {count} surplus words skipped"
                    for name, count in (("vertex", 3), ("face", 1))]  # fmt: skip


def test_colours_before_a_surplus_are_kept(tmp_path):
    """Unlike those of the case, which are lists against the header."""
    faces = ("face", [LIST, *BYTES], [[[0, 1, 2, 3], 255, 0, 0]])
    text = ply("ascii", ("vertex", PLACE, SQUARE.tolist()), faces).decode()
    scene = loaded(tmp_path / "a.ply", text.replace("255 0 0", "255 0 0 17 18"), "2 surplus words")
    assert scene.nodes[0].mesh.material.color == (1, 0, 0, 1)


@pytest.mark.parametrize("kind", ["ascii", "binary_little_endian", "binary_big_endian"])
@pytest.mark.parametrize("mixed", [False, True])
def test_ply_cut_at_every_byte(tmp_path, kind, mixed):
    """Every face that is whole is drawn, and nothing else; without one, the file is refused by name."""
    rows = [[[0, 1, 2]], [[0, 2, 3]], [[0, 1, 2, 3]] if mixed else [[1, 2, 3]]]
    data = ply(kind, ("vertex", PLACE, SQUARE.tolist()), ("face", [LIST], rows))
    faces = data.index(b"end_header\n") + 11 + (24 if kind == "ascii" else 48)  # behind four vertices
    counts, causes = set(), set()
    for end in range(faces, len(data) - (kind == "ascii")):  # the last line is whole without its end
        try:
            with warnings.catch_warnings(record=True) as caught:
                warnings.simplefilter("always")
                (node,) = load_text(tmp_path / "a.ply", data[:end]).nodes
            counts.add(len(node.mesh.triangles))
            causes |= {
                str(each.message).replace(f"of which {len(node.mesh.triangles)}", "of which 0") for each in caught
            }
        except SceneError as error:
            causes.add(str(error).replace("nothing to render: ", ""))
            counts.add(0)
    said = "its header declares more than the file can hold: 3 rows of 'face', of which 0 are there; it is cut off or broken"
    assert causes == {f"a.ply: {said}"}
    assert counts == {0, 1, 2}


def load_text(path, data):
    path.write_bytes(data if isinstance(data, bytes) else data.encode())
    return load(path)


# --- STL colours ---


def stl(*attributes, header=b""):
    facets = b"".join(
        struct.pack("<12fH", 0, 0, 1, *facet.ravel(), each) for facet, each in zip(FACETS, attributes, strict=True)
    )
    return header.ljust(80, b" ") + struct.pack("<I", len(attributes)) + facets


MAGICS = b"COLOR=" + bytes((0, 255, 0, 255))
HALF = float(linear_from_srgb(16 / 31))
RED, GREEN, BLUE, WHITE = (1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 1)


@pytest.mark.parametrize(
    ("data", "expected"),
    [
        (stl(0, 0), (WHITE, WHITE)),
        (stl(0x001F, 0x7C00), (WHITE, WHITE)),  # bit 15 is not set: no colours
        (stl(0x801F, 0xFC00), (BLUE, RED)),
        (stl(0x801F, 0x7C00), (BLUE, WHITE)),
        (stl(0x8000, 0x8000 | 16 << 5), ((0, 0, 0), (0, HALF, 0))),
        (stl(0x001F, 0x7C00, header=MAGICS), (RED, BLUE)),
        (stl(0x801F, 0x7C00, header=MAGICS), (GREEN, BLUE)),  # bit 15: the part's colour
        (stl(0x8000, 0xFFFF, header=MAGICS), (GREEN, GREEN)),
        (stl(0, 0, header=MAGICS), (GREEN, GREEN)),  # no facet has a colour
        (stl(0, 16 << 5, header=b"made by COLOR=\xff\0\0\xff"), ((0, 0, 0), (0, HALF, 0))),
    ],
)
def test_stl_colours(tmp_path, data, expected):
    """One facet's bits in both dialects; the linear colour of each."""
    (node,) = loaded(tmp_path / "a.stl", data).nodes
    mesh = node.mesh
    tints = np.ones((len(mesh.positions), 4)) if mesh.colors is None else mesh.colors
    # 1e-6: float32
    for facet, color in zip(mesh.triangles, expected, strict=True):
        for corner in facet:
            np.testing.assert_allclose(tints[corner] * mesh.material.color, (*color, 1), atol=1e-6)


def test_stl_opacity_of_the_part(tmp_path):
    (node,) = load_text(tmp_path / "a.stl", stl(0, 0, header=b"COLOR=\xff\xff\xff\x33")).nodes
    assert node.mesh.material.alpha_mode is AlphaMode.BLEND
    assert node.mesh.material.color[3] == pytest.approx(0.2)


# --- broken parts of glTF ---


def two(tmp_path, broken, places=SQUARE, **more):
    """A file of a square and of a primitive of the same vertices that is broken in some way."""
    glb = Glb(nodes=[{"mesh": 0, "name": "good"}, {"mesh": 1, "name": "bad"}])
    good = {"attributes": {"POSITION": glb.add(SQUARE)}, "indices": glb.add(np.ravel(QUAD), "uint16")}
    glb.mesh(good)
    glb.mesh(broken(glb, glb.add(places)))
    glb.json |= more
    return glb.save(tmp_path / "two.glb")


LOST = np.vstack([SQUARE[:3], [np.nan, 0, 0]])
PARTS = {
    "no POSITION": (lambda glb, place: {"attributes": {}}, SQUARE, 0, "has no POSITION"),
    "POSITION that is not there": (lambda glb, place: {"attributes": {"POSITION": 99}}, SQUARE, 0, r"accessors\[99\]"),
    "one index out of range": (lambda glb, place: {"attributes": {"POSITION": place}, "indices": glb.add([0, 1, 2, 0, 2, 4], "uint8")},
                               SQUARE, 1, "index 4 is out of range.*1 of 2 triangles left out"),
    "all indices out of range": (lambda glb, place: {"attributes": {"POSITION": place}, "indices": glb.add([7, 8, 9], "uint32")},
                                 SQUARE, 0, "index 9 is out of range"),
    "one NaN": (lambda glb, place: {"attributes": {"POSITION": place}, "indices": glb.add(np.ravel(QUAD), "uint16")},
                LOST, 1, "1 of 4 vertices have coordinates that are not finite.*1 of 2 triangles left out"),
    "a fan with a NaN": (lambda glb, place: {"attributes": {"POSITION": place}, "mode": 6}, LOST, 1, "1 of 2 triangles left out"),
    "four vertices without indices": (lambda glb, place: {"attributes": {"POSITION": place}}, SQUARE, 1, "the last 1 left out"),
    "two indices": (lambda glb, place: {"attributes": {"POSITION": place}, "indices": glb.add([0, 1], "uint8")},
                    SQUARE, 0, "2 indices are too few for a triangle"),
    "a strip of two": (lambda glb, place: {"attributes": {"POSITION": place}, "indices": glb.add([0, 1], "uint8"), "mode": 5},
                       SQUARE, 0, "2 indices are too few"),
    "normals of another count": (lambda glb, place: {"attributes": {"POSITION": place, "NORMAL": glb.add([[0, 0, 1]] * 3)}, "mode": 6},
                                 SQUARE, 0, "NORMAL has 3 elements, POSITION has 4"),
    "a list": (lambda glb, place: [], SQUARE, 0, "must be an object"),
    "an accessor of a type that is a list": (lambda glb, place: {"attributes": {"POSITION": glb.declare(3, kind=["VEC3"])}}, SQUARE, 0,
                                             "must be VEC3 of a known component type"),
    "a target that is a number": (lambda glb, place: {"attributes": {"POSITION": place}, "targets": [3]}, SQUARE, 0, "left out"),
}  # fmt: skip


@pytest.mark.parametrize("kind", PARTS)
def test_broken_primitive_is_left_out(tmp_path, kind):
    broken, places, left, note = PARTS[kind]
    with pytest.warns(GlshadowWarning, match=note):
        scene = load(two(tmp_path, broken, places))
    assert triangles(scene) == [("good", 2)] + [("bad", left)] * (left > 0)


def test_error_if_nothing_is_left(tmp_path):
    glb = Glb(nodes=[{"mesh": 0}])
    glb.mesh({"attributes": {}}, {"attributes": {"POSITION": 5}})
    with pytest.raises(SceneError, match=r"nothing to render: .*primitive 0 has no POSITION.*; .*accessors\[5\]"):
        load(glb.save(tmp_path / "a.glb"))


@pytest.mark.parametrize(("node", "note"), [({"mesh": 7}, r"meshes\[7\]"), ({"mesh": 0, "skin": 3}, r"skins\[3\]")])
def test_broken_node_is_left_out(tmp_path, node, note):
    glb = Glb(nodes=[{"mesh": 0, "name": "good"}, {**node, "name": "bad"}])
    glb.mesh({"attributes": {"POSITION": glb.add(SQUARE[:3])}})
    with pytest.warns(GlshadowWarning, match=f"node 'bad'.*{note}.*left out"):
        assert triangles(load(glb.save(tmp_path / "a.glb"))) == [("good", 1)]


def test_limits_are_not_broken_parts(tmp_path):
    """They stop loading, whatever else there is."""
    path = two(tmp_path, lambda glb, place: {"attributes": {"POSITION": glb.declare(10**10)}})
    with pytest.raises(SceneError, match=r"raise it with glshadow\.load"):
        load(path)


def test_many_broken_primitives_are_counted(tmp_path):
    glb = Glb(nodes=[{"mesh": 0}])
    good = {"attributes": {"POSITION": glb.add(SQUARE[:3])}}
    glb.mesh(good, *({"attributes": {}, "extras": k} for k in range(500)))
    with pytest.warns(GlshadowWarning) as caught:
        load(glb.save(tmp_path / "a.glb"))
    assert 20 < len(caught) < 60
    assert "450 more of such notes" in str(caught[-1].message)


@pytest.mark.parametrize("behind", [1, 4, 100_000])
def test_bytes_behind_a_glb(tmp_path, behind):
    path = two(tmp_path, lambda glb, place: {"attributes": {"POSITION": place}, "mode": 6})
    path.write_bytes(path.read_bytes() + b"\xff" * behind)
    with pytest.warns(GlshadowWarning, match=rf"{behind} byte\(s\) behind"):
        assert len(load(path).nodes) == 2


def test_picture_of_a_broken_file_is_that_of_the_rest(meant):
    """The picture of a file with a broken part is that of the rest, to the bit."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", GlshadowWarning)
        scenes = [
            load(meant / name)
            for name in ("one_bad_mesh.glb", "one_without_position.glb", "seven_indices.glb", "short.ply")
        ]
    with gs.Renderer() as renderer:
        first, *others = (renderer.render(scene, size=(48, 32), samples=1).image for scene in scenes)
    assert len(np.unique(first.reshape(-1, first.shape[-1]), axis=0)) > 1
    for other in others:
        np.testing.assert_array_equal(other, first)
