"""glTF data that is compressed or quantised: meshopt's codecs and filters, Basis Universal, KHR_mesh_quantization."""

from __future__ import annotations

import base64
import builtins
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import glshadow as gs
from glshadow.errors import GlshadowWarning, SceneError
from tests.scene.glb import Glb

TRIANGLES = [0, 1, 2, 2, 1, 3, 4, 0, 2]
# (x, y, z, padding) as uint16
POSITIONS = np.array(
    [[0, 0, 0, 0], [300, 0, 0, 0], [300, 300, 0, 0], [0, 300, 0, 0], [65535, 1, 2, 0]], dtype=np.uint16
)

# Made by the encoder of the npm package meshoptimizer 1.3.0: MeshoptEncoder.encodeGltfBuffer of the arrays above, of the three index
# formats, and of the results of encodeFilterOct, encodeFilterQuat and encodeFilterExp.
THEIRS = {
    "ATTRIBUTES": "oAEzQAAAWFcBIUAAAAEMwAAAWFUBCEAAAAEAwAAABAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAA",
    "TRIANGLES": "4fAQIAB2h1ZneKmGZYlomAFpAAA=",
    "INDICES": "0QAEBAACCAQOCAAAAAA=",
    "OCTAHEDRAL 4": "oAE/AAAA/v1FAT8AAACSbKUAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAH8A",
    "OCTAHEDRAL 8": "oAEbAAAAdQE/AAAADg0FAT8AAADb2mkBPwAAAAgGCQAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAA/wcAAA==",
    "EXPONENTIAL 12": "oAABPAAAAGQjAAE8AAAACgcBPAAAACAfATwAAAAfSAABPAAAAAoHATwAAAD//wE8AAAAQj4BIAAAAAE8AAAACgcAAAAAAAAAAAAA"
    "AAAAAAAAAAAAAAAAAPQAEAD0AOD/9A==",
    "QUATERNION 8": "oAE8AAAAsbIBPAAAAAoJATwAAACy4AE8AAAACxgBPAAAALGyATwAAAAKCQE8AAAABQQAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAA"
    "AA/wc=",
}  # fmt: skip
UNIT = np.array([[0.0, 0.0, 1.0], [0.6, 0.0, -0.8], [0.0, 1.0, 0.0], [-0.48, 0.6, 0.64]])


class Compressed(Glb):
    """A file whose buffer 1 exists only in compressed form."""

    def pack(self, code: str, count: int, stride: int, mode: str, **block: Any) -> int:
        """Number of a buffer view that `code`, in base64, is the compressed form of."""
        data = base64.b64decode(code)
        where = {
            "buffer": 0,
            "byteOffset": len(self.binary),
            "byteLength": len(data),
            "byteStride": stride,
            "count": count,
            "mode": mode,
        }
        self.binary += data + b"\0" * (-len(data) % 4)
        plain = {"buffer": 1, "byteOffset": 0, "byteLength": count * stride}
        if mode == "ATTRIBUTES":
            plain["byteStride"] = stride
        self.json["bufferViews"].append({**plain, "extensions": {"EXT_meshopt_compression": {**where, **block}}})
        return len(self.json["bufferViews"]) - 1

    def accessor(self, view: int, component: int, count: int, kind: str, **extra: Any) -> int:
        self.json["accessors"].append(
            {"bufferView": view, "componentType": component, "count": count, "type": kind, **extra}
        )
        return len(self.json["accessors"]) - 1

    def store(self, folder: Path, attributes: dict[str, int], indices: int | None) -> Path:
        primitive = {"attributes": attributes} | ({} if indices is None else {"indices": indices})
        self.json["nodes"] = [{"mesh": self.mesh(primitive)}]
        fallback = {"byteLength": 4096, "extensions": {"EXT_meshopt_compression": {"fallback": True}}}
        self.json["buffers"] = [{"byteLength": len(self.binary)}, fallback]
        self.json["extensionsRequired"] = ["EXT_meshopt_compression", "KHR_mesh_quantization"]
        return self.save(folder / "made.glb")


