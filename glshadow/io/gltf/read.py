"""Reads a glTF file as nodes, camera and lights."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from glshadow.core.cameras import OrthographicCamera, PerspectiveCamera
from glshadow.core.setting import as_float, shown
from glshadow.core.spaces import Array
from glshadow.errors import SceneError
from glshadow.io.gltf.broken import BROKEN, named
from glshadow.io.gltf.document import Document, as_object, extensions, open_document
from glshadow.io.gltf.graph import Graph, instances
from glshadow.io.gltf.indices import is_surface
from glshadow.io.gltf.loose import loose_mesh
from glshadow.io.gltf.material import Surfaces
from glshadow.io.gltf.morph import Weights, resting_weights
from glshadow.io.gltf.movement import CameraAt, LightAt, Movement, movement
from glshadow.io.gltf.pose import Deformer
from glshadow.io.gltf.primitive import Form, Primitives, is_skinned
from glshadow.io.gltf.skin import bound
from glshadow.io.imported import WIDEST_CONE, Imported, shortened
from glshadow.io.limits import Budget
from glshadow.io.model_file import ModelFile
from glshadow.lights import DirectionalLight, Light, PointLight, SpotLight
from glshadow.scene.mesh import Mesh
from glshadow.scene.nodes import Node

_PLACED_BYTES = 20  # memory that drawing needs per triangle of a node: a plane and the index of its node
Named = tuple[str, int, dict[str, Any], Array]


def read_gltf(source: Path | ModelFile, budget: Budget) -> Imported:
    """Read a .glb or .gltf file.

    Nodes with several materials become several Nodes with the same name; nodes with the same mesh share its Mesh objects. Skins and morph
    targets are at rest: joints as placed by the file's nodes, weights as in the file; its animations are kept as the scene's motion.
    A camera's znear and zfar are ignored; the planes are derived from the scene, so that nothing is clipped. Of an orthographic camera
    ymag is used, of a perspective one yfov; the width follows from the image's size.

    Raises
    ------
    SceneError
        If it is broken, needs unsupported features, or exceeds the `budget`.
    """
    document = open_document(source, budget)
    found = Imported(notes=document.notes)
    graph = Graph(document)
    placed = _named(graph)
    moves = movement(document, graph)
    meshes = _Meshes(document, graph, moves)
    triangles = 0
    for name, index, node, matrix in placed:
        if "mesh" not in node:
            continue
        budget.check_time(f"node {name!r}")
        made, placements = meshes.of(node, index, f"node {name!r}", matrix)
        for mesh, skinned in made:
            places = np.eye(4)[None] if skinned else placements  # a skinned mesh is placed by its joints alone
            triangles += mesh.count * len(places)
            budget.limits.check("triangles", triangles, f"node {name!r}")
            budget.take(_PLACED_BYTES * mesh.count * len(places), f"node {name!r}")
            budget.limits.check("nodes", len(found.nodes) + len(places), f"node {name!r}")
            titles = [name] if len(places) == 1 else [f"{name}[{copy}]" for copy in range(len(places))]
            if moves.animations:
                kept = None if skinned else partial(instances, document, node, index, np.eye(4))
                moves.add(len(found.nodes), index, meshes.deformer(mesh), places, kept, *meshes.posed_by(node, mesh))
            found.nodes += [Node(mesh, place, title) for title, place in zip(titles, places, strict=True)]
    (cameras, no_view), lights = _cameras(document, placed), _lights(document, placed)
    found.cameras = {name: camera for name, (_, camera, _) in cameras.items()}
    found.no_view = no_view
    found.camera = next(iter(found.cameras.values()), None)
    found.lights = [light for _, light, _ in lights] or None
    found.motion = moves.motion(graph, cameras, lights)
    budget.limits.check("draws", len(found.nodes) * len(found.lights or ()), "the scene")
    _note(document, meshes.lost)
    if not found.nodes:
        raise SceneError(f"nothing to render: {_why_empty(document, placed, meshes.lost)}")
    return found


def _why_empty(document: Document, placed: list[Named], lost: Counter[str]) -> str:
    if lost["broken"]:
        return "; ".join(shortened(document.notes))
    if not placed:
        return "its scene has no nodes" if document.items("scenes") else "it has no scene"
    return "no node of its scene has a mesh with triangles, points or lines"


def _named(graph: Graph) -> list[Named]:
    """(unique name, index, node, world_from_node): in glTF, nodes may share a name or have none."""
    result, seen = [], set()
    for index, matrix in zip(graph.placed, graph.matrices(graph.placed), strict=True):
        node = graph.nodes[index]
        name = str(node.get("name") or f"node{index}")
        if name in seen:
            name = f"{name}.{index}"
        seen.add(name)
        result.append((name, index, node, matrix))
    return result


class _Meshes:
    """Meshes of a document in the forms that nodes give them; `lost` counts what is not drawn."""

    def __init__(self, document: Document, graph: Graph, moves: Movement) -> None:
        self._document, self._graph, self._moves = document, graph, moves
        self._primitives = Primitives(document, Surfaces(document))
        self._made: dict[tuple[Any, ...], list[tuple[Mesh, bool]]] = {}
        self._joints: dict[int, Array] = {}
        self.lost: Counter[str] = Counter()
        self._noted: set[str] = set()

    def of(self, node: dict[str, Any], index: int, user: str, matrix: Array) -> tuple[list[tuple[Mesh, bool]], Array]:
        """The meshes of a node, and whether its skin has already placed them; its placements. A broken node has no meshes, and a note."""
        with self._lenient(user):
            made = self._of(node, index, user)
            return made, instances(self._document, node, index, matrix) if made else matrix[None]
        return [], matrix[None]

    @contextmanager
    def _lenient(self, what: str) -> Iterator[None]:
        """Turn an error into a note that this is left out; each error once."""
        try:
            yield
        except BROKEN as error:
            note = named(error, what)
            self.lost["broken"] += 1
            if note not in self._noted:
                self._noted.add(note)
                self._document.notes.append(f"{note}: left out")

    def _of(self, node: dict[str, Any], index: int, user: str) -> list[tuple[Mesh, bool]]:
        number = node["mesh"]
        mesh = self._document.item("meshes", number, user)
        form = self._form(node, index, mesh, user)
        key = (number, *form.key)
        if key not in self._made:
            title = f"mesh {mesh['name']!r}" if mesh.get("name") else f"meshes[{number}]"
            self._made[key] = self._make(mesh, form, title)
        return self._made[key]

    def deformer(self, mesh: Mesh) -> Mesh | Deformer:
        """What deforms a mesh over time; the mesh itself if nothing does."""
        return self._primitives.deformers.get(id(mesh), mesh)

    def posed_by(self, node: dict[str, Any], mesh: Mesh) -> tuple[Weights, int | None]:
        """Weights at rest of a node's morph targets, and its skin if that deforms the mesh."""
        deformer = self._primitives.deformers.get(id(mesh))
        weights = resting_weights(node, self._document.item("meshes", node["mesh"], "a node"), "a node")
        return weights, None if deformer is None or deformer.influences is None else node.get("skin")

    def _form(self, node: dict[str, Any], index: int, mesh: dict[str, Any], user: str) -> Form:
        weights = resting_weights(node, mesh, user)
        if "skin" not in node:
            return Form(weights, deforms=self._moves.deforms(index, None))
        skin = node["skin"]
        self._document.item("skins", skin, user)
        if skin not in self._joints:
            joints = self._moves.skins[skin] = bound(self._document, skin, user)
            self._joints[skin] = joints.matrices(np.stack(self._graph.matrices(joints.joints)))
        return Form(weights, skin, self._joints[skin], self._moves.deforms(index, self._moves.skins[skin]))

    def _make(self, mesh: dict[str, Any], form: Form, title: str) -> list[tuple[Mesh, bool]]:
        made = []
        primitives = mesh.get("primitives", [])
        if not isinstance(primitives, list):
            raise SceneError(f"not valid glTF: {title}.primitives must be an array, got {type(primitives).__name__}")
        self._document.budget.limits.check("nodes", len(primitives), title)
        for number, given in enumerate(primitives):
            where = f"{title} primitive {number}"
            with self._lenient(where):
                primitive = as_object(given, where)
                if not is_surface(primitive):
                    loose = loose_mesh(self._primitives, primitive, form, where)
                    if loose is not None:
                        made.append((loose, form.joints is not None and is_skinned(primitive)))
                    continue
                skinned = form.joints is not None and is_skinned(primitive)
                made.append((self._primitives.get(primitive, form, where), skinned))
                self.lost["skins without joints"] += form.joints is not None and not skinned
        return made


