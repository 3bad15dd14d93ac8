"""STL, OFF and PLY files as exporters write them, deviating from the specification, each with the correct result."""

import struct
import subprocess
import sys
import warnings
from pathlib import Path

import numpy as np
import pytest

import glshadow as gs
from glshadow.core.srgb import linear_from_srgb
from glshadow.errors import GlshadowWarning, SceneError
from glshadow.io.load import load

SQUARE = np.array([[0, 0, 0], [2, 0, 0], [2, 3, 0], [0, 3, 0]], dtype=float)  # area 6, seen from +z
FACETS = SQUARE[[0, 1, 2, 0, 2, 3]].reshape(2, 3, 3)
# an arrowhead that points right: concave at (1, 1), area 4 - 2 = 2
ARROW = np.array([[0, 0, 0], [3, 1, 0], [0, 2, 0], [1, 1, 0]], dtype=float)


def area(scene):
    """Sum of the triangles' areas, and the sum of their area vectors' z: equal if all face +z and none overlap."""
    corners = np.concatenate([node.mesh.positions[node.mesh.triangles] for node in scene.nodes])
    vectors = 0.5 * np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return float(np.linalg.norm(vectors, axis=1).sum()), float(vectors[:, 2].sum())


def loaded(path, data, note=None):
    """The scene of a file with the content `data`; with `note`, the only warning must match it."""
    path.write_bytes(data if isinstance(data, bytes) else data.encode())
    if note is None:
        return load(path)
    with pytest.warns(GlshadowWarning, match=note) as caught:
        scene = load(path)
    assert len(caught) == 1, [str(each.message) for each in caught]
    return scene


def colors(scene):
    """Linear colour at each corner: material times vertices."""
    (node,) = scene.nodes
    base = np.asarray(node.mesh.material.color)
    tints = np.ones((len(node.mesh.positions), 4)) if node.mesh.colors is None else node.mesh.colors
    return {tuple(p): tuple(np.round(base * c, 5)) for p, c in zip(node.mesh.positions.tolist(), tints, strict=True)}


# --- STL ---


def binary_stl(header=b"", count=2, behind=b""):
    facets = b"".join(struct.pack("<12fH", 0, 0, 1, *facet.ravel(), 0) for facet in FACETS)
    return header.ljust(80, b" ") + struct.pack("<I", count) + facets + behind


def ascii_stl(text=str, end="\n"):
    lines = ["solid plate"]
    for facet in FACETS:
        corners = [f"   vertex {x:g} {y:g} {z:e}" for x, y, z in facet]
        lines += ["facet normal 0 0 1", "  outer loop", *corners, "  endloop", "endfacet"]
    return text(end.join([*lines, "endsolid plate", ""]))


@pytest.mark.parametrize(
    ("data", "note"),
    [
        (binary_stl(), None),
        (binary_stl(b"solid made by an exporter"), None),
        (binary_stl(behind=b"\0" * 20), r"20 byte\(s\) behind the last of 2 facets"),
        (binary_stl(b"solid with a tail", behind=b"tail\0"), r"5 byte\(s\) behind"),
        (binary_stl(count=0), "declares 0 facets, the file holds 2"),
        (binary_stl(count=2**32 - 1), "declares 4294967295 facets, the file holds 2"),
        (ascii_stl(), None),
        (ascii_stl(str.upper), None),
        (ascii_stl(end="\r"), None),
        (ascii_stl(end="\r\n"), None),
        (ascii_stl(end="  \n\t"), None),
        ("# made by hand\n" + ascii_stl(), None),
        (ascii_stl().replace("\n   vertex", " vertex"), None),
        (ascii_stl() + "facet normal 0 0 1\nouter loop\nvertex 0 0 0\n", "its last facet is cut off"),
    ],
)
def test_stl(tmp_path, data, note):
    scene = loaded(tmp_path / "plate.stl", data, note)
    assert scene.bounds.tolist() == [[0, 0, 0], [2, 3, 0]]
    assert area(scene) == (6.0, 6.0)


def test_truncated_stl(tmp_path):
    """Its whole facets are drawn; without any, or with far fewer than declared, it is refused."""
    scene = loaded(
        tmp_path / "plate.stl",
        binary_stl(count=3),
        "declares 3 facets, 234 bytes, but the file has 184: the 2 that are there",
    )
    assert area(scene) == (6.0, 6.0)
    for data in (binary_stl(count=3)[:130], binary_stl(count=201)):
        with pytest.raises(SceneError, match=f"but the file has {len(data)}; export or download it again"):
            loaded(tmp_path / "plate.stl", data)


