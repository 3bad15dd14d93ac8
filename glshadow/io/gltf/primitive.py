"""glTF primitives as Meshes: each is made once per form, and shared."""

from __future__ import annotations

import json
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshadow.core.spaces import Array
from glshadow.errors import SceneError
from glshadow.io.gltf.accessor import Rows, read_accessor, read_floats, read_whole
from glshadow.io.gltf.declared import check_declared
from glshadow.io.gltf.document import Document, as_object
from glshadow.io.gltf.draco import decoded
from glshadow.io.gltf.indices import triangles_of, without
from glshadow.io.gltf.material import Surfaces, texture_uv
from glshadow.io.gltf.morph import Weights, moved, targets_of
from glshadow.io.gltf.pose import Deformer
from glshadow.io.gltf.skin import influences, posed
from glshadow.io.imported import WHITE, linear_colors, tinted, usable_normals, used_vertices
from glshadow.scene.mesh import MAPS, Mesh, sampler_of

_DRAWN_BYTES = 50  # memory that drawing needs per triangle of a mesh: vertices, two index lists, a normal


@dataclass(frozen=True, eq=False)
class Form:
    """How a node poses its mesh.

    Parameters
    ----------
    weights : tuple of float
        Weights of the morph targets.
    skin : int, optional
        Index of the skin.
    joints : (J, 3, 4) float64, optional
        world_from_bind of the skin's joints.
    deforms : bool
        Whether animations change the weights, or move the joints.
    """

    weights: Weights = ()
    skin: int | None = None
    joints: Array | None = None
    deforms: bool = False

    @property
    def key(self) -> tuple[Any, ...]:
        """Equal for equal forms of one file."""
        return (self.weights, self.skin, self.deforms)


@dataclass
class Primitives:
    """Meshes of one document by their primitives and forms; meshes that differ only in material share their arrays.

    `deformers`: what deforms a mesh, by the mesh's id.
    """

    document: Document
    surfaces: Surfaces
    made: dict[tuple[Any, ...], Mesh] = field(default_factory=dict)
    bodies: dict[tuple[Any, ...], _Body] = field(default_factory=dict)
    deformers: dict[int, Deformer] = field(default_factory=dict)

    def get(self, primitive: dict[str, Any], form: Form, where: str) -> Mesh:
        """The triangles of a primitive; in world space if both the form and the primitive have joints.

        Raises
        ------
        SceneError
            If an accessor cannot be read, POSITION is missing, an index is out of range or a coordinate is not finite.
        """
        shape = (json.dumps({k: v for k, v in primitive.items() if k != "material"}, sort_keys=True), *form.key)
        key = (json.dumps(primitive.get("material")), *shape)
        if key not in self.made:
            self.document.budget.check_time(where)
            if shape not in self.bodies:
                self.bodies[shape] = _body(self.document, decoded(self.document, primitive, where), form, where)
            self.made[key] = self._dressed(self.bodies[shape], primitive.get("material"), where)
            self.document.budget.take(_DRAWN_BYTES * len(self.made[key].triangles), where)
            if form.deforms:
                self._keep_undeformed(self.made[key], primitive, self.bodies[shape].vertices, form)
        return self.made[key]

    def _keep_undeformed(self, mesh: Mesh, primitive: dict[str, Any], vertices: _Vertices, form: Form) -> None:
        """Keep what poses of a mesh at other times are made from, if an animation deforms it."""
        still = replace(vertices, targets=[])
        influences = None if form.joints is None else still.joints(len(form.joints), [])
        each = [still.changes(target) for target in primitive.get("targets", ())]
        if not each and influences is None:
            return
        positions = still.read("POSITION", ("VEC3",))
        assert positions is not None
        normals = still.read("NORMAL", ("VEC3",))
        resting = (form.weights if each else (), None if influences is None else form.joints)
        self.deformers[id(mesh)] = Deformer(mesh, resting, positions, normals, tuple(each), influences)

    def _dressed(self, body: _Body, material: Any, where: str) -> Mesh:
        surface = self.surfaces.get(material, where)
        found = surface.given if body.clear else surface.material
        maps = ("texture", "transmission_map", *MAPS)
        needed = {name for name in maps if getattr(found, name) is not None}
        sets: list[NDArray[np.float32] | None] = [None, None]
        for k, number in enumerate(surface.uv_sets if needed else ()):
            stored = body.vertices.read(f"TEXCOORD_{number}", ("VEC2",))
            uv = None if stored is None else texture_uv(stored, surface.uv_transform)
            sets[k] = uv if uv is not None and np.isfinite(uv).all() else None
            lost = [name for name in maps if name in needed and sets[k] is None and sampler_of(found, name).uv_set == k]
            for name in lost:
                self.document.notes.append(
                    f"{where} has a {name.replace('_', ' ')} but no usable TEXCOORD_{number}: drawn without it"
                )
                found = replace(found, **{name: None})  # type: ignore[arg-type]
        if all(getattr(found, name) is None for name in maps):
            sets = [None, None]
        tangents = None if found.normal_map is None else _tangents(body.vertices)
        found = (
            replace(found, color=tuple((np.asarray(body.tint) * found.color).tolist()))
            if body.tint != WHITE.color
            else found
        )
        try:
            return Mesh(body.positions, body.triangles, body.normals, sets[0], body.colors, found, sets[1], tangents)
        except SceneError as error:
            raise SceneError(f"{where}: {error}; repair or remove them") from error


