"""Writes triangles with baked values into a .glb file."""

from __future__ import annotations

import io
import json
import struct
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshadow.core.spaces import Array, translation
from glshadow.scene.mesh import Mesh
from glshadow.scene.nodes import Node

_FLOAT, _UINT = 5126, 5125  # component types
_VERTICES, _INDICES = 34962, 34963  # targets
_COLUMNS = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4"}
_MAGIC, _VERSION, _JSON, _BINARY = 0x46546C67, 2, 0x4E4F534A, 0x004E4942


class _File:
    """A document and its buffer."""

    def __init__(self) -> None:
        self.json: dict[str, Any] = {
            "asset": {"version": "2.0", "generator": "glshadow"},
            "scene": 0,
            "scenes": [{"nodes": []}],
            **{each: [] for each in ("nodes", "meshes", "materials", "accessors", "bufferViews")},
        }
        self._parts: list[bytes] = []
        self._size = 0

    def view(self, data: bytes, target: int | None = None) -> int:
        """Number of a new buffer view."""
        described = {"buffer": 0, "byteOffset": self._size, "byteLength": len(data)}
        self.json["bufferViews"].append(described if target is None else {**described, "target": target})
        self._parts.append(data + bytes(-len(data) % 4))
        self._size += len(self._parts[-1])
        return len(self.json["bufferViews"]) - 1

    def accessor(self, values: NDArray[Any], target: int, bounds: bool = False) -> int:
        """Number of a new accessor over an array (N, columns)."""
        kind = _UINT if values.dtype == np.uint32 else _FLOAT
        described: dict[str, Any] = {"bufferView": self.view(np.ascontiguousarray(values).tobytes(), target), "componentType": kind,
                                     "count": len(values), "type": _COLUMNS[values.shape[1]]}  # fmt: skip
        if bounds:
            described |= {"min": values.min(axis=0).tolist(), "max": values.max(axis=0).tolist()}
        self.json["accessors"].append(described)
        return len(self.json["accessors"]) - 1

    def bytes(self) -> bytes:
        """The whole file."""
        self.json["buffers"] = [{"byteLength": self._size}]
        text = json.dumps(self.json, separators=(",", ":")).encode()
        text += b" " * (-len(text) % 4)
        size = 12 + 8 + len(text) + 8 + self._size
        head = struct.pack("<IIIII", _MAGIC, _VERSION, size, len(text), _JSON)
        return head + text + struct.pack("<II", self._size, _BINARY) + b"".join(self._parts)


def written(nodes: Sequence[Node], values: Sequence[NDArray[np.float32]], to: str, uv_set: int) -> bytes:
    """A .glb file of nodes with values of their faces (T,), vertices (V,) or texels (H, W)."""
    file = _File()
    for node, own in zip(nodes, values, strict=True):
        number = len(file.json["nodes"])
        attributes, indices, centre = _attributes(file, node.mesh, own, to, uv_set)
        material = _material(file, node.mesh, own if to == "texels" else None)
        primitive = {"attributes": attributes, "indices": indices, "material": material}
        file.json["meshes"].append({"name": node.name, "primitives": [primitive]})
        matrix = node.world_from_mesh @ translation(centre)
        described = {"name": node.name, "mesh": number, "matrix": matrix.T.ravel().tolist()}
        file.json["nodes"].append(described)
        file.json["scenes"][0]["nodes"].append(number)
    return file.bytes()


def _attributes(
    file: _File, mesh: Mesh, own: NDArray[np.float32], to: str, uv_set: int
) -> tuple[dict[str, int], int, Array]:
    """Accessors of the attributes and of the indices, and the point (3,) to which positions are relative, for float32."""
    rows = mesh.triangles.ravel() if to == "faces" else np.arange(len(mesh.positions))
    triangles = np.arange(len(rows)) if to == "faces" else mesh.triangles.ravel()
    centre = mesh.bounds.mean(axis=0)
    # unused vertices may lie anywhere
    positions = np.clip(mesh.positions[rows], *mesh.bounds) - centre
    attributes = {"POSITION": file.accessor(positions.astype(np.float32), _VERTICES, bounds=True)}
    if mesh.normals is not None and to != "faces":
        length = np.linalg.norm(mesh.normals, axis=1, keepdims=True)
        normals = np.where(length > 0.0, mesh.normals / np.where(length > 0.0, length, 1.0), (0.0, 0.0, 1.0))
        attributes["NORMAL"] = file.accessor(normals.astype(np.float32), _VERTICES)
    uv = mesh.second_uv if uv_set else mesh.uv
    if uv is not None:
        attributes["TEXCOORD_0"] = file.accessor((uv[rows] * (1.0, -1.0) + (0.0, 1.0)).astype(np.float32), _VERTICES)
    if to != "texels":
        shown = np.nan_to_num(np.repeat(own, 3) if to == "faces" else own, nan=0.0)
        colors = np.ones((len(rows), 4), dtype=np.float32) if mesh.colors is None else mesh.colors[rows].copy()
        colors[:, :3] *= shown[:, None]
        attributes["COLOR_0"] = file.accessor(colors, _VERTICES)
    return attributes, file.accessor(triangles.astype(np.uint32)[:, None], _INDICES), centre


def _material(file: _File, mesh: Mesh, image: NDArray[np.float32] | None) -> int:
    material = mesh.material
    described: dict[str, Any] = {
        "pbrMetallicRoughness": {
            "baseColorFactor": [float(each) for each in material.color], "metallicFactor": 0.0, "roughnessFactor": 1.0,
        },
        "doubleSided": not material.cull_back_faces,
        "alphaMode": "OPAQUE" if material.texture is not None else material.alpha_mode.value,
    }  # fmt: skip
    if image is not None:
        from PIL import Image

        pixels, packed = np.rint(255.0 * np.nan_to_num(image, nan=1.0)).astype(np.uint8), io.BytesIO()
        Image.fromarray(np.repeat(pixels[..., None], 3, axis=2)).save(packed, "PNG")
        images = file.json.setdefault("images", [])
        images.append({"bufferView": file.view(packed.getvalue()), "mimeType": "image/png"})
        file.json.setdefault("textures", []).append({"source": len(images) - 1})
        described["occlusionTexture"] = {"index": len(images) - 1}
    file.json["materials"].append(described)
    return len(file.json["materials"]) - 1
