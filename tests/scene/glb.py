"""A .glb file made in a test: arrays become accessors, everything else is JSON."""

from __future__ import annotations

import json
import struct
from pathlib import Path
from typing import Any

import numpy as np

COMPONENTS = {"int8": 5120, "uint8": 5121, "int16": 5122, "uint16": 5123, "uint32": 5125, "float32": 5126}
COLUMNS = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4", 16: "MAT4"}


class Glb:
    """JSON and binary chunk of a file under construction.

    Attributes
    ----------
    json : dict
        The top level; `accessors` and `bufferViews` grow with every array.
    """

    def __init__(self, **top: Any) -> None:
        self.json: dict[str, Any] = {"asset": {"version": "2.0"}, "scene": 0, "accessors": [], "bufferViews": [], **top}
        self.binary = b""

    def view(self, array: Any) -> int:
        """Number of a new buffer view that holds an array."""
        data = np.ascontiguousarray(array).tobytes()
        self.json["bufferViews"].append({"buffer": 0, "byteOffset": len(self.binary), "byteLength": len(data)})
        self.binary += data + b"\0" * (-len(data) % 4)
        return len(self.json["bufferViews"]) - 1

    def add(self, array: Any, dtype: str = "float32", **extra: Any) -> int:
        """Number of a new accessor over an array (N, columns); MAT4: (N, 4, 4), rows first as in Python."""
        values = np.asarray(array, dtype=dtype)
        values = values.transpose(0, 2, 1).reshape(-1, 16) if values.ndim == 3 else values.reshape(len(values), -1)
        described = {"bufferView": self.view(values), "componentType": COMPONENTS[dtype], "count": len(values)}
        self.json["accessors"].append({**described, "type": COLUMNS[values.shape[1]], **extra})
        return len(self.json["accessors"]) - 1

    def declare(self, count: int, kind: str = "VEC3", component: str = "float32", **extra: Any) -> int:
        """Number of a new accessor without data of its own: zeros, or sparse."""
        self.json["accessors"].append({"componentType": COMPONENTS[component], "count": count, "type": kind, **extra})
        return len(self.json["accessors"]) - 1

    def mesh(self, *primitives: dict[str, Any], **extra: Any) -> int:
        """Number of a new mesh."""
        self.json.setdefault("meshes", []).append({"primitives": list(primitives), **extra})
        return len(self.json["meshes"]) - 1

    def save(self, path: Path) -> Path:
        """Write the file; without scenes, it gets one of all nodes that are no other node's children."""
        nodes = self.json.get("nodes", [])
        below = {child for node in nodes for child in node.get("children", ())}
        document = {"scenes": [{"nodes": [k for k in range(len(nodes)) if k not in below]}], **self.json}
        if self.binary:
            document.setdefault("buffers", [{"byteLength": len(self.binary)}])
        text = json.dumps(document).encode()
        text += b" " * (-len(text) % 4)
        body = struct.pack("<II", len(text), 0x4E4F534A) + text
        if self.binary:
            body += struct.pack("<II", len(self.binary), 0x004E4942) + self.binary
        path.write_bytes(struct.pack("<4sII", b"glTF", 2, 12 + len(body)) + body)
        return path
