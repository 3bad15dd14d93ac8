"""Indices of glTF primitives as triangles; what is broken among them is left out with a note."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshadow.errors import SceneError
from glshadow.io.gltf.accessor import read_whole
from glshadow.io.gltf.document import Document

TRIANGLES, STRIP, FAN = 4, 5, 6


def is_surface(primitive: dict[str, Any]) -> bool:
    """Whether it consists of triangles rather than points or lines."""
    return primitive.get("mode", TRIANGLES) in (TRIANGLES, STRIP, FAN)


def triangles_of(document: Document, primitive: dict[str, Any], vertices: int, where: str) -> NDArray[np.int64]:
    """Triangles (T, 3) whose vertices exist; notes how many others there are."""
    mode = primitive.get("mode", TRIANGLES)
    if "indices" in primitive:
        indices = read_whole(document, primitive["indices"], ("SCALAR",), f"{where}.indices")[:, 0]
    else:
        document.budget.take(8 * vertices, where)
        indices = np.arange(vertices)
    if mode == TRIANGLES:
        rest = len(indices) % 3
        if 0 < rest < len(indices):
            document.notes.append(
                f"{where}: {len(indices)} indices are not a multiple of 3, as triangles need: the last {rest} left out"
            )
        triangles = indices[: len(indices) - rest].reshape(-1, 3)
    else:
        document.budget.take(24 * len(indices), where)
        triangles = _strip(indices, fan=mode == FAN)
    if len(triangles) == 0:
        raise SceneError(f"{where}: {len(indices)} indices are too few for a triangle")
    beyond = triangles >= vertices
    if not beyond.any():
        return triangles
    message = (
        f"{where}: index {triangles.max()} is out of range, it has {vertices} vertices "
        f"({int((indices >= vertices).sum())} of {len(indices)} indices are)"
    )
    return without(document, triangles, np.asarray(beyond.any(axis=1)), message)


def _strip(indices: NDArray[np.int64], fan: bool) -> NDArray[np.int64]:
    if len(indices) < 3:
        return np.zeros((0, 3), dtype=np.int64)
    if fan:
        return np.stack([indices[1:-1], indices[2:], np.full(len(indices) - 2, indices[0])], axis=1)
    strip = np.stack([indices[:-2], indices[1:-1], indices[2:]], axis=1)
    strip[1::2] = strip[1::2][:, [0, 2, 1]]  # every second triangle of a strip is wound the other way
    return strip


def without(
    document: Document, triangles: NDArray[np.int64], broken: NDArray[np.bool_], message: str
) -> NDArray[np.int64]:
    """Triangles that are not broken, with a note; an error if there are none."""
    if broken.all():
        raise SceneError(message)
    document.notes.append(f"{message}: {int(broken.sum())} of {len(triangles)} triangles left out")
    return triangles[~broken]
