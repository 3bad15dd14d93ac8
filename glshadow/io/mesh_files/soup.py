"""The common result of mesh file readers, polygons with attributes; and the nodes made from them."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshadow.core.spaces import Array
from glshadow.errors import SceneError
from glshadow.geometry.creases import smooth_normals
from glshadow.io.clouds import Loose
from glshadow.io.imported import WHITE, tinted, usable_normals, used_only
from glshadow.io.limits import Budget
from glshadow.io.polygons import triangulated
from glshadow.scene.mesh import MAPS, Material, Mesh
from glshadow.scene.nodes import Node

Indices = NDArray[np.int64]

MOST_PARTS = (
    500  # largest count of nodes of one file that differ by material; each takes 1 ms to load and draw (measured)
)
MOST_NAMED = 5000  # the same if the file has names for them
CORNER_BYTES = 400  # memory per corner of what computes smooth normals (measured: 350)
CROWDED = 4  # triangles per vertex from which duplicates are likely: a closed surface has two


@dataclass(frozen=True)
class Part:
    """Properties of a node: name and material, and the scale and offset of its texture coordinates."""

    name: str
    material: Material = WHITE
    uv_scale: tuple[float, float] = (1.0, 1.0)
    uv_offset: tuple[float, float] = (0.0, 0.0)

    def look(self) -> tuple[object, ...]:
        """Equal for parts that are drawn alike except for their base colour."""
        material = self.material
        maps = tuple(
            id(each) for each in (material.texture, material.normal_map, material.emission_map, material.sampler)
        )
        return (*maps, material.emission, material.alpha_mode, material.color[3], self.uv_scale, self.uv_offset)

    @property
    def mapped(self) -> bool:
        """Whether its material has a map."""
        return any(getattr(self.material, name) is not None for name in ("texture", *MAPS))


@dataclass(frozen=True)
class Table:
    """Rows (N, K) and the row of each corner (C,), -1 for none; None: the row of its vertex."""

    rows: Array
    of: Indices | None = None

    def checked(self, what: str, notes: list[str]) -> Table | None:
        """The same without references beyond its rows; None if nothing refers to it."""
        if self.of is None:
            return self
        beyond = self.of >= len(self.rows)
        if beyond.any():
            notes.append(f"{int(beyond.sum())} corner(s) refer to {what} that do not exist: drawn without them")
        of = np.where(beyond, -1, self.of)
        return None if (of < 0).all() else Table(self.rows, of)

    def taken(self, vertex: Indices, corner: Indices) -> Array:
        """Rows of new vertices, given the vertex and a corner of each; NaN if there is none."""
        if self.of is None:
            return np.asarray(self.rows[vertex])
        row = self.of[corner]
        return np.where((row < 0)[:, None], np.nan, self.rows[row])


@dataclass
class Soup:
    """Polygons with attributes.

    Parameters
    ----------
    positions : (V, 3)
    corners : (C,)
        Vertex of every corner, polygon by polygon.
    counts : (P,)
        Corners of each polygon.
    parts : list of Part; part : (P,), optional
        Part of each polygon; None: the first.
    colors : (V, 4), optional; face_colors : (P, 4), optional
        Linear RGBA; they are multiplied.
    normals, uv : Table of 3, Table of 2 columns, optional
    loose : list of Loose
        Points and lines.
    smoothing : (P,), optional
        Smoothing group of each polygon, 0 for none.
    named : bool
        Whether the file names the parts as objects or groups.
    """

    positions: Array
    corners: Indices
    counts: Indices
    parts: list[Part] = field(default_factory=lambda: [Part("mesh")])
    part: Indices | None = None
    colors: Array | None = None
    face_colors: Array | None = None
    normals: Table | None = None
    uv: Table | None = None
    loose: list[Loose] = field(default_factory=list)
    smoothing: Indices | None = None
    named: bool = False

    def only(self, kept: NDArray[np.bool_]) -> Soup:
        """The polygons that `kept` (P,) selects."""
        corner = np.repeat(kept, self.counts)
        chosen: dict[str, Any] = {"corners": self.corners[corner]}
        for name in ("counts", "part", "face_colors", "smoothing"):
            value = getattr(self, name)
            chosen[name] = None if value is None else value[kept]
        for name in ("normals", "uv"):
            table = getattr(self, name)
            chosen[name] = table if table is None or table.of is None else Table(table.rows, table.of[corner])
        return replace(self, **chosen)


def placed(soup: Soup, notes: list[str], budget: Budget, smooth: float | None = None) -> list[Node]:
    """Nodes, with one mesh for each part.

    Parameters
    ----------
    smooth : float, optional
        Crease angle in degrees, for polygons without normals; None: the soup's smoothing groups.

    Raises
    ------
    SceneError
        For more triangles than the limit.
    """
    budget.check_time("its vertices and faces")
    soup = _sound(soup, notes)
    if len(soup.corners) == 0:
        return []
    textured = any(part.mapped for part in soup.parts)
    soup.uv = soup.uv.checked("texture coordinates", notes) if soup.uv is not None and textured else None
    soup.normals = None if soup.normals is None else soup.normals.checked("normals", notes)
    soup.normals = _smoothed(soup, smooth, budget)
    slots, polygon = triangulated(soup.positions, soup.corners, soup.counts, notes, budget)
    if len(slots) == 0:
        return []
    slots, polygon = _once(soup, slots, polygon, notes)
    soup = _merged(soup, polygon, notes)
    return [Node(mesh, np.eye(4), part.name) for part, mesh in _meshes(soup, slots, polygon, notes)]


def _sound(soup: Soup, notes: list[str]) -> Soup:
    """The polygons whose vertices exist and are finite; notes how many others there are."""
    if len(soup.corners) == 0:
        return soup
    low, high, polygons = int(soup.corners.min()), int(soup.corners.max()), len(soup.counts)
    if low < 0 or high >= len(soup.positions):
        wrong = high if high >= len(soup.positions) else low
        kept = _all_of(soup, (soup.corners >= 0) & (soup.corners < len(soup.positions)))
        soup = soup.only(kept)
        notes.append(
            f"{polygons - int(kept.sum())} of {polygons} faces left out: a face refers to vertex {wrong}, but there are "
            f"{len(soup.positions)}, counted from 0"
        )
    finite = np.asarray(np.isfinite(soup.positions).all(axis=1))
    if finite.all() or finite[soup.corners].all():
        return soup
    kept = _all_of(soup, finite[soup.corners])
    used = np.unique(soup.corners)
    notes.append(
        f"{int((~kept).sum())} of {polygons} faces left out: {int((~finite[used]).sum())} of {len(soup.positions)} vertices have "
        "coordinates that are not finite (NaN or infinite)"
    )
    return soup.only(kept)


def _all_of(soup: Soup, corner: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Which polygons (P,) fulfil a condition (C,) at all of their corners."""
    polygon = np.repeat(np.arange(len(soup.counts)), soup.counts)
    return np.asarray(np.bincount(polygon[~corner], minlength=len(soup.counts)) == 0)