def test_stl_loop_of_more_than_three_corners(tmp_path):
    corners = "".join(f"vertex {x:g} {y:g} {z:g}\n" for x, y, z in ARROW)
    scene = loaded(tmp_path / "a.stl", f"solid\nfacet normal 0 0 1\nouter loop\n{corners}endloop\nendfacet\nendsolid\n")
    assert area(scene) == pytest.approx((2.0, 2.0), rel=1e-15)


def test_stl_solids_keep_their_names(tmp_path):
    second = ascii_stl().replace("plate", "lid").replace("e+00", "e+01")
    scene = loaded(tmp_path / "two.stl", ascii_stl() + second)
    assert [node.name for node in scene.nodes] == ["plate", "lid"]


# --- OFF ---


@pytest.mark.parametrize(
    ("head", "end"),
    [("OFF\n4 1 4", "\n"), ("OFF 4 1 4", "\n"), ("OFF4 1 4", "\n"), ("OFF\n4 1", "\n"), ("OFF\n# c\n\n4 1 4 # counts", "\n"),
     ("4 1 4", "\n"), ("OFF\r4 1 4", "\r"), ("OFF\r\n4 1 4", "\r\n"), ("OFF 4 1 4", " ")],
)  # fmt: skip
def test_off(tmp_path, head, end):
    text = end.join([head, *(f"{x:g} {y:g} {z:g}" for x, y, z in ARROW), "4 0 1 2 3", ""])
    scene = loaded(tmp_path / "arrow.off", text)
    assert scene.bounds.tolist() == [[0, 0, 0], [3, 2, 0]]
    assert area(scene) == pytest.approx((2.0, 2.0), rel=1e-15)


@pytest.mark.parametrize("half", ["128 0 255 255", "0.5019607843137255 0 1 1"])
def test_off_colours(tmp_path, half):
    """128 of 255 in sRGB is .2159 linear (IEC 61966-2-1); the second vertex has no colour and is white."""
    text = f"COFF\n3 1 0\n0 0 0 {half}\n1 0 0\n0 1 0 {half}  # comment\n3 0 1 2\n"
    expected = (round(float(linear_from_srgb(128 / 255)), 5), 0.0, 1.0, 1.0)
    assert expected[0] == pytest.approx(0.2159, abs=1e-4)
    found = colors(loaded(tmp_path / "c.off", text))
    assert found == {(0, 0, 0): expected, (1, 0, 0): (1, 1, 1, 1), (0, 1, 0): expected}


def test_off_face_colours_and_normals(tmp_path):
    vertices = "".join(f"{x:g} {y:g} {z:g} 0 0 2\n" for x, y, z in SQUARE)
    scene = loaded(tmp_path / "c.off", f"NOFF\n4 2 0\n{vertices}3 0 1 2 255 0 0\n3 0 2 3 0 0 255\n")
    mesh = scene.nodes[0].mesh
    assert mesh.normals.tolist() == [[0, 0, 1]] * len(mesh.positions)
    # each triangle has its own colour at all three corners, in the file's order
    assert mesh.colors[mesh.triangles].tolist() == [[[1, 0, 0, 1]] * 3, [[0, 0, 1, 1]] * 3]
    assert len(mesh.positions) == 6


@pytest.mark.parametrize(
    ("text", "pattern"),
    [
        ("4OFF\n1 1 0\n", "only three dimensions"),
        ("OFF BINARY\n1 1 0\n", "only three dimensions, as text"),
        ("COFF\nvertices\n", "must begin with 'OFF'"),
        ("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 7\n", "vertex 7, but there are 3"),
        ("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 1.5\n", "not an integer"),
        ("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 x\n3 0 1 2\n", "'x' is not a number"),
        ("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n5 0 1 2\n", "as many corners as it declares"),
        ("OFF\n3 2 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n", "ends within them"),
    ],
)
def test_broken_off(tmp_path, text, pattern):
    with pytest.raises(SceneError, match=pattern):
        loaded(tmp_path / "a.off", text)


# --- PLY ---

PLY = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
SIZES = {"float": "f", "uchar": "B", "int": "i", "ushort": "H", "short": "h", "double": "d"}


def ply(kind, *elements, comment="", end="\n"):
    """A PLY file; an element is its name, its properties (a list: `uchar int name`) and its rows."""
    lines, body = ["ply", f"format {kind} 1.0", *([f"comment {comment}"] if comment else [])], b""
    for name, properties, table in elements:
        lines += [f"element {name} {len(table)}"]
        lines += [f"property {'list ' if p.count(' ') == 2 else ''}{p}" for p in properties]
        for row in table:
            words = []
            for declared, value in zip(properties, row, strict=True):
                form = [SIZES[word] for word in declared.split()[:-1]]
                words += (
                    [(form[0], value)] if len(form) == 1 else [(form[0], len(value)), *((form[1], v) for v in value)]
                )
            if kind == "ascii":
                body += " ".join(f"{value:g}" for _, value in words).encode() + end.encode()
            else:
                body += b"".join(struct.pack(PLY[kind] + form, value) for form, value in words)
    return end.join([*lines, "end_header", ""]).encode() + body