def whole(folder: Path, indices: str = "TRIANGLES", **changes: Any) -> Path:
    file = Compressed()
    size, component = (2, 5123) if indices == "TRIANGLES" else (4, 5125)
    positions = file.pack(**{"code": THEIRS["ATTRIBUTES"], "count": 5, "stride": 8, "mode": "ATTRIBUTES", **changes})
    faces = file.pack(THEIRS[indices], 9, size, indices)
    return file.store(
        folder,
        {"POSITION": file.accessor(positions, 5123, 5, "VEC3")},
        file.accessor(faces, component, 9, "SCALAR"),
    )


@pytest.mark.parametrize("indices", ["TRIANGLES", "INDICES"])
def test_positions_and_indices(tmp_path: Path, indices: str) -> None:
    """The codec of triangles may turn a triangle's corners; their cycle stays."""
    mesh = gs.load(whole(tmp_path, indices)).nodes[0].mesh
    np.testing.assert_array_equal(mesh.positions, POSITIONS[:, :3])
    turned = [min(row[k:] + row[:k] for k in range(3)) for row in mesh.triangles.tolist()]
    wanted = [min(row[k:] + row[:k] for k in range(3)) for row in np.reshape(TRIANGLES, (3, 3)).tolist()]
    assert turned == wanted


@pytest.mark.parametrize(("stride", "component", "most"), [(4, 5120, 127), (8, 5122, 32767)])
def test_octahedral_normals(tmp_path: Path, stride: int, component: int, most: int) -> None:
    file = Compressed()
    position = file.add(np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]))
    view = file.pack(THEIRS[f"OCTAHEDRAL {stride}"], 4, stride, "ATTRIBUTES", filter="OCTAHEDRAL")
    normal = file.accessor(view, component, 4, "VEC3", normalized=True)
    faces = file.add(np.array([[0], [1], [2], [0], [2], [3]]), "uint16")
    mesh = gs.load(file.store(tmp_path, {"POSITION": position, "NORMAL": normal}, faces)).nodes[0].mesh
    # bytes: half a step of the octahedron and one of the result; 12 bits in 16
    np.testing.assert_allclose(mesh.normals, UNIT, atol=1.5 / 127 if stride == 4 else 1.5 / 2047)


def test_exponential_positions(tmp_path: Path) -> None:
    """All of these are exact in 15 bits with an exponent for each row."""
    file = Compressed()
    view = file.pack(THEIRS["EXPONENTIAL 12"], 3, 12, "ATTRIBUTES", filter="EXPONENTIAL")
    mesh = gs.load(file.store(tmp_path, {"POSITION": file.accessor(view, 5126, 3, "VEC3")}, None)).nodes[0].mesh
    np.testing.assert_array_equal(mesh.positions, [[0.0, 1.0, -2.0], [100.0, 0.125, 3.0], [4.0, 4.5, 4.0]])


def test_quaternions_of_instances(tmp_path: Path) -> None:
    """EXT_mesh_gpu_instancing: the rotations (0, 0, 0, 1), (.5, .5, -.5, .5) and (.6, 0, .8, 0), to 12 bits."""
    file = Compressed()
    position = file.add(np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]))
    view = file.pack(THEIRS["QUATERNION 8"], 3, 8, "ATTRIBUTES", filter="QUATERNION")
    rotation = file.accessor(view, 5122, 3, "VEC4", normalized=True)
    path = file.store(tmp_path, {"POSITION": position}, None)
    file.json["nodes"][0]["extensions"] = {"EXT_mesh_gpu_instancing": {"attributes": {"ROTATION": rotation}}}
    nodes = gs.load(file.save(path)).nodes
    for node, (x, y, z, w) in zip(nodes, [(0, 0, 0, 1), (0.5, 0.5, -0.5, 0.5), (0.6, 0, 0.8, 0)], strict=True):
        q = np.array([x, y, z], dtype=float)
        for column, axis in enumerate(np.eye(3)):
            turned = axis + 2.0 * w * np.cross(q, axis) + 2.0 * np.cross(q, np.cross(q, axis))
            np.testing.assert_allclose(node.world_from_mesh[:3, column], turned, atol=3e-3)