@dataclass(frozen=True)
class _Vertices:
    """The used vertices of a primitive with morph targets applied; reads only the accessor rows that triangles use."""

    document: Document
    attributes: dict[str, Any]
    targets: list[tuple[float, dict[str, Any]]]
    count: int
    rows: Rows
    where: str

    def read(self, name: str, types: tuple[str, ...]) -> Array | None:
        """Values (N, columns) of an attribute; None if the primitive does not have it."""
        if name not in self.attributes:
            return None
        values = self._rows(self.attributes[name], name, types)
        for weight, target in self.targets:
            if name in target:
                values = moved(values, weight, self._rows(target[name], f"targets.{name}", types))
        return values

    def _rows(self, accessor: Any, name: str, types: tuple[str, ...]) -> Array:
        where = f"{self.where}.{name}"
        self._check(accessor, types, where)
        return read_floats(self.document, accessor, types, where, self.rows)

    def changes(self, target: dict[str, Any]) -> tuple[Array | None, Array | None]:
        """A morph target's changes of positions and normals; notes changes of colours and texture coordinates, which stay."""
        if still := sorted(set(target) - {"POSITION", "NORMAL", "TANGENT"}):
            note = f"{self.where}: animated morph targets change {', '.join(still)}, which stay as they are at rest"
            self.document.notes += [note] * (note not in self.document.notes)
        position, normal = (
            self._rows(target[name], f"targets.{name}", ("VEC3",)) if name in target else None
            for name in ("POSITION", "NORMAL")
        )
        return position, normal

    def joints(self, number: int, notes: list[str]) -> tuple[NDArray[np.int64], Array] | None:
        """Joints (N, K), of `number`, and their weights (N, K); None if the primitive has none."""
        joints: list[NDArray[np.int64]] = []
        weights: list[Array] = []
        while f"JOINTS_{len(joints)}" in self.attributes and f"WEIGHTS_{len(joints)}" in self.attributes:
            names = [f"{kind}_{len(joints)}" for kind in ("JOINTS", "WEIGHTS")]
            for name in names:
                self._check(self.attributes[name], ("VEC4",), f"{self.where}.{name}")
            self.document.item("accessors", self.attributes[names[1]], self.where)["normalized"] = (
                True  # otherwise meaningless
            )
            where = f"{self.where}.{names[0]}"
            joints.append(read_whole(self.document, self.attributes[names[0]], ("VEC4",), where, self.rows))
            weights.append(self._rows(self.attributes[names[1]], names[1], ("VEC4",)))
        return influences(joints, weights, number, notes, self.where) if joints else None

    def _check(self, accessor: Any, types: tuple[str, ...], where: str) -> None:
        length = len(read_accessor(self.document, accessor, types, where)[0])
        if length != self.count:
            raise SceneError(f"{where} has {length} elements, POSITION has {self.count}")


