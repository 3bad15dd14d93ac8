"""A small mesh file costs neither minutes nor gigabytes: load and one frame in a process of their own take a few times as long as
those of a plain file of the largest size, and 1 GB; or raise a named error."""

import json
import re
import subprocess
import sys

import numpy as np
import pytest
from PIL import Image

from glshadow.errors import GlshadowWarning, SceneError
from glshadow.io.limits import Budget, Limits
from glshadow.io.load import load
from glshadow.io.mesh_files.read import read_mesh_file

from ..pairwise import mostly

# of load and one frame of 96 x 64, with the interpreter and its imports; measured: 2.2 times the plain file's, .29 GB at most
TIMES, MEMORY = 5.0, 1 << 30
LARGEST = 9_000_000  # bytes of a file

LOAD = 'gs.load(sys.argv[1], look="plain")'
CHILD = """
import json, re, resource, sys, warnings
import glshadow as gs
warnings.simplefilter("ignore", gs.GlshadowWarning)
said = {}
try:
    scene = gs.load(sys.argv[1], look="plain")
    with gs.Renderer() as renderer:
        renderer.render(scene, size=(96, 64))
    said = {"nodes": len(scene.nodes), "triangles": sum(len(node.mesh.triangles) for node in scene.nodes)}
except gs.SceneError as error:
    said = {"error": str(error)}
used = resource.getrusage(resource.RUSAGE_SELF)
peak = re.search(r"VmHWM:\\s+(\\d+)", open("/proc/self/status").read())[1]  # ru_maxrss remembers the process it was forked from
print(json.dumps(said | {"cpu": used.ru_utime + used.ru_stime, "memory": int(peak) * 1024}))
"""

GRID = 160  # vertices on a side


def grid():
    """Lines `v` of a wavy field."""
    x, z = np.meshgrid(np.arange(GRID), np.arange(GRID))
    return "".join(f"v {a} {np.sin(a / 9.0 + b / 7.0):.4f} {b}\n" for a, b in zip(x.ravel(), z.ravel(), strict=True))


def cells(count):
    """1-based indices of the four corners of `count` cells of the field, some more than once."""
    cell = np.arange(count) % ((GRID - 1) ** 2)
    corner = cell // (GRID - 1) * GRID + cell % (GRID - 1) + 1
    return np.stack([corner, corner + GRID, corner + GRID + 1, corner + 1], axis=1).tolist()


def mixed_faces(folder):
    forms = ("{0}", "{0}/{0}", "{0}//1", "{0}/{0}/1")
    vt = "".join(f"vt {k / 99:.3f} .5\n" for k in range(GRID**2))
    faces = [" ".join(forms[k % 4].format(v) for v in cell[: 4 - k % 2]) for k, cell in enumerate(cells(20_000))]
    (folder / "a.obj").write_text(f"{grid()}{vt}vn 0 1 0\n" + "".join(f"f {face}\n" for face in faces))
    return "a.obj"


def statements(word, defined, names=50_000):
    """50,000 faces, each preceded by a statement; its names repeat after `names`."""

    def write(folder):
        (folder / "a.mtl").write_text(
            "".join(f"newmtl m{k}\nKd {k % 97 / 96:.3f} {k % 89 / 88:.3f} .5\n" for k in range(defined))
        )
        faces = "".join(f"{word} m{k % names}\nf {a} {b} {c}\n" for k, (a, b, c, _) in enumerate(cells(50_000)))
        (folder / "a.obj").write_text(f"mtllib a.mtl\n{grid()}{faces}")
        return "a.obj"

    return write


def polygon(radii):
    def write(folder):
        angle = np.linspace(0, 2 * np.pi, len(radii), endpoint=False)
        places = np.stack([radii * np.cos(angle), radii * np.sin(angle)], axis=1)
        vertices = "".join(f"v {x:.5f} 0 {y:.5f}\n" for x, y in places)
        (folder / "a.obj").write_text(f"{vertices}f {' '.join(map(str, range(1, len(radii) + 1)))}\n")
        return "a.obj"

    return write