@pytest.mark.parametrize(
    ("changes", "named"),
    [
        ({"mode": "TRIANGLES"}, "TRIANGLES|cannot be decoded|bytes"),
        ({"mode": "WORDS"}, "mode 'WORDS'"),
        ({"filter": "SHARP"}, "filter 'SHARP'"),
        ({"filter": "QUATERNION"}, None),  # whatever it holds: 8 bytes an element
        ({"filter": "OCTAHEDRAL", "stride": 12, "count": 3}, "cannot be decoded"),
        ({"code": THEIRS["ATTRIBUTES"][:40]}, "cannot be decoded"),
        ({"code": base64.b64encode(b"\xa0" + b"\xff" * 60).decode()}, "cannot be decoded"),
        ({"count": 10**9}, "limit"),
        ({"stride": 260}, "at most 256 bytes"),
        ({"byteLength": 10**6}, "covers bytes"),
        ({"buffer": 7}, "buffers"),
    ],
)
def test_broken_data_is_named(tmp_path: Path, changes: dict[str, Any], named: str | None) -> None:
    path = whole(tmp_path, **changes)
    if named is None:
        gs.load(path)
        return
    with pytest.raises(SceneError, match=named):
        gs.load(path)


def test_length_of_the_view_is_checked(tmp_path: Path) -> None:
    file = Compressed()
    view = file.pack(THEIRS["ATTRIBUTES"], 5, 8, "ATTRIBUTES")
    file.json["bufferViews"][view]["byteLength"] = 48
    with pytest.raises(SceneError, match="5 elements of 8 bytes are not its 48 bytes"):
        gs.load(file.store(tmp_path, {"POSITION": file.accessor(view, 5123, 5, "VEC3")}, None))


def without(monkeypatch: pytest.MonkeyPatch, package: str) -> None:
    plain = builtins.__import__

    def found(name: str, *rest: Any, **more: Any) -> Any:
        if name == package and not (rest and rest[0] and rest[0].get("__name__", "").startswith(package)):
            raise ImportError(name)
        return plain(name, *rest, **more)

    monkeypatch.setattr(builtins, "__import__", found)


def test_without_the_package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    without(monkeypatch, "meshopt")
    with pytest.raises(SceneError, match=r"EXT_meshopt_compression.*glshadow\[gltf\]"):
        gs.load(whole(tmp_path))


def test_uncompressed_data_beside_needs_no_package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    without(monkeypatch, "meshopt")
    file = Compressed()
    view = file.pack(THEIRS["ATTRIBUTES"], 5, 8, "ATTRIBUTES")
    path = file.store(tmp_path, {"POSITION": file.accessor(view, 5123, 3, "VEC3")}, None)
    file.json["buffers"][1] = {
        "byteLength": 40,
        "uri": "data:;base64," + base64.b64encode(POSITIONS.tobytes()).decode(),
    }
    np.testing.assert_array_equal(gs.load(file.save(path)).nodes[0].mesh.positions, POSITIONS[:3, :3])


