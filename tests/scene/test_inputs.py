"""What `load` takes besides paths: bytes, file objects and arrays; formats that are refused with what to convert by."""

from __future__ import annotations

import io
import json
import struct
import zipfile
from pathlib import Path

import numpy as np
import pytest

import glshadow as gs
from glshadow.errors import GlshadowWarning, SceneError, SettingsError
from tests.scene.glb import Glb

CORNERS = np.array([[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 3.0, 0.0], [0.0, 0.0, 4.0]])
FACES = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])


def glb_bytes(folder: Path) -> bytes:
    file = Glb()
    primitive = {"attributes": {"POSITION": file.add(CORNERS)}, "indices": file.add(FACES.reshape(-1, 1), "uint16")}
    file.json["nodes"] = [{"mesh": file.mesh(primitive)}]
    return file.save(folder / "made.glb").read_bytes()


def gltf_bytes(folder: Path) -> bytes:
    import base64

    data = CORNERS[FACES].astype("<f4").tobytes()
    document = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 12, "type": "VEC3"}],
        "bufferViews": [{"buffer": 0, "byteLength": len(data)}],
        "buffers": [{"byteLength": len(data), "uri": "data:;base64," + base64.b64encode(data).decode()}],
    }
    return json.dumps(document).encode()


def obj_bytes(folder: Path) -> bytes:
    lines = (
        ["# a tetrahedron"]
        + ["v {} {} {}".format(*row) for row in CORNERS]
        + ["f {} {} {}".format(*row) for row in FACES + 1]
    )
    return "\n".join(lines).encode()


def ply_bytes(folder: Path) -> bytes:
    head = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
    head += "element face 4\nproperty list uchar int vertex_indices\nend_header\n"
    rows = [" ".join(map(str, row)) for row in CORNERS] + [" ".join(map(str, [3, *row])) for row in FACES]
    return (head + "\n".join(rows) + "\n").encode()


def off_bytes(folder: Path) -> bytes:
    rows = [" ".join(map(str, row)) for row in CORNERS] + [" ".join(map(str, [3, *row])) for row in FACES]
    return ("OFF\n4 4 6\n" + "\n".join(rows) + "\n").encode()


def stl_bytes(folder: Path, header: bytes = b"solid but binary") -> bytes:
    """Binary; its header may begin as that of a text file does, or of another format."""
    body = b"".join(struct.pack("<12fH", 0, 0, 0, *CORNERS[row].ravel(), 0) for row in FACES)
    return header.ljust(80) + struct.pack("<I", 4) + body


def stl_text(folder: Path) -> bytes:
    lines = ["solid a"]
    for row in FACES:
        lines += [
            "facet normal 0 0 0",
            "outer loop",
            *("vertex {} {} {}".format(*CORNERS[k]) for k in row),
            "endloop",
            "endfacet",
        ]
    return "\n".join([*lines, "endsolid a", ""]).encode()


MADE = {
    "glb": glb_bytes,
    "gltf": gltf_bytes,
    "obj": obj_bytes,
    "ply": ply_bytes,
    "off": off_bytes,
    "stl": stl_bytes,
    "text.stl": stl_text,
    "named.stl": lambda folder: stl_bytes(folder, b"OFF, as exported"),
}


def corners_of(scene: gs.Scene) -> list[list[list[float]]]:
    """The triangles' corners, each triangle's first corner first."""
    (node,) = scene.nodes
    return sorted(np.asarray(node.mesh.positions)[node.mesh.triangles].tolist())


EXPECTED = sorted(CORNERS[FACES].tolist())


@pytest.mark.parametrize("kind", MADE)
def test_bytes_and_file_objects_equal_the_file(tmp_path: Path, kind: str) -> None:
    data = MADE[kind](tmp_path)
    path = tmp_path / f"model.{kind}"
    path.write_bytes(data)
    with path.open("rb") as file:
        scenes = [
            gs.load(path),
            gs.load(data),
            gs.load(bytearray(data)),
            gs.load(memoryview(data)),
            gs.load(io.BytesIO(data)),
            gs.load(io.BytesIO(data), format=kind[-3:] if kind != "gltf" else kind),
            gs.load(file),
        ]
    assert [scene.name for scene in scenes] == [path.stem, *["scene"] * 5, path.stem]
    for scene in scenes:
        assert corners_of(scene) == EXPECTED


def test_format_replaces_the_suffix(tmp_path: Path) -> None:
    path = tmp_path / "model.dat"
    path.write_bytes(stl_bytes(tmp_path))
    assert corners_of(gs.load(path, format="stl")) == EXPECTED
    with pytest.raises(SceneError, match="must end in one of"):
        gs.load(path)
    with pytest.raises(SettingsError, match="format must be one of"):
        gs.load(path, format="STL2")
    with pytest.raises(SceneError, match="format names that of a file"):
        gs.load((CORNERS, FACES), format="stl")


def test_a_file_object_on_disk_finds_what_it_names(tmp_path: Path) -> None:
    (tmp_path / "m.mtl").write_text("newmtl red\nKd 0.5 0 0\n")
    data = b"mtllib m.mtl\nusemtl red\n" + obj_bytes(tmp_path)
    path = tmp_path / "model.obj"
    path.write_bytes(data)
    with path.open("rb") as file:
        assert gs.load(file).nodes[0].mesh.material.color == (0.5, 0.0, 0.0, 1.0)
    with pytest.warns(GlshadowWarning, match=r"bytes: the file 'm.mtl' .* data in memory has no folder"):
        assert gs.load(data).nodes[0].mesh.material.color == (1.0, 1.0, 1.0, 1.0)