def is_skinned(primitive: dict[str, Any]) -> bool:
    """Whether a skin moves its vertices."""
    attributes = as_object(primitive.get("attributes", {}), "attributes")
    return "JOINTS_0" in attributes and "WEIGHTS_0" in attributes


@dataclass(frozen=True, eq=False)
class _Body:
    """A primitive without its material.

    Parameters
    ----------
    vertices : _Vertices
        For data that depends on the material: texture coordinates.
    positions, triangles, normals, colors
        As for a Mesh.
    tint : (4,) floats
        Colour shared by all vertices.
    clear : bool
        Whether any vertex is transparent.
    """

    vertices: _Vertices
    positions: Array
    triangles: NDArray[np.int32]
    normals: NDArray[np.float32] | None
    colors: NDArray[np.float32] | None
    tint: tuple[float, float, float, float]
    clear: bool


def _body(document: Document, primitive: dict[str, Any], form: Form, where: str) -> _Body:
    attributes = as_object(primitive.get("attributes", {}), f"{where}.attributes")
    if "POSITION" not in attributes:
        raise SceneError(f"{where} has no POSITION: there is nothing to draw")
    count = len(read_accessor(document, attributes["POSITION"], ("VEC3",), f"{where}.POSITION")[0])
    rows, triangles = used_vertices(triangles_of(document, primitive, count, where), count)
    vertices = _Vertices(document, attributes, targets_of(document, primitive, form.weights, where), count, rows, where)
    positions = vertices.read("POSITION", ("VEC3",))
    assert positions is not None
    lost = np.asarray(~np.isfinite(positions).all(axis=1))
    if lost.any():
        message = (
            f"{where}: {int(lost.sum())} of {len(lost)} vertices have coordinates that are not finite (NaN or infinite)"
        )
        whole = np.arange(count)[rows][without(document, triangles, np.asarray(lost[triangles].any(axis=1)), message)]
        rows, triangles = used_vertices(whole, count)
        vertices = replace(vertices, rows=rows)
        positions = vertices.read("POSITION", ("VEC3",))
        assert positions is not None
    if not vertices.targets:
        check_declared(document, attributes["POSITION"], positions, where)
    normals = vertices.read("NORMAL", ("VEC3",))
    if form.joints is not None:
        followed = vertices.joints(len(form.joints), document.notes)
        if followed is not None:
            positions, normals = posed(positions, normals, *followed, form.joints)
    linear = _colors(vertices)
    tint, colors = tinted(WHITE, linear)
    return _Body(
        vertices,
        positions,
        triangles.astype(np.int32),
        usable_normals(positions, triangles, normals),
        colors,
        tint.color,
        linear is not None and bool((linear[:, 3] < 1.0).any()),
    )


def _tangents(vertices: _Vertices) -> NDArray[np.float32] | None:
    """TANGENT (N, 4) of vertices that stay where they are, if all can be used; else tangents are derived."""
    if "TANGENT" not in vertices.attributes or vertices.targets or "JOINTS_0" in vertices.attributes:
        return None
    stored = vertices.read("TANGENT", ("VEC4",))
    usable = stored is not None and np.isfinite(stored).all() and stored[:, :3].any(axis=1).all()
    return stored.astype(np.float32) if stored is not None and usable else None


def _colors(vertices: _Vertices) -> Array | None:
    """COLOR_0 (N, 4), linear; integers are normalised even if the file does not say so."""
    if "COLOR_0" not in vertices.attributes:
        return None
    vertices.document.item("accessors", vertices.attributes["COLOR_0"], vertices.where)["normalized"] = True
    colors = vertices.read("COLOR_0", ("VEC3", "VEC4"))
    if colors is not None and vertices.targets:
        colors = np.clip(colors, 0.0, 1.0)  # as glTF specifies for morphed colours
    return None if colors is None else linear_colors(colors, f"{vertices.where}.COLOR_0", vertices.document.notes)