def _smoothed(soup: Soup, smooth: float | None, budget: Budget) -> Table | None:
    """The normals of a soup; where it has none, those that follow from the crease angle or the smoothing groups."""
    groups = soup.smoothing if smooth is None else None
    given = soup.normals
    if smooth is None and groups is None:
        return given
    if given is not None and (given.of is None or (given.of >= 0).all()):
        return given
    budget.take(CORNER_BYTES * len(soup.corners), "its smooth normals")
    crease_rad = None if smooth is None else float(np.radians(smooth))
    found = smooth_normals(soup.positions, soup.corners, soup.counts, crease_rad, groups)
    if found is None or given is None or given.of is None:
        return given if found is None else Table(*found)
    rows, of = found
    return Table(np.concatenate([given.rows, rows]), np.where(given.of < 0, len(given.rows) + of, given.of))


def _once(soup: Soup, slots: Indices, polygon: Indices, notes: list[str]) -> tuple[Indices, Indices]:
    """Remove triangles that repeat an earlier one, which costs time and shows nothing, if many are likely."""
    used = np.zeros(len(soup.positions), dtype=bool)
    used[soup.corners] = True
    if len(slots) <= CROWDED * np.count_nonzero(used):
        return slots, polygon
    vertices = soup.corners[slots]
    turn = vertices.argmin(axis=1)[:, None]
    first, _ = _distinct(list(np.take_along_axis(vertices, (turn + np.arange(3)) % 3, axis=1).T))
    if len(first) < len(slots):
        notes.append(f"{len(slots) - len(first)} of {len(slots)} triangles repeat an earlier one: left out")
    first.sort()
    return slots[first], polygon[first]


def _merged(soup: Soup, polygon: Indices, notes: list[str]) -> Soup:
    """Limit parts to about MOST_PARTS: beyond, parts of one material are merged, and their base colours become face colours."""
    if soup.part is None:
        return soup
    used = np.unique(soup.part[polygon])
    most = MOST_NAMED if soup.named else MOST_PARTS
    if len(used) <= most:
        return soup
    parts = [soup.parts[number] for number in used.tolist()]
    keys: list[tuple[object, ...]] = [(*part.look(), part.material.color) for part in parts]
    colors = None
    if len(set(keys)) > most:
        keys = [part.look() for part in parts]
        colors = np.ones((len(soup.parts), 4))
        colors[used, :3] = [part.material.color[:3] for part in parts]
        parts = [
            replace(part, material=replace(part.material, color=(1.0, 1.0, 1.0, part.material.color[3])))
            for part in parts
        ]
    number: dict[tuple[object, ...], int] = {}
    new = np.zeros(len(soup.parts), dtype=np.int64)
    new[used] = [number.setdefault(key, len(number)) for key in keys]
    first = dict(zip(reversed(keys), reversed(parts), strict=True))
    notes.append(
        f"its {len(used)} groups are more than {most}: those that look alike are merged, into {len(number)} node(s), "
        "each named after its first"
    )
    face_colors = soup.face_colors
    if colors is not None:
        own = colors[soup.part]
        face_colors = own if face_colors is None else face_colors * own
    return replace(soup, parts=[first[key] for key in number], part=new[soup.part], face_colors=face_colors)


