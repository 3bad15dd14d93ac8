"""Model files with random changes: numbers, types and keys of the JSON, bytes of the data, lengths, truncation."""

from __future__ import annotations

import json
import struct
import tempfile
import warnings
import zlib
from collections.abc import Collection
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

import glshadow as gs

Rng = np.random.Generator

BESIDE_HOSTILE = ("milk_truck.glb", "cesium_man.glb", "house_scene.glb")
LARGEST = 1_200_000  # bytes: one case must take milliseconds

# Written instead of numbers: limits of the integer and float formats, beyond both, and values that are no number.
NUMBERS = (0, 1, -1, 2, 3, 4, 255, 65535, 2**31 - 1, 2**31, 2**32, 2**53, 10**15, -(2**31), 0.5, 1e-30, 1e-45, 1e30, 1e39, 1e300,
           -1e300, float("nan"), float("inf"), float("-inf"), 5120, 5121, 5123, 5125, 5126)  # fmt: skip
OTHERS = (
    None,
    True,
    False,
    "",
    "1",
    "SCALAR",
    "VEC3",
    "../../etc/hostname",
    "data:;base64,AAAA",
    [],
    [0],
    [1e300] * 16,
    {},
    "\0",
)
SINGLES = (np.nan, np.inf, -np.inf, 3e38, -3e38, 1e-40, 1e20, 0.0)


@dataclass(frozen=True)
class Mutant:
    """A changed file: its source, its ending, its bytes, and the changes."""

    source: str
    suffix: str
    data: bytes
    changes: tuple[str, ...]


def sources(models: Path | None) -> dict[str, bytes]:
    """Files to change, by name: two that are made here, and all small ones of the models folder, if there is one."""
    found = {"made_box.glb": pack(*box_document()), "made_plane.glb": pack(*box_document(plane=True))}
    if models is None or not models.is_dir():
        return found
    paths = [models / name for name in BESIDE_HOSTILE] + sorted((models / "hostile").iterdir())
    for path in paths:
        if path.suffix.lower() in (".glb", ".obj", ".ply", ".stl", ".off") and 0 < path.stat().st_size <= LARGEST:
            found[path.name] = path.read_bytes()
    return found


def refused(files: dict[str, bytes]) -> frozenset[str]:
    """Names of the files that cannot be rendered even unchanged."""
    names = set()
    with tempfile.TemporaryDirectory() as folder, warnings.catch_warnings():
        warnings.simplefilter("ignore", gs.GlshadowWarning)
        for name, data in files.items():
            path = Path(folder, name)
            path.write_bytes(data)
            try:
                gs.load(path)
            except gs.SceneError:
                names.add(name)
    return frozenset(names)


def mutant(rng: Rng, files: dict[str, bytes], refused: Collection[str] = ()) -> Mutant:
    """One of the files, changed in one to three ways; seven of eight are GLB, and few of those that are `refused` unchanged."""
    name, wanted = "", rng.random() < 0.125
    while (
        not name
        or (not name.endswith(".glb")) != (wanted and len(files) > 2)
        or (name in refused and rng.random() < 0.9)
    ):
        name = str(rng.choice(list(files)))
    data, changes = files[name], []
    for _ in range(int(rng.choice([1, 2, 3], p=[0.7, 0.2, 0.1]))):
        parts = unpack(data) if name.endswith(".glb") else None
        if name.endswith(".glb"):
            data, change = _change_glb(rng, data, parts)
        elif data[:1].isascii() and b"\0" not in data[:400]:
            data, change = _change_text(rng, data)
        else:
            data, change = _change_bytes(rng, data, 0)
        changes.append(change)
        if not data:
            break
    return Mutant(name, Path(name).suffix, data, tuple(changes))


# --- GLB as its two chunks


def pack(document: Any, binary: bytes) -> bytes:
    """A GLB file of a document and its binary chunk."""
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    binary += bytes(-len(binary) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(binary), b"BIN\0") + binary
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def unpack(data: bytes) -> tuple[Any, bytes] | None:
    """Document and binary chunk; None if it is no longer a GLB."""
    try:
        (length,) = struct.unpack_from("<I", data, 12)
        return json.loads(data[20 : 20 + length]), data[28 + length :]
    except (ValueError, struct.error, RecursionError):
        return None


def _change_glb(rng: Rng, data: bytes, parts: tuple[Any, bytes] | None) -> tuple[bytes, str]:
    way = rng.random()
    if parts is not None and way < 0.45:
        document, binary = parts
        change = _change_json(rng, document)
        return pack(document, binary), change
    if parts is not None and parts[1] and way < 0.92:
        return _change_bytes(rng, data, len(data) - len(parts[1]))
    if way < 0.97 and len(data) > 24:
        at, value = (
            int(rng.choice([0, 4, 8, 12, 16])),
            int(rng.choice([0, 1, 2**31, 2**32 - 1, len(data), rng.integers(2**16)])),
        )
        return data[:at] + struct.pack("<I", value) + data[at + 4 :], f"header word {at} = {value}"
    end = int(rng.integers(0, len(data)))
    return data[:end], f"cut at byte {end} of {len(data)}"


