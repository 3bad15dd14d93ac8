"""KHR_draco_mesh_compression through DracoPy, if it is installed."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshadow.errors import SceneError
from glshadow.io.gltf.document import DRACO, Document, as_object, extensions, refused

COMPONENT_TYPES = {"int8": 5120, "uint8": 5121, "int16": 5122, "uint16": 5123, "uint32": 5125, "float32": 5126}


def decoded(document: Document, primitive: dict[str, Any], where: str) -> dict[str, Any]:
    """The primitive without compression: decoded arrays are appended to the document as buffers.

    Raises
    ------
    SceneError
        If DracoPy is not installed and the primitive has no uncompressed data, or the data is broken.
    """
    if DRACO not in extensions(primitive):
        return primitive
    given = as_object(primitive.get("attributes", {}), where)
    if "bufferView" in document.item("accessors", given.get("POSITION"), where):
        return primitive
    try:
        import DracoPy  # type: ignore[import-not-found, unused-ignore]
    except ImportError:
        raise refused(DRACO) from None
    compressed = as_object(extensions(primitive)[DRACO], where)
    data, _ = document.view(compressed.get("bufferView"), where)
    try:
        mesh = DracoPy.decode(bytes(data))
        arrays = {
            name: np.asarray(mesh.get_attribute_by_unique_id(identifier)["data"])
            for name, identifier in as_object(compressed.get("attributes", {}), where).items()
        }
        faces = np.asarray(mesh.faces, dtype=np.uint32)
    except Exception as error:  # DracoPy documents no exception types
        raise SceneError(f"{where}: its Draco data cannot be decoded ({error})") from error
    plain = {name: _append(document, array, given.get(name)) for name, array in arrays.items()}
    return {**primitive, "mode": 4, "attributes": plain, "indices": _append(document, faces.reshape(-1, 1), None)}


def _append(document: Document, values: NDArray[Any], accessor: Any) -> int:
    """Index of a new accessor over `values` (N, columns); `accessor` is the one that it replaces."""
    values = np.ascontiguousarray(values.reshape(len(values), -1))
    if values.dtype.name not in COMPONENT_TYPES:
        values = values.astype(np.float32)
    normalized = accessor is not None and document.item("accessors", accessor, DRACO).get("normalized", False)
    lists = {kind: document.json.setdefault(kind, []) for kind in ("buffers", "bufferViews", "accessors")}
    document.budget.take(values.nbytes, DRACO)
    document.buffers[len(lists["buffers"])] = memoryview(values.tobytes())
    lists["buffers"].append({"byteLength": values.nbytes})
    lists["bufferViews"].append({"buffer": len(lists["buffers"]) - 1, "byteLength": values.nbytes})
    described = {"count": len(values), "componentType": COMPONENT_TYPES[values.dtype.name], "normalized": normalized}
    kind = ("SCALAR", "VEC2", "VEC3", "VEC4")[values.shape[1] - 1]
    lists["accessors"].append({**described, "type": kind, "bufferView": len(lists["bufferViews"]) - 1})
    return len(lists["accessors"]) - 1