PLACE = ["float x", "float y", "float z"]
VERTICES = ("vertex", PLACE, SQUARE.tolist())
BYTES = ["uchar red", "uchar green", "uchar blue"]


@pytest.mark.parametrize("end", ["\n", "\r", "\r\n"])
@pytest.mark.parametrize("kind", PLY)
def test_ply_strips(tmp_path, kind, end):
    """Two strips in one row, and one in another; every second triangle of a strip has reversed winding."""
    grid = ("vertex", PLACE, [[x, y, 0.0] for x in range(4) for y in range(2)])
    strips = ("tristrips", ["int int vertex_indices"], [[[1, 0, 3, 2, -1, 3, 2, 5, 4]], [[5, 4, 7, 6]]])
    scene = loaded(tmp_path / "s.ply", ply(kind, grid, strips, end=end))
    assert len(scene.nodes[0].mesh.triangles) == 6
    assert area(scene) == (3.0, 3.0)


@pytest.mark.parametrize("kind", PLY)
def test_ply_mixed_and_concave_faces(tmp_path, kind):
    vertices = ("vertex", PLACE, [*ARROW.tolist(), *np.add(SQUARE, [0, 5, 0]).tolist(), [1, 4, 0]])
    faces = ("face", ["uchar flags", "uchar int vertex_index", "float weight"],
             [[7, [0, 1, 2, 3], 0.5], [7, [], 0.5], [7, [4, 8, 5], 0.5], [7, [4, 5, 6, 7], 1]])  # fmt: skip
    scene = loaded(tmp_path / "m.ply", ply(kind, vertices, faces), r"1 face\(s\) with fewer than 3 corners")
    assert area(scene) == pytest.approx((2 + 1 + 6, 2 + 1 + 6), rel=1e-15)
    assert len(scene.nodes[0].mesh.triangles) == 5


@pytest.mark.parametrize(
    ("form", "full"), [("uchar", 255), ("ushort", 65535), ("float", 1.0), ("double", 255.0), ("int", 255)]
)
@pytest.mark.parametrize("kind", PLY)
def test_ply_vertex_colours(tmp_path, kind, form, full):
    part = 128 * full / 255 if form in ("float", "double") else 128 * full // 255
    table = [[*place, full, part, 0] for place in SQUARE.tolist()]
    table[3][3:] = [0, 0, 0]
    vertices = ("vertex", [*PLACE, *(f"{form} {name}" for name in ("red", "green", "blue"))], table)
    found = colors(
        loaded(tmp_path / "c.ply", ply(kind, vertices, ("face", ["uchar int vertex_indices"], [[[0, 1, 2, 3]]])))
    )
    assert found[0, 3, 0] == (0, 0, 0, 1)
    # 1e-4: five digits were rounded, and .5 is between two bytes
    np.testing.assert_allclose(found[2, 3, 0], (1, linear_from_srgb(128 / 255), 0, 1), atol=1e-4)


def test_ply_colours_multiply_and_alpha_is_linear(tmp_path):
    vertices = ("vertex", [*PLACE, *BYTES, "uchar alpha"], [[*p, 255, 255, 0, 51] for p in SQUARE.tolist()])
    faces = ("face", ["uchar int vertex_indices", *BYTES], [[[0, 1, 2], 255, 0, 0], [[0, 2, 3], 0, 255, 255]])
    mesh = loaded(tmp_path / "c.ply", ply("ascii", vertices, faces)).nodes[0].mesh
    # 1e-6: float32
    np.testing.assert_allclose(mesh.colors[mesh.triangles[:, 0]], [[1, 0, 0, 0.2], [0, 1, 0, 0.2]], atol=1e-6)


def test_ply_of_uniform_colour_becomes_a_material(tmp_path):
    vertices = ("vertex", [*PLACE, *BYTES], [[*p, 188, 188, 188] for p in SQUARE.tolist()])
    mesh = (
        loaded(tmp_path / "c.ply", ply("ascii", vertices, ("face", ["uchar int vertex_indices"], [[[0, 1, 2]]])))
        .nodes[0]
        .mesh
    )
    assert mesh.colors is None
    assert mesh.material.color[0] == pytest.approx(0.503, abs=1e-3)  # sRGB 188 (IEC 61966-2-1)