def many_polygons(folder):
    """Concave polygons of 12 corners."""
    angle = np.arange(12) * np.pi / 6
    star = (
        np.stack([np.cos(angle), np.zeros(12), np.sin(angle)], axis=1) * np.where(np.arange(12) % 2, 1.0, 0.4)[:, None]
    )
    places = [np.add(star, (2.5 * (k % 90), 0, 2.5 * (k // 90))) for k in range(8_000)]
    lines = "".join(f"{x:.3f} {y:g} {z:.3f}\n" for x, y, z in np.concatenate(places))
    faces = "".join(f"12 {' '.join(map(str, range(12 * k, 12 * k + 12)))}\n" for k in range(8_000))
    (folder / "a.off").write_text(f"OFF\n96000 8000 0\n{lines}{faces}")
    return "a.off"


def sizes(folder):
    """One concave polygon of each number of corners up to 500."""
    lines, faces, at = [], [], 1
    for count in range(9, 500):
        angle = np.linspace(0, 2 * np.pi, count, endpoint=False)
        radius = np.where(np.arange(count) % 2, 1.0, 0.4)
        x, y = radius * np.cos(angle) + 2.5 * (count % 25), radius * np.sin(angle) + 2.5 * (count // 25)
        lines += [f"v {a:.4f} 0 {b:.4f}\n" for a, b in zip(x, y, strict=True)]
        faces.append(f"f {' '.join(map(str, range(at, at + count)))}\n")
        at += count
    (folder / "a.obj").write_text("".join(lines + faces))
    return "a.obj"


def repeated(line):
    def write(folder):
        (folder / "a.obj").write_text(grid() + line)
        return "a.obj"

    return write


def facets(count, solids=False):
    def write(folder):
        side = int(np.ceil(np.sqrt(count)))
        k = np.arange(count)
        x, z = k % side, k // side
        text = ["solid all\n"]
        for a, b in zip(x.tolist(), z.tolist(), strict=True):
            head = f"solid s{a}_{b}\n" if solids else ""
            corners = "".join(
                f"      vertex {p:.6e} {np.sin(p / 9.0):.6e} {q:.6e}\n" for p, q in ((a, b), (a, b + 1), (a + 1, b))
            )
            text.append(
                f"{head}  facet normal 0.000000e+00 1.000000e+00 0.000000e+00\n    outer loop\n{corners}    endloop\n  endfacet\n"
            )
        (folder / "a.stl").write_text("".join(text))
        return "a.stl"

    return write


def ply(kind, *lines, body=b"0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"):
    def write(folder):
        (folder / "a.ply").write_bytes(
            "\n".join(["ply", f"format {kind} 1.0", *lines, "end_header", ""]).encode() + body
        )
        return "a.ply"

    return write


def mixed_lists():
    """200,000 triangles and quads in turn."""
    places = np.array([(k % 500, 0, k // 500) for k in range(250_000)], dtype="<f4")
    corner = np.arange(200_000, dtype="<i4")
    rows = [b"\3" + np.array([c, c + 500, c + 1], dtype="<i4").tobytes() if c % 2 else
            b"\4" + np.array([c, c + 500, c + 501, c + 1], dtype="<i4").tobytes() for c in corner.tolist()]  # fmt: skip
    return places.tobytes() + b"".join(rows)


def off(text):
    def write(folder):
        (folder / "a.off").write_text(text)
        return "a.off"

    return write


REST = "1 2 3\n4 9 5\n" * 9_999 + "1 2 3\n"
RANDOM = np.random.default_rng(1)
PLACE = [f"property float {axis}" for axis in "xyz"]
LIST = "property list uchar int vertex_indices"

# the file's writer, and the expected result: numbers of nodes and triangles, or words of the error
GROUPS = {
    "20,000 faces of mixed forms": (mixed_faces, (1, 30_000)),
    "50,000 objects": (statements("o", 0), (1, 50_000)),
    "50,000 unknown materials": (statements("usemtl", 0), (1, 50_000)),
    "20,000 materials": (statements("usemtl", 20_000, 20_000), (1, 50_000)),
    "500 materials": (statements("usemtl", 500, 500), (500, 50_000)),
    "a circle of 1e5 corners": (polygon(np.ones(100_000)), (1, 99_998)),
    "a star of 1e5 corners": (polygon(1 + 0.3 * np.sin(np.arange(100_000) / 300)), (1, 99_998)),
    "a ragged polygon of 1e5 corners": (polygon(RANDOM.uniform(0.5, 1.0, 100_000)), (1, 99_998)),
    "a polygon of noise": (polygon(RANDOM.uniform(-1.0, 1.0, 100_000)), "1 polygon.* cross themselves: 1 left out"),
    "8,000 concave polygons": (many_polygons, (1, 80_000)),
    "polygons of 491 sizes": (sizes, (1, 123_732)),
    "one face 60,000 times": (repeated("f 1 2 161\n" * 60_000), (1, 1)),
    "one polygon that goes round 60,000 times": (repeated("f" + " 1 2 161" * 60_000 + "\n"), (1, 3)),
    "ASCII STL of 8 MB": (facets(32_000), (1, 32_000)),
    "20,000 solids": (facets(20_000, solids=True), (1, 20_000)),
    "PLY of mixed lists": (ply("binary_little_endian", "element vertex 250000", *PLACE, "element face 200000", LIST,
                               body=mixed_lists()), (1, 300_000)),
    "text PLY without its vertices": (ply("ascii", f"element vertex {2**26}", *PLACE), (1, 0)),
    "binary PLY without its vertices": (ply("binary_big_endian", f"element vertex {2**40}", *PLACE), (1, 0)),
    "PLY without its faces": (ply("ascii", "element vertex 3", *PLACE, f"element face {2**28}", LIST), (1, 1)),
    "PLY of rows without properties": (ply("ascii", "element vertex 99999999999", "element face 99999999999"), "nothing to render"),
    "PLY of one list as long as memory": (ply("binary_little_endian", "element face 1", "property list uint int vertex_indices",
                                              body=b"\xff\xff\xff\x7f"), "more than the file can hold"),
    "OFF without its rows": (off(f"OFF\n{2**26} {2**26} 0\n0 0 0\n"), "more than the file can hold"),
    "OFF with one endless line": (off(f"OFF\n20000 1 0\n{'0 0 1 ' * 30_000}\n{REST}3 0 1 2\n"), (1, 1)),
}  # fmt: skip


def cost(path):
    """What loading and rendering a file cost."""
    run = subprocess.run(
        [sys.executable, "-c", CHILD, str(path)], capture_output=True, text=True, timeout=600, check=True
    )
    return json.loads(run.stdout)


@pytest.fixture(scope="module")
def plain(tmp_path_factory):
    """A file of faces and nothing else, read in one pass: the cost per byte on this machine."""
    path = tmp_path_factory.mktemp("plain") / "a.obj"
    faces = "".join(f"f {a} {b} {c}\n" for a, b, c, _ in cells(300_000))
    path.write_text(grid() + faces + "# filled up\n" * ((LARGEST - len(grid()) - len(faces)) // 12))
    return path


@pytest.fixture(scope="module")
def unit(plain):
    """Processor time of the plain file."""
    return cost(plain)["cpu"]


LIKE_OTHERS = (
    "a ragged polygon of 1e5 corners",
    "500 materials",
    "a star of 1e5 corners",
    "20,000 faces of mixed forms",
    "50,000 objects",
)


@pytest.mark.slow
@pytest.mark.parametrize("group", mostly(GROUPS, *LIKE_OTHERS))
def test_small_files_cost_little(group, tmp_path, plain, unit):
    write, expected = GROUPS[group]
    path = tmp_path / write(tmp_path)
    assert path.stat().st_size < LARGEST
    said = cost(path)
    if said["cpu"] >= TIMES * unit:  # other processes may have started on this machine meanwhile
        assert said["cpu"] < TIMES * cost(plain)["cpu"], said
    assert said["memory"] < MEMORY, said
    if isinstance(expected, str):
        assert re.search(expected, said["error"])
    else:
        assert (said["nodes"], said["triangles"]) == expected


@pytest.mark.exhaustive
def test_too_slow_file_is_detected(tmp_path, unit):
    """A file that is read twenty-five times instead of once."""
    path = tmp_path / statements("usemtl", 500, 500)(tmp_path)
    dear = CHILD.replace(f"scene = {LOAD}", f"scene = [{LOAD} for _ in range(25)][0]")
    run = subprocess.run(
        [sys.executable, "-c", dear, str(path)], capture_output=True, text=True, timeout=600, check=True
    )
    assert json.loads(run.stdout)["cpu"] > TIMES * unit


def test_memory_measurement_detects_allocations():
    """A process that takes 200 MiB is measured to have taken them."""
    code = "import re; x = b'x' * (200 << 20); print(1024 * int(re.search(r'VmHWM:\\s+(\\d+)', open('/proc/self/status').read())[1]))"
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert 200 << 20 < int(run.stdout) < 400 << 20


ROWS = {
    "OBJ": repeated("f 1 2 162 161\n"),
    "STL": facets(3),
    "OFF": off("OFF\n4 1 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3\n"),
    "PLY": ply(
        "ascii", "element vertex 4", *PLACE, "element face 1", LIST, body=b"0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3\n"
    ),
}


@pytest.mark.parametrize("write", ROWS.values(), ids=list(ROWS))
def test_triangles_are_limited(write, tmp_path):
    path = tmp_path / write(tmp_path)
    assert read_mesh_file(path, Budget(Limits(triangles=9))).nodes
    with pytest.raises(
        SceneError, match=r"the limit is 1; .* raise it with glshadow\.load\(.*Limits\(triangles=\.\.\.\)"
    ):
        read_mesh_file(path, Budget(Limits(triangles=1)))


def test_binary_stl_is_limited_before_allocation(tmp_path):
    (tmp_path / "a.stl").write_bytes(bytes(80) + (1000).to_bytes(4, "little") + bytes(50_000))
    with pytest.raises(SceneError, match=r"its facets: 1000 .*the limit is 999"):
        read_mesh_file(tmp_path / "a.stl", Budget(Limits(triangles=999)))


@pytest.mark.parametrize("write", ROWS.values(), ids=list(ROWS))
def test_seconds_are_limited(write, tmp_path):
    with pytest.raises(SceneError, match=r"Limits\(seconds=\.\.\.\)"):
        read_mesh_file(tmp_path / write(tmp_path), Budget(Limits(seconds=1e-9)))


def test_bytes_are_limited(tmp_path):
    budget = Budget(Limits(expansion=1.0), taken_bytes=Budget.FREE)
    with pytest.raises(SceneError, match=r"Limits\(expansion=\.\.\.\)"):
        read_mesh_file(tmp_path / mixed_faces(tmp_path), budget)


def test_pixels_are_limited_before_decoding(tmp_path):
    names = [f"{k}.png" for k in range(6)]
    for name in names:
        Image.new("RGB", (10, 10)).save(tmp_path / name)
    (tmp_path / "a.mtl").write_text("".join(f"newmtl m{k}\nmap_Kd {name}\n" for k, name in enumerate(names)))
    faces = "".join(f"usemtl m{k}\nf 1/1 2/1 3/1\n" for k in range(len(names)))
    (tmp_path / "a.obj").write_text("mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\n" + faces)
    assert len(read_mesh_file(tmp_path / "a.obj", Budget(Limits(texture_pixels=150))).nodes) == 6
    with pytest.raises(SceneError, match=r"the image '0\.png': 100 .*the limit is 99"):
        read_mesh_file(tmp_path / "a.obj", Budget(Limits(texture_pixels=99)))
    with pytest.raises(SceneError, match=r"all images: 125 .*the limit is 110"):
        read_mesh_file(tmp_path / "a.obj", Budget(Limits(texture_pixels=110)))


def test_too_many_groups_are_merged(tmp_path):
    """Their base colours become vertex colours of the faces."""
    with pytest.warns(GlshadowWarning, match=r"its 501 groups are more than 500: .* 1 node"):
        scene = load(tmp_path / statements("usemtl", 501, 501)(tmp_path))
    (node,) = scene.nodes
    assert node.name == "m0"
    expected = [(k % 97 / 96, k % 89 / 88, 0.5, 1.0) for k in range(501)]
    found = node.mesh.colors[node.mesh.triangles[:501]] * node.mesh.material.color
    # 1e-3: three digits in the file
    np.testing.assert_allclose(found, np.repeat(np.array(expected)[:, None], 3, axis=1), atol=1e-3)
