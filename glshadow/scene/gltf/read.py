"""A glTF file as placed meshes, camera and lights."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np

from glshadow.core.cameras import Camera, OrthographicCamera, PerspectiveCamera
from glshadow.core.lights import DirectionalLight, Light, PointLight, SpotLight
from glshadow.core.setting import as_float, shown
from glshadow.core.spaces import Array
from glshadow.errors import SceneError
from glshadow.scene.gltf.document import Document, as_object, extensions, open_document
from glshadow.scene.gltf.graph import instances, placed_nodes
from glshadow.scene.gltf.material import Surfaces
from glshadow.scene.gltf.primitive import build, is_surface, skipped
from glshadow.scene.imported import WIDEST_CONE, Imported, blended
from glshadow.scene.mesh import Mesh, Node

Named = tuple[str, int, dict[str, Any], Array]


def read_gltf(path: Path) -> Imported:
    """Read a .glb or .gltf file.

    Nodes with several materials become several Nodes of one name; nodes of one mesh share its Mesh objects. A camera's
    znear and zfar are left out: they are derived from the scene, so that nothing is cut away. Of an orthographic one
    counts ymag, as of a perspective one yfov: what is seen to the sides follows from the picture's size.

    Raises
    ------
    SceneError
        If it is broken, or needs what cannot be honoured.
    """
    document = open_document(path)
    found = Imported(notes=document.notes)
    named = _named(document)
    lost: Counter[str] = Counter()
    meshes: dict[int, list[Mesh]] = {}
    surfaces = Surfaces(document)
    for name, index, node, matrix in named:
        if "mesh" not in node:
            continue
        number = node["mesh"]
        given = document.item("meshes", number, f"node {name!r}")
        if number not in meshes:
            meshes[number] = _meshes(document, surfaces, given, number, lost)
        lost["skins"] += "skin" in node
        placements = instances(document, node, index, matrix)
        for copy, placement in enumerate(placements):
            title = name if len(placements) == 1 else f"{name}[{copy}]"
            found.nodes += [Node(title, mesh, placement) for mesh in meshes[number]]
    found.camera = _camera(document, named)
    found.lights = _lights(document, named) or None
    _note(document, lost)
    found.notes += blended(found.nodes)
    if not found.nodes:
        raise SceneError(f"nothing to render: {_why_empty(document, named, lost)}")
    return found


def _why_empty(document: Document, named: list[Named], lost: Counter[str]) -> str:
    if lost["points or lines"]:
        return "it holds only points or lines, and no triangles"
    if not named:
        return "its scene has no nodes" if document.items("scenes") else "it has no scene"
    return "no node of its scene has a mesh with triangles"


def _named(document: Document) -> list[Named]:
    """(unique name, index, node, world_from_node): glTF lets nodes share a name or have none."""
    result, seen = [], set()
    for index, node, matrix in placed_nodes(document):
        name = str(node.get("name") or f"node{index}")
        if name in seen:
            name = f"{name}.{index}"
        seen.add(name)
        result.append((name, index, node, matrix))
    return result


def _meshes(document: Document, surfaces: Surfaces, mesh: dict[str, Any], index: int, lost: Counter[str]) -> list[Mesh]:
    title = f"mesh {mesh['name']!r}" if mesh.get("name") else f"meshes[{index}]"
    made = []
    for number, primitive in enumerate(mesh.get("primitives", [])):
        where = f"{title} primitive {number}"
        lost.update(skipped(as_object(primitive, where)))
        if is_surface(primitive):
            made.append(build(document, surfaces, primitive, where))
    return made


def _note(document: Document, lost: Counter[str]) -> None:
    if lost["skins"]:
        document.notes.append(
            f"{lost['skins']} skinned node(s) drawn in their bind pose: skins and animations are not applied"
        )
    if lost["morph targets"]:
        document.notes.append(f"{lost['morph targets']} primitive(s) drawn without their morph targets")
    if lost["points or lines"]:
        document.notes.append(
            f"{lost['points or lines']} primitive(s) of points or lines left out: only triangles are drawn"
        )
    centre = extensions(document.json).get("CESIUM_RTC")
    if centre is not None:
        document.notes.append(
            f"its CESIUM_RTC centre {as_object(centre, 'CESIUM_RTC').get('center')} is left out: drawn about its own "
            "origin"
        )


def _camera(document: Document, named: list[Named]) -> Camera | None:
    """The first camera of a kind that glTF knows which the scene places."""
    for name, _, node, matrix in named:
        if "camera" not in node:
            continue
        camera = document.item("cameras", node["camera"], f"node {name!r}")
        kind = camera.get("type")
        lens = as_object(camera.get(str(kind), {}), f"node {name!r}: its camera")
        if kind == "perspective":
            return PerspectiveCamera.from_pose(matrix, float(np.degrees(_size(lens, "yfov", name))))
        if kind == "orthographic":
            return OrthographicCamera.from_pose(matrix, 2.0 * _size(lens, "ymag", name))
        document.notes.append(f"camera {name!r} is {kind}, which is not modelled: left out")
    return None


def _size(lens: dict[str, Any], key: str, name: str) -> float:
    """A camera's number that has to be there, and must not be 0; glTF discourages negative ones, which mean the same."""
    value = abs(as_float(lens.get(key)))
    if not 0.0 < value < np.inf:
        raise SceneError(
            f"node {name!r}: {key} of its camera must be a number other than 0, got {shown(lens.get(key))}"
        )
    return value