def test_ply_texture(tmp_path):
    from PIL import Image

    Image.new("RGB", (2, 2), (255, 0, 0)).save(tmp_path / "red.png")
    Image.new("RGB", (3, 3), (0, 0, 255)).save(tmp_path / "blue one.png")
    corners = [[0, 0, 1, 0, 1, 1], [0, 0, 1, 1, 0, 0.5]]
    faces = ("face", ["uchar int vertex_indices", "uchar float texcoord"],
             [[[0, 1, 2], corners[0]], [[0, 2, 3], corners[1]]])  # fmt: skip
    mesh = (
        loaded(tmp_path / "a.ply", ply("binary_little_endian", VERTICES, faces, comment="TextureFile red.png"))
        .nodes[0]
        .mesh
    )
    assert mesh.uv[mesh.triangles].reshape(2, 6).tolist() == corners
    assert mesh.material.texture.shape == (2, 2, 4)
    numbered = ("face", [*faces[1], "int texnumber"], [[*row, k] for k, row in enumerate(faces[2])])
    two = "TextureFile red.png\ncomment TextureFile blue one.png"
    scene = loaded(tmp_path / "b.ply", ply("ascii", VERTICES, numbered, comment=two))
    assert [node.mesh.material.texture.shape[0] for node in scene.nodes] == [2, 3]


@pytest.mark.parametrize(
    ("data", "pattern"),
    [
        (b"ply\nformat ascii 1.0\nelement vertex\nend_header\n", "'element vertex' of its header"),
        (b"ply\nelement vertex 3\nproperty float x\nend_header\n", "'property float x' of its header"),
        (b"ply\nformat binary 1.0\nend_header\n", "must name one of the formats"),
        (b"ply\nformat ascii 1.0\n", "end_header"),
        (ply("ascii", VERTICES, ("face", ["uchar int vertex_indices"], [[[0, 1, -5]]])), "vertex -5"),
        (ply("ascii", VERTICES, ("face", ["uchar float vertex_indices"], [[[0, 1, 0.5]]])), "not an integer"),
        (ply("ascii", VERTICES).replace(b"0 3 0", b"0 3 ?"), "'?' is not a number"),
        (ply("binary_big_endian", ("face", ["int int vertex_indices"], [[[1] * 9]]))[:-4], "more than the file can hold"),
        (ply("binary_little_endian", ("face", ["int int vertex_indices"], [[[]]]))[:-4] + b"\xff" * 4, "list of -1 numbers"),
    ],
)  # fmt: skip
def test_broken_ply(tmp_path, data, pattern):
    with pytest.raises(SceneError, match=pattern.replace("?", r"\?")):
        loaded(tmp_path / "a.ply", data)


# --- all of them ---


def test_colours_reach_the_image(tmp_path):
    """Half of a plate is red, half is blue: its pixels are, and no others are coloured."""
    table = [[*p, 255 * (p[0] < 1), 0, 255 * (p[0] >= 1)] for p in ([0, 0, 0], [0.999, 0, 0], [0.999, 3, 0], [0, 3, 0])]
    table += [[x + 1, y, z, 0, 0, 255] for x, y, z, *_ in table]
    faces = ("face", ["uchar int vertex_indices"], [[[0, 1, 2, 3]], [[4, 5, 6, 7]]])
    scene = loaded(tmp_path / "c.ply", ply("ascii", ("vertex", [*PLACE, *BYTES], table), faces))
    with gs.Renderer() as renderer:
        linear = renderer.render(scene, gs.PerspectiveCamera((1, 1.5, 4), (1, 1.5, 0)), (), (64, 64), ambient=1.0,
                                 background=(0, 0, 0), outputs=("linear",), samples=1).linear  # fmt: skip
    colored = {tuple(np.round(color / max(color.max(), 1e-9), 3)) for color in linear.reshape(-1, 3)}
    assert colored == {(0, 0, 0), (1, 0, 0), (0, 0, 1)}
    assert (linear[:, :32, 2] == 0).all()
    assert (linear[:, 32:, 0] == 0).all()


def test_mesh_files_need_neither_trimesh_nor_the_filters_of_warnings(tmp_path):
    """Importing trimesh takes a second; warning filters belong to the whole process, and changing them is not thread-safe."""
    (tmp_path / "a.off").write_text("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n")
    code = f"import sys; from glshadow.io.load import load; load({str(tmp_path / 'a.off')!r}); sys.exit('trimesh' in sys.modules)"
    subprocess.run([sys.executable, "-c", code], check=True, timeout=60)
    folder = Path(sys.modules["glshadow.io.load"].__file__).parent / "mesh_files"
    assert [path.name for path in folder.glob("*.py") if "catch_warnings" in path.read_text()] == []
    before = list(warnings.filters)
    load(tmp_path / "a.off")
    assert warnings.filters == before


def test_off_whose_counts_are_not_integers_is_named(tmp_path):
    (tmp_path / "a.off").write_text("OFF\n3 0.5\n0\n220\n4\n")
    with pytest.raises(SceneError, match="not an OFF file"):
        load(tmp_path / "a.off")