# 8 x 4 pixels, the left half red and the right half blue, by the npm package ktx2-encoder 1.0 (Basis Universal 2.50), srgb.
KTX2 = {
    "UASTC": "q0tUWCAyMLsNChoKAAAAAAEAAAAIAAAABAAAAAAAAAAAAAAAAQAAAAEAAAAAAAAAaAAAACwAAACUAAAALAAAAAAAAAAAAAAAAAAAAAAAAADAAAAAAAAAACAA"
    "AAAAAAAAIAAAAAAAAAAsAAAAAAAAAAIAKACmAQIAAwMAABAAAAAAAAAAAAB/AAAAAAAAAAAA/////x8AAABLVFh3cml0ZXIAQmFzaXMgVW5pdmVyc2FsIDIu"
    "NTAAAAQAAAB/fwAA9x8A4B96AAAAAAAAAAAAABcA4P8fAuABAAAAAAAAAAA=",
    "ETC1S": "q0tUWCAyMLsNChoKAAAAAAEAAAAIAAAABAAAAAAAAAAAAAAAAQAAAAEAAAABAAAAaAAAACwAAACUAAAAJAAAALgAAAAAAAAAggAAAAAAAAA6AQAAAAAAAAEA"
    "AAAAAAAAAAAAAAAAAAAsAAAAAAAAAAIAKACjAQIAAwMAAAgAAAAAAAAAAAA/AAAAAAAAAAAA/////x8AAABLVFh3cml0ZXIAQmFzaXMgVW5pdmVyc2FsIDIu"
    "NTAAAAIAAQAqAAAABQAAACsAAAAAAAAAAAAAAAAAAAABAAAAAAAAAAAAAAAgwEQAAAAAAADiRAQwEQAAAAAAgCQgAEwACAAAAAAgBgATAAAAAAAACCasqqqq"
    "AgDBRAAAAAAAAPJfTQCYABAAAAAAQBQAJgAEAAAAABADgAkAAAAAAAAEEAAA",
}  # fmt: skip


def textured(folder: Path, data: bytes, **texture: Any) -> Path:
    file = Glb(extensionsRequired=["KHR_texture_basisu"])
    corners = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    image = {"mimeType": "image/ktx2", "bufferView": file.view(np.frombuffer(data, dtype=np.uint8))}
    file.json["images"] = [image]
    file.json["textures"] = [{"extensions": {"KHR_texture_basisu": {"source": 0}}, **texture}]
    file.json["materials"] = [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}]
    primitive = {"attributes": {"POSITION": file.add(corners), "TEXCOORD_0": file.add(corners[:, :2])}, "material": 0}
    file.json["nodes"] = [{"mesh": file.mesh(primitive)}]
    return file.save(folder / "made.glb")


@pytest.mark.parametrize("codec", KTX2)
def test_basis_universal(tmp_path: Path, codec: str) -> None:
    texture = gs.load(textured(tmp_path, base64.b64decode(KTX2[codec]))).nodes[0].mesh.material.texture
    assert texture is not None
    assert texture.shape == (4, 8, 4)
    expected = np.zeros((4, 8, 4), dtype=int)
    expected[:, :4, 0] = expected[:, 4:, 2] = expected[..., 3] = 255
    assert np.abs(texture.astype(int) - expected).max() <= (
        0 if codec == "UASTC" else 4
    )  # ETC1S stores five bits a channel


@pytest.mark.parametrize(
    "data",
    [b"\xabKTX 20\xbb\r\n\x1a\n", b"\xabKTX 20\xbb\r\n\x1a\n" + b"\0" * 80, base64.b64decode(KTX2["UASTC"])[:-20]],
)
def test_broken_images_are_left_out_with_a_note(tmp_path: Path, data: bytes) -> None:
    with pytest.warns(GlshadowWarning, match="KTX 2"):
        assert gs.load(textured(tmp_path, data)).nodes[0].mesh.material.texture is None


def test_size_of_an_image_is_checked_before_decoding(tmp_path: Path) -> None:
    data = bytearray(base64.b64decode(KTX2["UASTC"]))
    data[20:28] = (60000).to_bytes(4, "little") * 2
    with pytest.raises(SceneError, match="texture_pixels"):
        gs.load(textured(tmp_path, bytes(data)))


def test_basis_universal_without_the_package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    without(monkeypatch, "opengl_basisu")
    with pytest.warns(GlshadowWarning, match=r"Basis Universal.*glshadow\[gltf\]"):
        assert gs.load(textured(tmp_path, base64.b64decode(KTX2["UASTC"]))).nodes[0].mesh.material.texture is None


