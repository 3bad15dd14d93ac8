"""One primitive of a glTF mesh as a Mesh."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshadow.core.spaces import Array
from glshadow.errors import SceneError
from glshadow.scene.gltf.accessor import read_floats, read_indices
from glshadow.scene.gltf.document import Document, as_object
from glshadow.scene.gltf.draco import decoded
from glshadow.scene.gltf.material import Surfaces, texture_uv
from glshadow.scene.imported import linear_colors, tinted, usable_normals, used_only
from glshadow.scene.mesh import Mesh

TRIANGLES, STRIP, FAN = 4, 5, 6


def is_surface(primitive: dict[str, Any]) -> bool:
    """Whether it is made of triangles rather than of points or lines."""
    return primitive.get("mode", TRIANGLES) in (TRIANGLES, STRIP, FAN)


def build(document: Document, surfaces: Surfaces, primitive: dict[str, Any], where: str) -> Mesh:
    """The triangles of a primitive.

    Raises
    ------
    SceneError
        If an accessor cannot be read, POSITION is missing, an index is out of range or a coordinate is not finite.
    """
    primitive = decoded(document, primitive, where)
    attributes = as_object(primitive.get("attributes", {}), f"{where}.attributes")
    if "POSITION" not in attributes:
        raise SceneError(f"{where} has no POSITION: there is nothing to draw")
    positions = read_floats(document, attributes["POSITION"], ("VEC3",), f"{where}.POSITION")
    _check_declared(document, attributes["POSITION"], positions, where)
    triangles = _triangles(document, primitive, len(positions), where)
    normals = _attribute(document, attributes, "NORMAL", ("VEC3",), len(positions), where)
    surface = surfaces.get(primitive.get("material"), where)
    linear = _colors(document, attributes, len(positions), where)
    clear = linear is not None and bool((linear[:, 3] < 1.0).any())
    material, uv = surface.given if clear else surface.material, None
    if material.texture is not None:
        stored = _attribute(document, attributes, f"TEXCOORD_{surface.uv_set}", ("VEC2",), len(positions), where)
        uv = None if stored is None else texture_uv(stored, surface.uv_transform)
        if uv is None or not np.isfinite(uv).all():
            uv = None
            document.notes.append(f"{where} has a texture but no usable TEXCOORD_{surface.uv_set}: drawn without it")
            material = replace(material, texture=None)
    material, colors = tinted(material, linear)
    positions, triangles, (kept_normals, uv, colors) = used_only(
        positions, triangles, usable_normals(positions, triangles, normals), uv, colors
    )
    try:
        return Mesh(positions, triangles.astype(np.int32), kept_normals, uv, colors, material)
    except SceneError as error:
        raise SceneError(f"{where}: {error}; repair or remove them") from error


def _attribute(
    document: Document, attributes: dict[str, Any], name: str, types: tuple[str, ...], length: int, where: str
) -> Array | None:
    if name not in attributes:
        return None
    values = read_floats(document, attributes[name], types, f"{where}.{name}")
    if len(values) != length:
        raise SceneError(f"{where}.{name} has {len(values)} elements, POSITION has {length}")
    return values


def _check_declared(document: Document, accessor: int, positions: Array, where: str) -> None:
    """Note coordinates far outside the accessor's own min and max: the sign of bytes read from a wrong place."""
    given = document.item("accessors", accessor, where)
    try:
        low, high = (np.asarray(given[key], dtype=np.float64) for key in ("min", "max"))
    except (KeyError, TypeError, ValueError):
        return
    if (
        low.shape != (3,)
        or high.shape != (3,)
        or given.get("normalized")
        or not np.isfinite([*low, *high]).all()
        or not np.isfinite(positions).all()
    ):
        return
    slack = 1e-3 * float(np.abs([low, high]).max()) + float((high - low).max())
    outside = int(((positions < low - slack) | (positions > high + slack)).any(axis=1).sum())
    if outside:
        document.notes.append(
            f"{where}: {outside} of {len(positions)} vertices lie far outside the range {low.tolist()} to "
            f"{high.tolist()} that the file declares"
        )


def _triangles(document: Document, primitive: dict[str, Any], vertices: int, where: str) -> NDArray[np.int64]:
    mode = primitive.get("mode", TRIANGLES)
    if "indices" in primitive:
        indices = read_indices(document, primitive["indices"], f"{where}.indices")
        if indices.max() >= vertices:
            raise SceneError(
                f"{where}: index {indices.max()} is out of range, it has {vertices} vertices "
                f"({int((indices >= vertices).sum())} of {len(indices)} indices are)"
            )
    else:
        indices = np.arange(vertices)
    if mode == TRIANGLES:
        if len(indices) % 3:
            raise SceneError(f"{where}: {len(indices)} indices are not a multiple of 3, as triangles need")
        return indices.reshape(-1, 3)
    if len(indices) < 3:
        raise SceneError(f"{where}: a strip or fan needs 3 indices, got {len(indices)}")
    if mode == FAN:
        return np.stack([indices[1:-1], indices[2:], np.full(len(indices) - 2, indices[0])], axis=1)
    strip = np.stack([indices[:-2], indices[1:-1], indices[2:]], axis=1)
    strip[1::2] = strip[1::2][:, [0, 2, 1]]  # every second triangle of a strip is wound the other way
    return strip


def _colors(document: Document, attributes: dict[str, Any], length: int, where: str) -> Array | None:
    """COLOR_0 (V, 4), linear; integers are normalised even where the file forgets to say so."""
    if "COLOR_0" in attributes:
        document.item("accessors", attributes["COLOR_0"], where)["normalized"] = True
    colors = _attribute(document, attributes, "COLOR_0", ("VEC3", "VEC4"), length, where)
    return None if colors is None else linear_colors(colors, f"{where}.COLOR_0", document.notes)


def skipped(primitive: dict[str, Any]) -> list[str]:
    """What of a primitive is not drawn."""
    parts = ["morph targets"] if primitive.get("targets") else []
    return parts if is_surface(primitive) else ["points or lines"]