def _note(document: Document, lost: Counter[str]) -> None:
    if lost["skins without joints"]:
        document.notes.append(
            f"{lost['skins without joints']} primitive(s) of skinned nodes have no joints: drawn where their node is"
        )


def _cameras(document: Document, placed: list[Named]) -> tuple[dict[str, CameraAt], str | None]:
    """The cameras of the scene by the names of their nodes, without kinds that glTF does not define and broken ones, which are noted; and,
    if the first is broken, what is wrong with it."""
    found: dict[str, CameraAt] = {}
    no_view = None
    for name, index, node, matrix in placed:
        if "camera" not in node:
            continue
        try:
            camera = document.item("cameras", node["camera"], f"node {name!r}")
            kind = camera.get("type")
            lens = as_object(camera.get(str(kind), {}), f"node {name!r}: its camera")
            own = str(camera.get("name") or name)
            name = name if node.get("name") or own in found else own
            if kind == "perspective":
                fov_y = float(np.degrees(_size(lens, "yfov", name)))
                perspective = partial(PerspectiveCamera.from_pose, fov_y=fov_y)
                found[name] = index, perspective(matrix), perspective
            elif kind == "orthographic":
                orthographic = partial(OrthographicCamera.from_pose, height=2.0 * _size(lens, "ymag", name))
                found[name] = index, orthographic(matrix), orthographic
            else:
                document.notes.append(f"camera {name!r} is {kind}, which is not supported: left out")
        except BROKEN as error:
            if found or no_view:
                document.notes.append(f"{named(error, f'camera {name!r}')}: left out")
            else:
                no_view = named(error, f"camera {name!r}")
    return found, no_view