def _places(value: Any, path: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    """Paths of all values inside a document, containers too."""
    found: list[tuple[Any, ...]] = [path] if path else []
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, item in items:
        found += _places(item, (*path, key))
    return found


def _change_json(rng: Rng, document: Any) -> str:
    if not isinstance(document, dict | list):
        return "nothing"
    places = _places(document)
    if not places:
        return "nothing"
    # prefer a number to a whole branch
    path = max((places[int(rng.integers(len(places)))] for _ in range(2)), key=len)
    holder = document
    for key in path[:-1]:
        holder = holder[key]
    key, old = path[-1], holder[path[-1]]
    name = ".".join(map(str, path))
    way = rng.random()
    if way < 0.15:
        del holder[key]
        return f"{name} deleted"
    if way < 0.25 and isinstance(holder, list):
        holder.insert(key, old)
        return f"{name} doubled"
    if way < 0.35:
        other = places[int(rng.integers(len(places)))]
        value: Any = document
        for step in other:
            value = (
                value[step]
                if isinstance(value, dict | list) and (isinstance(value, dict) or isinstance(step, int))
                else None
            )
        holder[key] = json.loads(json.dumps(value))
        return f"{name} = that of {'.'.join(map(str, other))}"
    if isinstance(old, int | float) and not isinstance(old, bool) and way < 0.85:
        near = [old + 1, old - 1, old * 2, -old, old * float(10.0 ** rng.uniform(-20, 20)), old * 0.9, old * 1.1]
        value = near[int(rng.integers(7))] if rng.random() < 0.7 else NUMBERS[int(rng.integers(len(NUMBERS)))]
    else:
        value = (
            OTHERS[int(rng.integers(len(OTHERS)))] if rng.random() < 0.5 else NUMBERS[int(rng.integers(len(NUMBERS)))]
        )
    holder[key] = value
    return f"{name} = {value!r}"


def _change_bytes(rng: Rng, data: bytes, start: int) -> tuple[bytes, str]:
    changed = bytearray(data)
    remaining = len(data) - start
    count = int(rng.integers(1, 9))
    way = rng.random()
    if way < 0.4 and remaining >= 4:
        for _ in range(count):
            at = start + 4 * int(rng.integers(remaining // 4))
            (old,) = struct.unpack_from("<f", changed, at)
            value = old * float(rng.normal()) if abs(old) < 1e30 else 1.0
            if rng.random() < 0.15:
                value = float(SINGLES[int(rng.integers(len(SINGLES)))])
            struct.pack_into("<f", changed, at, value)
        return bytes(changed), f"{count} float32 from byte {start} on"
    if way < 0.6 and remaining >= 4:
        at = start + int(rng.integers(remaining))
        length = min(int(rng.integers(1, 4096)), len(data) - at)
        changed[at : at + length] = bytes([int(rng.choice([0, 127, 255]))]) * length
        return bytes(changed), f"{length} bytes at {at} all alike"
    if way < 0.7:
        end = start + int(rng.integers(remaining))
        return bytes(changed[:end]), f"cut at byte {end} of {len(data)}"
    for _ in range(count):
        changed[start + int(rng.integers(remaining))] = int(rng.integers(256))
    return bytes(changed), f"{count} bytes from byte {start} on"


def _change_text(rng: Rng, data: bytes) -> tuple[bytes, str]:
    lines = data.split(b"\n")
    row = int(rng.integers(len(lines)))
    words = lines[row].split()
    way = rng.random()
    if words and way < 0.6:
        at = int(rng.integers(len(words)))
        value = (
            NUMBERS[int(rng.integers(len(NUMBERS)))] if rng.random() < 0.8 else OTHERS[int(rng.integers(len(OTHERS)))]
        )
        words[at] = str(value).encode()
        lines[row] = b" ".join(words)
        return b"\n".join(lines), f"line {row + 1} word {at + 1} = {value!r}"
    if way < 0.75:
        del lines[row]
        return b"\n".join(lines), f"line {row + 1} deleted"
    if way < 0.85:
        lines.insert(row, lines[int(rng.integers(len(lines)))])
        return b"\n".join(lines), f"a line copied to {row + 1}"
    return _change_bytes(rng, data, 0)


# --- a small file that uses most of the format


def _png(rows: int, columns: int) -> bytes:
    """RGBA checker: a texture whose alpha matters."""
    cells = (np.indices((rows, columns)).sum(axis=0) % 2 * 255).astype(np.uint8)
    pixels = np.stack([cells, 255 - cells, cells, cells], axis=-1)
    raw = b"".join(b"\0" + row.tobytes() for row in pixels)

    def chunk(kind: bytes, body: bytes) -> bytes:
        return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))

    header = chunk(b"IHDR", struct.pack(">IIBBBBB", columns, rows, 8, 6, 0, 0, 0))
    return b"\x89PNG\r\n\x1a\n" + header + chunk(b"IDAT", zlib.compress(raw)) + chunk(b"IEND", b"")


def box_document(plane: bool = False) -> tuple[dict[str, Any], bytes]:
    """A textured, alpha-masked box over a floor, with camera, three lights, instances; `plane`: no indices and nothing optional."""
    corners = np.array([[i, j, k] for i in (0, 1) for j in (0, 1) for k in (0, 1)], dtype="<f4") - np.float32(0.5)
    words = ("130", "410", "032", "240", "173", "514", "571", "372", "642", "276", "654", "756")
    faces = np.array([[int(digit) for digit in word] for word in words], dtype="<u2")
    floor = np.array([[-3, -1, 3], [3, -1, 3], [3, -1, -3], [-3, -1, 3], [3, -1, -3], [-3, -1, -3]], dtype="<f4")
    blocks: list[bytes] = [floor.tobytes()]
    if not plane:
        blocks += [corners.tobytes(), faces.tobytes(), (corners / np.linalg.norm(corners, axis=1)[:, None]).tobytes(),
                   (corners[:, :2] + np.float32(0.5)).tobytes(), _png(4, 4)]  # fmt: skip
    views, start = [], 0
    for block in blocks:
        views.append({"buffer": 0, "byteOffset": start, "byteLength": len(block)})
        start += len(block) + -len(block) % 4
    binary = b"".join(block + bytes(-len(block) % 4) for block in blocks)
    document: dict[str, Any] = {
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 6, "type": "VEC3"}],
        "bufferViews": views, "buffers": [{"byteLength": len(binary)}],
    }  # fmt: skip
    if plane:
        return document, binary
    document["accessors"] += [
        {"bufferView": 1, "componentType": 5126, "count": 8, "type": "VEC3", "min": [-0.5] * 3, "max": [0.5] * 3},
        {"bufferView": 2, "componentType": 5123, "count": 36, "type": "SCALAR"},
        {"bufferView": 3, "componentType": 5126, "count": 8, "type": "VEC3"},
        {"bufferView": 4, "componentType": 5126, "count": 8, "type": "VEC2"},
    ]
    attributes = {"POSITION": 1, "NORMAL": 3, "TEXCOORD_0": 4}
    document["meshes"].append({"primitives": [{"attributes": attributes, "indices": 2, "material": 0, "mode": 4}]})
    document["materials"] = [{"alphaMode": "MASK", "alphaCutoff": 0.4, "doubleSided": True, "pbrMetallicRoughness": {
        "baseColorFactor": [0.9, 0.8, 0.7, 1.0], "baseColorTexture": {"index": 0, "texCoord": 0}}}]  # fmt: skip
    document["textures"] = [{"source": 0, "sampler": 0}]
    document["images"] = [{"bufferView": 5, "mimeType": "image/png"}]
    document["samplers"] = [{"wrapS": 10497, "wrapT": 33071}]
    document["cameras"] = [
        {"type": "perspective", "perspective": {"yfov": 0.8, "znear": 0.1, "zfar": 100.0, "aspectRatio": 1.5}}
    ]
    document["extensionsUsed"] = ["KHR_lights_punctual"]
    kinds: list[dict[str, Any]] = [{"type": "directional"}, {"type": "point", "range": 20.0, "intensity": 30.0}]
    kinds.append({"type": "spot", "intensity": 40.0, "spot": {"innerConeAngle": 0.2, "outerConeAngle": 0.6}})
    document["extensions"] = {"KHR_lights_punctual": {"lights": kinds}}
    document["scenes"] = [{"nodes": [0, 1, 3, 4, 5, 6]}]
    down = [-0.7071068, 0.0, 0.0, 0.7071068]
    document["nodes"] += [
        {"mesh": 1, "children": [2], "rotation": [0.0, 0.3826834, 0.0, 0.9238795]},
        {"mesh": 1, "translation": [1.5, 0.0, 0.0], "scale": [0.5, -0.5, 0.5]},
        {"camera": 0, "translation": [0.0, 0.5, 5.0]},
        *(
            {"extensions": {"KHR_lights_punctual": {"light": i}}, "translation": [0.5, 3.0, 0.5], "rotation": down}
            for i in range(3)
        ),
    ]
    return document, binary
