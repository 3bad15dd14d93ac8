"""Small glTF files that expand to much data, and how each is made. Run as a script it loads and renders one, and prints the cost."""

from __future__ import annotations

import io
import json
import re
import struct
import sys
import time
import warnings
import zlib
from collections.abc import Callable
from pathlib import Path

import numpy as np

if __package__:
    from .glb import Glb
else:  # as a script
    from glb import Glb

TRIANGLE = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
PLACED = {"extensions": {"KHR_lights_punctual": {"light": 0}}}


def one_mesh(*nodes: dict, **top: object) -> tuple[Glb, dict]:
    """A file with an empty mesh 0, and a primitive of one triangle."""
    file = Glb(nodes=list(nodes) or [{"mesh": 0}], **top)
    return file, {"attributes": {"POSITION": file.add(TRIANGLE)}}


def nodes(*given: dict) -> Glb:
    """One triangle, used by these nodes."""
    file, primitive = one_mesh(*given)
    file.mesh(primitive)
    return file


def without_data(count: int, indexed: bool = False) -> Glb:
    """Positions, or indices, that are declared but not stored."""
    file = Glb(nodes=[{"mesh": 0}])
    primitive = {"attributes": {"POSITION": file.declare(3 if indexed else count)}}
    if indexed:
        primitive["indices"] = file.declare(count, "SCALAR", "uint32")
    file.mesh(primitive)
    return file


def sparse(count: int, used: bool) -> Glb:
    """Three stored positions of very many; `used`: triangles reference all of them."""
    file = Glb(nodes=[{"mesh": 0}])
    rows, values = file.view(np.arange(3, dtype="<u4")), file.view(TRIANGLE.astype("<f4"))
    places = {"count": 3, "indices": {"bufferView": rows, "componentType": 5125}, "values": {"bufferView": values}}
    primitive = {"attributes": {"POSITION": file.declare(count, sparse=places)}}
    if not used:
        primitive["indices"] = file.add(np.arange(3)[:, None], "uint32")
    file.mesh(primitive)
    return file


def gpu_instances(count: int, spread: bool) -> Glb:
    """EXT_mesh_gpu_instancing; `spread`: with stored positions."""
    file, primitive = one_mesh({"mesh": 0})
    places = np.random.default_rng(1).uniform(0.0, 300.0, (count, 3))
    translation = file.add(places) if spread else file.declare(count)
    file.json["nodes"][0]["extensions"] = {"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": translation}}}
    file.mesh(primitive)
    return file


def materials(count: int) -> Glb:
    """Many primitives, each in a colour of its own."""
    colors = [{"pbrMetallicRoughness": {"baseColorFactor": [k / count, 0.5, 0.5, 1]}} for k in range(count)]
    file, primitive = one_mesh(materials=colors)
    file.mesh(*({**primitive, "material": k} for k in range(count)))
    return file


def repeated(count: int) -> Glb:
    """The same primitive again and again."""
    file, primitive = one_mesh()
    file.mesh(*[primitive] * count)
    return file


def chain(count: int) -> Glb:
    """Every node is the child of the previous one."""
    return nodes(*({"children": [k + 1], "translation": [0.01, 0, 0]} for k in range(count - 1)), {"mesh": 0})


def lights(count: int, kind: str) -> Glb:
    """One light in many nodes."""
    file = nodes({"mesh": 0}, *({**PLACED, "translation": [0.1, 0.1, 1 + k / count]} for k in range(count)))
    file.json["extensions"] = {"KHR_lights_punctual": {"lights": [{"type": kind}]}}
    return file