def _size(lens: dict[str, Any], key: str, name: str) -> float:
    """A required number of a camera, not 0; negative values, which glTF discourages, mean the same as positive ones."""
    value = abs(as_float(lens.get(key)))
    if not 0.0 < value < np.inf:
        raise SceneError(
            f"node {name!r}: {key} of its camera must be a number other than 0, got {shown(lens.get(key))}"
        )
    return value


def _lights(document: Document, placed: list[Named]) -> list[LightAt]:
    """The lights of the scene; broken ones are left out with a note."""
    lit = [each for each in placed if "KHR_lights_punctual" in extensions(each[2])]
    document.budget.limits.check("lights", len(lit), "the scene")
    lights: list[LightAt] = []
    for name, number, node, matrix in lit:
        try:
            stored = as_object(extensions(document.json).get("KHR_lights_punctual", {}), "KHR_lights_punctual")
            given = stored.get("lights", [])
            index = as_object(extensions(node)["KHR_lights_punctual"], f"node {name!r}").get("light")
            if not isinstance(index, int) or not 0 <= index < len(given):
                raise SceneError(f"node {name!r} refers to light {index!r}, but the file has {len(given)} lights")
            place = partial(_light, as_object(given[index], f"light {index}"), name)
            lights.append((number, place(matrix, document.notes), place))
        except BROKEN as error:
            document.notes.append(f"{named(error, f'light {name!r}')}: left out")
    return lights


def _light(light: dict[str, Any], name: str, matrix: Array, notes: list[str] | None = None) -> Light:
    """KHR_lights_punctual: shines along -z; candela for spot and point (hence falloff 2), lux for directional."""
    color: Any = tuple(float(x) for x in light.get("color", (1.0, 1.0, 1.0)))
    intensity = float(light.get("intensity", 1.0))
    position, direction = tuple(matrix[:3, 3].tolist()), tuple((-matrix[:3, 2]).tolist())
    reach = None if light.get("range") is None else float(light["range"])
    kind = light.get("type")
    if kind == "directional":
        return DirectionalLight(direction=direction, color=color, intensity=intensity, photometric=True)
    if kind == "point":
        return PointLight(
            position=position, color=color, intensity=intensity, range=reach, falloff=2.0, photometric=True
        )
    if kind != "spot":
        raise SceneError(f"light {name!r} must be directional, point or spot, got {kind!r}")
    cone = as_object(light.get("spot", {}), f"light {name!r}")
    inner, outer = (
        float(np.degrees(cone.get(key, rad))) for key, rad in (("innerConeAngle", 0.0), ("outerConeAngle", np.pi / 4))
    )
    if outer > WIDEST_CONE:
        if notes is not None:
            notes.append(f"spot light {name!r} opens {outer:g} degrees from its axis: narrowed to {WIDEST_CONE:g}")
        outer = WIDEST_CONE
    elif inner > outer and notes is not None:
        notes.append(
            f"spot light {name!r} has an inner angle of {inner:g} degrees: narrowed to its outer one, {outer:g}"
        )
    inner = min(inner, outer)
    return SpotLight(
        position=position,
        direction=direction,
        color=color,
        intensity=intensity,
        photometric=True,
        inner_angle=inner,
        outer_angle=outer,
        range=reach,
        falloff=2.0,
    )