def test_gltf_in_memory_reads_no_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    document = json.loads(gltf_bytes(tmp_path))
    (tmp_path / "a.bin").write_bytes(CORNERS[FACES].astype("<f4").tobytes())
    document["buffers"][0]["uri"] = "a.bin"
    with pytest.raises(SceneError, match="data in memory has no folder"):
        gs.load(json.dumps(document).encode())


@pytest.mark.parametrize(
    ("vertices", "faces"),
    [
        (CORNERS, FACES),
        (CORNERS.astype(np.float32), FACES.astype(np.uint64)),
        (CORNERS.tolist(), FACES.tolist()),
        (CORNERS, FACES.astype(float)),
    ],
)
def test_vertices_and_faces(vertices: object, faces: object) -> None:
    for pair in ((vertices, faces), [vertices, faces]):
        scene = gs.load(pair)
        assert corners_of(scene) == EXPECTED
        assert scene.name == "scene"


def test_quadrangles() -> None:
    square = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]])
    scene = gs.load((square, [[0, 1, 2, 3]]))
    assert scene.nodes[0].mesh.triangles.tolist() == [[0, 1, 2], [0, 2, 3]]


@pytest.mark.parametrize(
    ("pair", "named"),
    [
        ((CORNERS, FACES + 1), "index 4 is out of range"),
        ((CORNERS[:, :2], FACES), "positions"),
        ((CORNERS, FACES[:, :2]), "at least 3 corners"),
        ((CORNERS, FACES + 0.5), "integers"),
        ((CORNERS, np.full((1, 4), 0.5)), "integers"),
        ((CORNERS * np.nan, FACES), "not finite"),
        ((CORNERS, np.zeros((0, 3), int)), "nothing to render"),
        ((CORNERS, [[0, 1, 2], [0, 1, 2, 3]]), r"must be \(vertices, faces\), arrays"),
        ((CORNERS + 1j, FACES), r"must be \(vertices, faces\), arrays"),
        ([(CORNERS, FACES), (CORNERS, FACES)], r"nodes\[0\] must be Node or Mesh.*one by one"),
    ],
)
def test_broken_arrays_are_named(pair: object, named: str) -> None:
    with pytest.raises(SceneError, match=named):
        gs.load(pair)


def test_text_streams_endless_and_failing_ones_are_named() -> None:
    class Endless:
        def read(self, count: int) -> bytes:
            return b"v 0 0 0\n" * (count // 8)

    class Failing:
        def read(self, count: int) -> bytes:
            raise OSError("the line is dead")

    with pytest.raises(SceneError, match="binary mode"):
        gs.load(io.StringIO("OFF"))
    closed = io.BytesIO(b"OFF")
    closed.close()
    with pytest.raises(SceneError, match="the file object is closed"):
        gs.load(closed)
    with pytest.raises(SceneError, match="file_bytes"):
        gs.load(Endless(), limits=gs.Limits(file_bytes=10**7))
    with pytest.raises(SceneError, match="the line is dead"):
        gs.load(Failing())
    with pytest.raises(SceneError, match="0 bytes"):
        gs.load(b"")
    with pytest.raises(SceneError, match="0 bytes"):
        gs.load(io.BytesIO())
    with pytest.raises(SceneError, match="file_bytes"):
        gs.load(obj_bytes(Path()), limits=gs.Limits(file_bytes=10))
    with pytest.raises(SceneError, match=r"not recognised.*format='glb' or"):
        gs.load(b"\x00\x01 nothing known")
    with pytest.raises(SceneError, match="load takes a path, bytes or a file object"):
        gs.load(object())


def zipped(name: str) -> bytes:
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w") as file:
        file.writestr(name, "x")
    return stream.getvalue()


FOREIGN = {
    "usd": (b"PXR-USDC\0\0", "USD.*Blender"),
    "usda": (b"#usda 1.0\n", "USD.*Blender"),
    "usdc": (b"PXR-USDC\0\0", "USD.*Blender"),
    "usdz": (zipped("model.usdc"), "USD.*Blender"),
    "step": (b"ISO-10303-21;\n", "STEP.*FreeCAD"),
    "stp": (b"ISO-10303-21;\n", "STEP.*FreeCAD"),
    "iges": (None, "IGES.*FreeCAD"),
    "igs": (None, "IGES.*FreeCAD"),
    "fbx": (b"Kaydara FBX Binary  \0", "FBX.*FBX2glTF"),
    "dae": (b'<?xml version="1.0"?>\n<COLLADA xmlns="">', "COLLADA.*trimesh"),
    "3mf": (zipped("3D/3dmodel.model"), "3MF.*trimesh"),
    "blend": (b"BLENDER-v300", "Blender"),
}


@pytest.mark.parametrize("suffix", FOREIGN)
def test_foreign_formats_say_what_to_convert_by(tmp_path: Path, suffix: str) -> None:
    data, named = FOREIGN[suffix]
    path = tmp_path / f"part.{suffix.upper()}"  # whether or not it exists, and in any case
    with pytest.raises(SceneError, match=named) as caught:
        gs.load(path)
    assert f".{suffix}" in str(caught.value)
    if data is not None:
        for source in (data, io.BytesIO(data)):
            with pytest.raises(SceneError, match=named):
                gs.load(source)


def test_render_takes_them_too() -> None:
    frame = gs.render((CORNERS, FACES), size=(32, 24), outputs="node", samples=1)
    assert (frame.node == 0).any()