def test_a_base_image_is_preferred(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    without(monkeypatch, "opengl_basisu")
    gs.image.write(tmp_path / "a.png", np.full((2, 2, 3), 7, dtype=np.uint8))
    file = textured(tmp_path, b"none", source=0)
    document = file.read_bytes().replace(b'"mimeType": "image/ktx2", "bufferView": 0', b'"uri": "a.png"'.ljust(41))
    file.write_bytes(document)
    texture = gs.load(file).nodes[0].mesh.material.texture
    assert texture is not None
    assert texture[0, 0].tolist() == [7, 7, 7, 255]


RANGES = {"int8": 127.0, "uint8": 255.0, "int16": 32767.0, "uint16": 65535.0}


@pytest.mark.parametrize("normalized", [False, True])
@pytest.mark.parametrize("dtype", RANGES)
def test_quantized_positions(tmp_path: Path, dtype: str, normalized: bool) -> None:
    """KHR_mesh_quantization: c, or max(c / most, -1) if normalised; rows are padded to four bytes."""
    info = np.iinfo(dtype)
    stored = np.array([[info.min, 0, 5], [info.max, 1, 7], [3, info.max, 100], [info.min + 1, 9, 2]])
    expected = np.maximum(stored / RANGES[dtype], -1.0) if normalized else stored.astype(float)
    mesh = quantized(tmp_path, "POSITION", stored, dtype, normalized)
    np.testing.assert_array_equal(mesh.positions, expected)


@pytest.mark.parametrize("dtype", ["int8", "int16"])
def test_quantized_normals(tmp_path: Path, dtype: str) -> None:
    most = RANGES[dtype]
    stored = np.rint(UNIT * most).astype(int)
    mesh = quantized(tmp_path, "NORMAL", stored, dtype, True)
    given = stored / most
    np.testing.assert_allclose(mesh.normals, given / np.linalg.norm(given, axis=1)[:, None], atol=1e-7)  # float32


@pytest.mark.parametrize("normalized", [False, True])
@pytest.mark.parametrize("dtype", RANGES)
def test_quantized_texture_coordinates(tmp_path: Path, dtype: str, normalized: bool) -> None:
    stored = np.array([[0, 1], [2, 3], [4, 100], [np.iinfo(dtype).max, 0]])
    uv = stored / RANGES[dtype] if normalized else stored.astype(float)
    mesh = quantized(tmp_path, "TEXCOORD_0", stored, dtype, normalized)
    np.testing.assert_allclose(mesh.uv, np.stack([uv[:, 0], 1.0 - uv[:, 1]], axis=1).astype(np.float32), rtol=1e-7)


def quantized(folder: Path, name: str, stored: np.ndarray, dtype: str, normalized: bool) -> gs.Mesh:
    """The mesh of a file with one attribute of that type; its rows are a multiple of four bytes apart."""
    gs.image.write(folder / "a.png", np.zeros((2, 2, 3), dtype=np.uint8))
    file = Glb(extensionsRequired=["KHR_mesh_quantization"])
    columns = stored.shape[1]
    rows = np.zeros((len(stored), 4 if columns == 3 or np.dtype(dtype).itemsize == 1 else 2), dtype=dtype)
    rows[:, :columns] = stored
    accessor = file.add(rows, dtype)
    view = file.json["accessors"][accessor]["bufferView"]
    file.json["bufferViews"][view]["byteStride"] = rows.itemsize * rows.shape[1]
    file.json["accessors"][accessor] |= {"type": f"VEC{columns}", "normalized": normalized}
    attributes = {
        "POSITION": file.add(np.vstack([np.zeros(3), np.eye(3)])),
        "TEXCOORD_0": file.add(np.zeros((4, 2))),
        name: accessor,
    }
    file.json["images"], file.json["textures"] = [{"uri": "a.png"}], [{"source": 0}]
    file.json["materials"] = [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}]
    faces = file.add(np.array([[0], [1], [2], [0], [2], [3]]), "uint16")
    file.json["nodes"] = [{"mesh": file.mesh({"attributes": attributes, "indices": faces, "material": 0})}]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        return gs.load(file.save(folder / "quantized.glb")).nodes[0].mesh