def amplified(placed: int, triangles: int) -> Glb:
    """A small mesh at many places."""
    places = [{"mesh": 0, "translation": [12 * (k % 80), 0, 12 * (k // 80)]} for k in range(placed)]
    file = Glb(nodes=places)
    corners = np.random.default_rng(0).uniform(0.0, 1.0, (triangles, 3, 3))
    corners += np.random.default_rng(1).uniform(0.0, 10.0, (triangles, 1, 3))
    file.mesh({"attributes": {"POSITION": file.add(corners.reshape(-1, 3))}})
    return file


def shapes_and_materials(count: int, triangles: int) -> Glb:
    """Many primitives of one large shape, each with a material of its own."""
    file = materials(count)
    corners = np.random.default_rng(0).uniform(0.0, 10.0, (3 * triangles, 3))
    attributes = {"POSITION": file.add(corners)}
    for primitive in file.json["meshes"][0]["primitives"]:
        primitive["attributes"] = attributes
    return file


def textured(*pictures: bytes) -> Glb:
    """One triangle per image."""
    count = len(pictures)
    infos = [{"pbrMetallicRoughness": {"baseColorTexture": {"index": k}}} for k in range(count)]
    file, primitive = one_mesh(materials=infos, textures=[{"source": k} for k in range(count)])
    primitive["attributes"]["TEXCOORD_0"] = file.add(np.array([[0.0, 0], [1, 0], [0, 1]]))
    file.json["images"] = [
        {"bufferView": file.view(np.frombuffer(p, np.uint8)), "mimeType": "image/png"} for p in pictures
    ]
    file.mesh(*({**primitive, "material": k} for k in range(count)))
    return file


def png(side: int, channels: int = 3, bits: int = 8, interlaced: bool = False) -> bytes:
    """A black image: its file is a thousandth of its pixels."""
    packer, row = zlib.compressobj(9), b"\0" + bytes(side * channels * bits // 8)
    data = b"".join(packer.compress(row * 64) for _ in range(side // 64)) + packer.flush()
    kind = {1: 0, 3: 2, 4: 6}[channels]
    head = struct.pack(">IIBBBBB", side, side, bits, kind, 0, 0, int(interlaced))
    parts = ((b"IHDR", head), (b"IDAT", data), (b"IEND", b""))
    return b"\x89PNG\r\n\x1a\n" + b"".join(
        struct.pack(">I", len(body)) + name + body + struct.pack(">I", zlib.crc32(name + body)) for name, body in parts
    )


def jpeg_of_many_scans(side: int, scans: int) -> bytes:
    """A progressive grey image whose last scan is repeated: a few bytes each, a pass over every pixel each."""
    from PIL import Image

    stream = io.BytesIO()
    Image.new("L", (side, side), 128).save(stream, "JPEG", progressive=True)
    data = stream.getvalue()
    last = data.rindex(b"\xff\xda")
    start = max(data.rindex(b"\xff\xc4"), data.rindex(b"\xff\xda", 0, last))  # with the table that it needs
    start = start if data[start + 1] == 0xC4 else last
    return data[:-2] + data[start:-2] * scans + data[-2:]


GROUPS: dict[str, tuple[Callable[[], Glb], str]] = {
    "2^26 positions without data": (lambda: without_data(2**26 // 3 * 3), "expansion"),
    "2^26 indices without data": (lambda: without_data(2**26 // 3 * 3, indexed=True), "expansion"),
    "1e7 sparse positions, 3 used": (lambda: sparse(10**7, used=False), "drawn"),
    "1e7 sparse positions": (lambda: sparse(9_999_999, used=True), "expansion"),
    "1e5 GPU instances in one place": (lambda: gpu_instances(10**5, spread=False), "drawn"),
    "1e5 GPU instances": (lambda: gpu_instances(10**5, spread=True), "drawn"),
    "1e6 GPU instances": (lambda: gpu_instances(10**6, spread=False), "nodes"),
    "20,000 materials": (lambda: materials(20_000), "drawn"),
    "20,000 materials of 1,000 triangles": (lambda: shapes_and_materials(20_000, 1000), "expansion"),
    "a primitive 20,000 times": (lambda: repeated(20_000), "drawn"),
    "1e5 nodes": (lambda: nodes(*({"mesh": 0, "translation": [k % 300, k // 300, 0]} for k in range(10**5))), "drawn"),
    "1e6 nodes": (lambda: nodes(*[{"mesh": 0}] * 10**6), "nodes"),
    "a chain of 1e5 nodes": (lambda: chain(10**5), "drawn"),
    "as many lamps as are allowed": (lambda: lights(256, "point"), "drawn"),
    "as many suns as are allowed": (lambda: lights(256, "directional"), "drawn"),
    "257 lamps": (lambda: lights(257, "point"), "lights"),
    "20,000 lamps": (lambda: lights(20_000, "point"), "lights"),
    "20,000 suns": (lambda: lights(20_000, "directional"), "lights"),
    "6,000 nodes of 1,000 triangles": (lambda: amplified(6000, 1000), "drawn"),
    "30,000 nodes of 1,000 triangles": (lambda: amplified(30_000, 1000), "triangles"),
    "PNG of 16384 x 16384": (lambda: textured(png(16384, 1)), "texture_pixels"),
    "PNG of 8192 x 8192": (lambda: textured(png(8192)), "expansion"),
    "PNG of 4096 x 4096": (lambda: textured(png(4096)), "drawn"),
    "PNG of 4096 x 4096 x 4 x 16 bits": (lambda: textured(png(4096, 4, 16)), "drawn"),
    "50 PNGs of 4096 x 4096": (lambda: textured(*[png(4096)] * 50), "expansion"),
    "JPEG of 1,000 scans": (lambda: textured(jpeg_of_many_scans(4096, 1000)), "expansion"),
    "JPEG of 20 scans": (lambda: textured(jpeg_of_many_scans(1024, 20)), "drawn"),
}


def main(path: str) -> None:
    """Load and render; prints a JSON object with the result, seconds of processor time and bytes of memory."""
    import glshadow as gs

    warnings.simplefilter("ignore")
    try:
        with gs.Renderer() as renderer:
            renderer.render(gs.load(path), size=(96, 64), samples=1)
        outcome = "drawn"
    except gs.GlshadowError as error:
        outcome = f"{type(error).__name__}: {error}"
    memory = peak_memory()
    json.dump({"outcome": outcome, "seconds": time.process_time(), "memory": memory}, sys.stdout)


def peak_memory() -> int:
    """Bytes; of this program alone, while ru_maxrss includes the process that it was forked from."""
    found = re.search(r"VmHWM:\s+(\d+) kB", Path("/proc/self/status").read_text())
    assert found is not None
    return 1024 * int(found[1])


if __name__ == "__main__":
    main(sys.argv[1])