def _meshes(soup: Soup, slots: Indices, polygon: Indices, notes: list[str]) -> list[tuple[Part, Mesh]]:
    """One mesh for each part that has triangles, in the order in which the parts first appear."""
    corner = slots.ravel()
    keys = [] if soup.part is None else [np.repeat(soup.part[polygon], 3)]
    if soup.face_colors is not None:
        keys.append(np.repeat(_numbered(soup.face_colors)[polygon], 3))
    keys += [table.of[corner] + 1 for table in (soup.uv, soup.normals) if table is not None and table.of is not None]
    vertex = soup.corners[corner]
    if not keys:
        attributes = [None if table is None else table.rows for table in (soup.normals, soup.uv)] + [soup.colors]
        return [(soup.parts[0], _mesh(soup.parts[0], soup.positions, vertex.reshape(-1, 3), attributes, notes))]
    first, new = _distinct([*keys, vertex])
    triangles = new.reshape(-1, 3)
    at, face = corner[first], polygon[first // 3]
    soup_vertex = vertex[first]
    colors = _product(None if soup.colors is None else soup.colors[soup_vertex],
                      None if soup.face_colors is None else soup.face_colors[face])  # fmt: skip
    normals, uv = (None if table is None else table.taken(soup_vertex, at) for table in (soup.normals, soup.uv))
    positions = soup.positions[soup_vertex]
    if soup.part is None:
        return [(soup.parts[0], _mesh(soup.parts[0], positions, triangles, [normals, uv, colors], notes))]
    part_of_vertex, part_of_triangle = soup.part[face], soup.part[polygon]
    order = np.argsort(part_of_triangle, kind="stable")
    numbers = np.unique(part_of_triangle)
    from_vertex = np.searchsorted(part_of_vertex, [*numbers, len(soup.parts)])
    from_triangle = np.searchsorted(part_of_triangle[order], [*numbers, len(soup.parts)])
    found = []
    for k, number in enumerate(numbers.tolist()):
        mine = slice(from_vertex[k], from_vertex[k + 1])
        own = triangles[order[from_triangle[k] : from_triangle[k + 1]]] - from_vertex[k]
        attributes = [None if value is None else value[mine] for value in (normals, uv, colors)]
        found.append((soup.parts[number], _mesh(soup.parts[number], positions[mine], own, attributes, notes)))
    return found


def _numbered(rows: Array) -> Indices:
    """Number of each distinct row (N, 4)."""
    exact = np.ascontiguousarray(rows, dtype=np.float32).view(np.int32)
    return _distinct(list(exact.astype(np.int64).T - np.iinfo(np.int32).min))[1]


def _distinct(keys: list[Indices]) -> tuple[Indices, Indices]:
    """Distinct tuples of non-negative keys (N,), in order: the first index of each, and the number of each row's tuple."""
    key, size = keys[0], int(keys[0].max()) + 1
    for other in keys[1:]:
        width = int(other.max()) + 1
        if size > (1 << 62) // width:
            _, key = np.unique(key, return_inverse=True)
            size = int(key.max()) + 1
        key, size = key * width + other, size * width
    _, first, number = np.unique(key, return_index=True, return_inverse=True)
    return first, number


def _product(a: Array | None, b: Array | None) -> Array | None:
    return a * b if a is not None and b is not None else b if a is None else a


def _mesh(part: Part, positions: Array, triangles: Indices, attributes: list[Array | None], notes: list[str]) -> Mesh:
    normals, uv, colors = attributes
    material, tints = tinted(part.material, colors)
    kept = usable_normals(positions, triangles, normals)
    coordinates = None
    if part.mapped:
        coordinates = _coordinates(part, uv, notes)
        if coordinates is None:
            notes.append(f"{part.name!r} has a texture but no usable texture coordinates: drawn without it")
            material = replace(material, texture=None, **dict.fromkeys(MAPS))  # type: ignore[arg-type]
    positions, triangles, (kept, coordinates, tints) = used_only(positions, triangles, kept, coordinates, tints)
    try:
        return Mesh(positions, triangles.astype(np.int32), kept, coordinates, tints, material)
    except SceneError as error:
        raise SceneError(f"{part.name!r}: {error}; repair or remove them") from error


def _coordinates(part: Part, uv: Array | None, notes: list[str]) -> NDArray[np.float32] | None:
    """Texture coordinates (V, 2) float32, with the material's scale and offset; None if none is usable."""
    if uv is None:
        return None
    with np.errstate(over="ignore", invalid="ignore"):  # values beyond float32 are not usable
        turned = (uv * part.uv_scale + part.uv_offset).astype(np.float32)
    lost = np.logical_not(np.isfinite(turned).all(axis=1))
    if lost.all():
        return None
    if lost.any():
        notes.append(
            f"{part.name!r}: {int(lost.sum())} of {len(lost)} texture coordinates are missing or not finite: 0 there"
        )
        turned[lost] = 0.0
    return turned
