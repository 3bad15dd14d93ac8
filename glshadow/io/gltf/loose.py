"""Points and lines of glTF: primitives of mode 0 to 3."""

from __future__ import annotations

import json
from typing import Any

import numpy as np

from glshadow.core.setting import shown
from glshadow.errors import SceneError
from glshadow.io.clouds import existing, lines_of, linked, points_of
from glshadow.io.gltf.accessor import read_accessor, read_whole
from glshadow.io.gltf.document import as_object
from glshadow.io.gltf.indices import TRIANGLES
from glshadow.io.gltf.morph import targets_of
from glshadow.io.gltf.primitive import _DRAWN_BYTES, Form, Primitives, _colors, _Vertices
from glshadow.io.gltf.skin import posed
from glshadow.scene.mesh import Mesh


def loose_mesh(primitives: Primitives, primitive: dict[str, Any], form: Form, where: str) -> Mesh | None:
    """The points (mode 0) or lines (1 to 3) of a primitive with their colours, of the material only the base colour; None: it has none."""
    key = ("loose", json.dumps(primitive, sort_keys=True), *form.key)
    if key not in primitives.made:
        primitives.document.budget.check_time(where)
        made = _made(primitives, primitive, form, where)
        if made is None:
            return None
        primitives.document.budget.take(_DRAWN_BYTES * made.count, where)
        primitives.made[key] = made
    return primitives.made[key]


def _made(primitives: Primitives, primitive: dict[str, Any], form: Form, where: str) -> Mesh | None:
    document, surfaces = primitives.document, primitives.surfaces
    attributes = as_object(primitive.get("attributes", {}), f"{where}.attributes")
    mode = primitive.get("mode", TRIANGLES)
    if mode not in (0, 1, 2, 3):
        raise SceneError(f"{where}: mode must be an integer from 0 to 6, got {shown(mode)}")
    if "POSITION" not in attributes:
        raise SceneError(f"{where} has no POSITION: there is nothing to draw")
    count = len(read_accessor(document, attributes["POSITION"], ("VEC3",), f"{where}.POSITION")[0])
    vertices = _Vertices(
        document, attributes, targets_of(document, primitive, form.weights, where), count, slice(None), where
    )
    positions = vertices.read("POSITION", ("VEC3",))
    assert positions is not None
    if form.joints is not None:
        followed = vertices.joints(len(form.joints), document.notes)
        if followed is not None:
            positions, _ = posed(positions, None, *followed, form.joints)
    indices = np.arange(count)
    if "indices" in primitive:
        indices = read_whole(document, primitive["indices"], ("SCALAR",), f"{where}.indices")[:, 0]
    colors, material = _colors(vertices), surfaces.get(primitive.get("material"), where).given
    if mode == 0:
        indices = existing(indices[:, None], count, f"{where}: ", "points", document.notes)[:, 0]
        own = None if colors is None else colors[indices]
        return points_of(positions[indices], own, where, document.notes, material)
    return lines_of(positions, linked(indices, mode), colors, where, document.notes, material)