def _lights(document: Document, named: list[Named]) -> list[Light]:
    given = as_object(extensions(document.json).get("KHR_lights_punctual", {}), "KHR_lights_punctual").get("lights", [])
    lights = []
    for name, _, node, matrix in named:
        placed = extensions(node).get("KHR_lights_punctual")
        if placed is None:
            continue
        index = as_object(placed, f"node {name!r}").get("light")
        if not isinstance(index, int) or not 0 <= index < len(given):
            raise SceneError(f"node {name!r} refers to light {index!r}, but the file has {len(given)} lights")
        lights.append(_light(document, as_object(given[index], f"light {index}"), matrix, name))
    return lights


def _light(document: Document, light: dict[str, Any], matrix: Array, name: str) -> Light:
    """KHR_lights_punctual: shines along -z; candela for spot and point (hence falloff 2), lux for directional."""
    color, intensity = tuple(float(x) for x in light.get("color", (1.0, 1.0, 1.0))), float(light.get("intensity", 1.0))
    position, direction = tuple(matrix[:3, 3].tolist()), tuple((-matrix[:3, 2]).tolist())
    reach = None if light.get("range") is None else float(light["range"])
    kind = light.get("type")
    if kind == "directional":
        return DirectionalLight(direction=direction, color=color, intensity=intensity)  # type: ignore[arg-type]
    if kind == "point":
        return PointLight(position=position, color=color, intensity=intensity, range=reach, falloff=2.0)  # type: ignore[arg-type]
    if kind != "spot":
        raise SceneError(f"light {name!r} must be directional, point or spot, got {kind!r}")
    cone = as_object(light.get("spot", {}), f"light {name!r}")
    inner, outer = (
        float(np.degrees(cone.get(key, rad))) for key, rad in (("innerConeAngle", 0.0), ("outerConeAngle", np.pi / 4))
    )
    if outer > WIDEST_CONE:
        document.notes.append(f"spot light {name!r} opens {outer:g} degrees from its axis: narrowed to {WIDEST_CONE:g}")
        inner, outer = min(inner, WIDEST_CONE), WIDEST_CONE
    return SpotLight(
        position=position,
        direction=direction,
        color=color,  # type: ignore[arg-type]
        intensity=intensity,
        inner_angle=inner,
        outer_angle=outer,
        range=reach,
        falloff=2.0,
    )
