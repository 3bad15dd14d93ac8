"""Accessors: typed, strided, sparse and normalised arrays of a glTF file; only rows that are used are converted."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshadow.core.spaces import Array
from glshadow.errors import SceneError
from glshadow.io.gltf.document import Document, as_object, count

COMPONENTS = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
COLUMNS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}
Rows = NDArray[np.int64] | slice
EVERY = slice(None)


def read_accessor(document: Document, index: Any, types: tuple[str, ...], user: str) -> tuple[NDArray[Any], bool]:
    """Stored values.

    Parameters
    ----------
    types : tuple of str
        Allowed accessor types, such as ("VEC3",).
    user : str
        What refers to it, for messages.

    Returns
    -------
    (count, columns) array, bool
        In the file's component type, with sparse elements applied, read-only; whether integers are normalised.

    Raises
    ------
    SceneError
        If it has another type, extends beyond its buffer view, or is longer than the file allows.
    """
    where = f"{user}: accessors[{index}]"
    accessor = document.item("accessors", index, user)
    kind, component = accessor.get("type"), accessor.get("componentType")
    if not isinstance(kind, str) or not isinstance(component, int) or kind not in types or component not in COMPONENTS:
        raise SceneError(
            f"{where} must be {' or '.join(types)} of a known component type, got {kind!r} of {component!r}"
        )
    dtype = np.dtype(COMPONENTS[component])
    normalized = bool(accessor.get("normalized", False)) and dtype.kind != "f"
    if index not in document.arrays:
        document.arrays[index] = _stored(document, accessor, dtype, COLUMNS[kind], where)
    return document.arrays[index], normalized


def _stored(
    document: Document, accessor: dict[str, Any], dtype: np.dtype[Any], columns: int, where: str
) -> NDArray[Any]:
    length = count(accessor, "count", where, least=1)
    offset = count(accessor, "byteOffset", where, default=0)
    if "bufferView" not in accessor or "sparse" in accessor:  # otherwise it is a view of the file's bytes
        document.budget.take(length * columns * dtype.itemsize, where)
    if "bufferView" in accessor:
        values = _strided(document, accessor["bufferView"], offset, length, dtype, columns, where)
    else:
        values = np.zeros((length, columns), dtype)
    if "sparse" in accessor:
        values = _sparse(document, as_object(accessor["sparse"], where), values, where)
    return values


def _strided(
    document: Document, view: Any, offset: int, length: int, dtype: np.dtype[Any], columns: int, where: str
) -> NDArray[Any]:
    data, stride = document.view(view, where)
    element = dtype.itemsize * columns
    stride = stride or element
    needed = offset + stride * (length - 1) + element
    if stride < element or needed > len(data):
        raise SceneError(
            f"{where} needs {needed} bytes ({length} elements, {stride} apart), but its buffer view has {len(data)}"
        )
    return np.ndarray((length, columns), dtype, buffer=data, offset=offset, strides=(stride, dtype.itemsize))


def _sparse(document: Document, sparse: dict[str, Any], values: NDArray[Any], where: str) -> NDArray[Any]:
    number = count(sparse, "count", f"{where}.sparse", least=1)
    places, replaced = (
        as_object(sparse.get("indices"), f"{where}.sparse.indices"),
        as_object(sparse.get("values"), f"{where}.sparse.values"),
    )
    component = places.get("componentType")
    if component not in (5121, 5123, 5125):
        raise SceneError(f"{where}: sparse indices must be unsigned integers, got component type {component!r}")
    rows = _strided(
        document,
        places.get("bufferView"),
        count(places, "byteOffset", where, default=0),
        number,
        np.dtype(COMPONENTS[component]),
        1,
        where,
    )[:, 0]
    news = _strided(
        document,
        replaced.get("bufferView"),
        count(replaced, "byteOffset", where, default=0),
        number,
        values.dtype,
        values.shape[1],
        where,
    )
    if rows.max() >= len(values):
        raise SceneError(f"{where}: sparse index {rows.max()} is out of range, it has {len(values)} elements")
    result = values.copy()
    result[rows.astype(np.int64)] = news
    return result


def read_floats(document: Document, index: Any, types: tuple[str, ...], user: str, rows: Rows = EVERY) -> Array:
    """Values (count, columns) float64 of some rows; normalised integers mapped to -1..1 or 0..1 (glTF 2.0, 3.6.2.2)."""
    stored, normalized = read_accessor(document, index, types, user)
    values = stored[rows]
    document.budget.take(8 * values.size, user)
    with np.errstate(invalid="ignore"):  # a signalling NaN: refused later, where they are counted
        floats = values.astype(np.float64)
    if not normalized:
        return floats
    return np.asarray(np.maximum(floats / np.iinfo(values.dtype).max, -1.0))


def read_whole(
    document: Document, index: Any, types: tuple[str, ...], user: str, rows: Rows = EVERY
) -> NDArray[np.int64]:
    """Unsigned integers (count, columns) of some rows."""
    stored, _ = read_accessor(document, index, types, user)
    if stored.dtype.kind != "u":
        raise SceneError(f"{user} must be unsigned integers, got {stored.dtype}")
    values = stored[rows]
    document.budget.take(8 * values.size, user)
    return values.astype(np.int64)
