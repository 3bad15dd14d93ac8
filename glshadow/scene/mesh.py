"""What is drawn: Mesh, Material, Node and Scene, all frozen."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import dataclass, replace
from enum import Enum
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from glshadow.core.cameras import PerspectiveCamera
from glshadow.core.lights import DirectionalLight, Light
from glshadow.core.spaces import Array, view_axes
from glshadow.errors import GlshadowWarning, SceneError


class AlphaMode(Enum):
    """glTF's alphaMode."""

    OPAQUE = "OPAQUE"
    MASK = "MASK"
    BLEND = "BLEND"


@dataclass(frozen=True, eq=False)
class Material:
    """Base colour and how alpha is read; nothing else is modelled.

    Parameters
    ----------
    color : (4,) floats
        Linear RGBA factor, each from 0 to 1.
    texture : (H, W, 4) uint8, optional
        sRGB colour with linear alpha, row 0 at the top (v = 1), multiplied by `color`.
    alpha_mode : AlphaMode
        MASK: fragments below `cutoff` do not exist, in the camera and in the caster pass. BLEND: drawn opaque, casts nothing.
    double_sided : bool
        Both sides are meant to be seen. (Both are always drawn; culling is only used where it cannot be seen.)

    Raises
    ------
    SceneError
        For a colour or a cutoff out of range.
    """

    color: tuple[float, float, float, float] = (1.0, 1.0, 1.0, 1.0)
    texture: NDArray[np.uint8] | None = None
    alpha_mode: AlphaMode = AlphaMode.OPAQUE
    cutoff: float = 0.5
    double_sided: bool = False

    def __post_init__(self) -> None:
        if len(self.color) != 4 or not all(0.0 <= x <= 1.0 for x in self.color):
            raise SceneError(
                f"color must be 4 numbers from 0 to 1 (linear red, green, blue, alpha), got {self.color!r}"
            )
        if not np.isfinite(self.cutoff):
            raise SceneError(f"cutoff must be a finite number, got {self.cutoff!r}")


@dataclass(frozen=True, eq=False)
class Mesh:
    """Triangles of one material.

    Parameters
    ----------
    positions : (V, 3) float64
        In the node's space.
    triangles : (T, 3) int32
        Indices into `positions`, counter-clockwise seen from the front.
    normals : (V, 3) float32, optional
        Unit shading normals; None: flat shading.
    uv : (V, 2) float32, optional
        v up: (0, 0) is the bottom left of the texture.
    colors : (V, 4) float32, optional
        Linear RGBA, alpha straight, each from 0 to 1; interpolated, and multiplied with the material's colour and texture.
    material : Material

    Raises
    ------
    SceneError
        For wrong shapes, indices out of range, colours out of range, and coordinates of used vertices that are not finite.
    """

    positions: Array
    triangles: NDArray[np.int32]
    normals: NDArray[np.float32] | None = None
    uv: NDArray[np.float32] | None = None
    colors: NDArray[np.float32] | None = None
    material: Material = Material()

    def __post_init__(self) -> None:
        positions = np.ascontiguousarray(self.positions, dtype=np.float64)
        given = np.asarray(self.triangles)
        if positions.ndim != 2 or positions.shape[1] != 3 or given.ndim != 2 or given.shape[1] != 3:
            raise SceneError(
                f"a mesh needs positions (V, 3) and triangles (T, 3), got shapes {positions.shape} and {given.shape}"
            )
        if given.size and (given.min() < 0 or given.max() >= len(positions)):
            raise SceneError(
                f"triangle index {int(given.max() if given.max() >= len(positions) else given.min())} is out of range: "
                f"the mesh has {len(positions)} vertices"
            )
        triangles = np.ascontiguousarray(given, dtype=np.int32)
        if not np.isfinite(positions).all():
            used = np.zeros(len(positions), dtype=bool)
            used[triangles.ravel()] = True
            bad = int((used & ~np.isfinite(positions).all(axis=1)).sum())
            if bad:
                raise SceneError(
                    f"{bad} of {len(positions)} vertices have coordinates that are not finite (NaN or infinite)"
                )
            positions = np.where(used[:, None], positions, 0.0)
        object.__setattr__(self, "positions", positions)
        object.__setattr__(self, "triangles", triangles)
        for name, columns in (("normals", 3), ("uv", 2), ("colors", 4)):
            value = getattr(self, name)
            if value is None:
                continue
            array = np.ascontiguousarray(value, dtype=np.float32)
            if array.shape != (len(positions), columns):
                raise SceneError(f"{name} must have shape ({len(positions)}, {columns}), got {array.shape}")
            if name == "colors" and not ((array >= 0.0) & (array <= 1.0)).all():
                bad = int((~((array >= 0.0) & (array <= 1.0))).any(axis=1).sum())
                raise SceneError(f"colors must be numbers from 0 to 1 (linear RGBA), {bad} of {len(array)} are not")
            object.__setattr__(self, name, array)

    @cached_property
    def bounds(self) -> Array:
        """(2, 3) least and greatest corner of the vertices that triangles use."""
        used = np.zeros(len(self.positions), dtype=bool)
        used[self.triangles.ravel()] = True
        columns = [
            self.positions[used, axis] for axis in range(3)
        ]  # numpy reduces columns much faster than rows of three
        return np.array([[c.min() for c in columns], [c.max() for c in columns]])

    @cached_property
    def closed(self) -> bool:
        """Whether it is watertight once welded by exact position, consistently wound, and every part of it turned outward.

        Only then is it safe to cull back faces: nobody outside can see them.
        """
        return _closed(self.positions, self.triangles)


def _closed(positions: Array, triangles: NDArray[np.int32]) -> bool:
    if len(triangles) < 4:  # a tetrahedron has four
        return False
    corners = welded(positions)[triangles]
    whole = (corners[:, 0] != corners[:, 1]) & (corners[:, 1] != corners[:, 2]) & (corners[:, 2] != corners[:, 0])
    corners = corners[whole]
    if len(corners) == 0:
        return False
    start, end = corners.ravel().astype(np.int64), corners[:, [1, 2, 0]].ravel().astype(np.int64)
    forward = np.sort((start << 32) | end)
    if (forward[1:] == forward[:-1]).any():  # an edge used twice in one direction
        return False
    if not np.array_equal(forward, np.sort((end << 32) | start)):  # an edge without its twin
        return False
    return _turned_outward(positions, triangles[whole], corners)


def _turned_outward(positions: Array, triangles: NDArray[np.int32], corners: NDArray[np.int64]) -> bool:
    """Whether every connected part, not only the sum of them, has a positive volume; `corners`: the triangles of welded vertices."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    start, end = corners[:, :2].ravel(), corners[:, 1:].ravel()  # two edges of a triangle connect it
    graph = coo_array((np.ones(len(start), dtype=np.int8), (start, end)), shape=(int(corners.max()) + 1,) * 2)
    _, part = connected_components(graph, directed=False)
    a, b, c = ((positions - positions.mean(axis=0))[triangles[:, k]] for k in range(3))
    volumes = np.bincount(part[corners[:, 0]], np.einsum("ij,ij->i", a, np.cross(b, c)), minlength=1)
    return bool((volumes[np.unique(part[corners[:, 0]])] > 0.0).all())


def welded(positions: Array) -> NDArray[np.int64]:
    """For each vertex (V,) the number of its position: bit-equal positions share one (and -0 equals 0)."""
    columns = positions + 0.0
    order = np.lexsort(columns.T)
    ordered = columns[order]
    first = np.ones(len(order), dtype=bool)
    first[1:] = (ordered[1:] != ordered[:-1]).any(axis=1)
    number = np.zeros(len(order), dtype=np.int64)
    number[order] = np.cumsum(first) - 1
    return number


@dataclass(frozen=True, eq=False)
class Node:
    """One placement of a mesh: instances share the Mesh object.

    Parameters
    ----------
    name : str
    mesh : Mesh
    world_from_mesh : (4, 4) float64
    casts, receives : bool
        Whether it darkens what lies behind it, and whether others darken it.
    """

    name: str
    mesh: Mesh
    world_from_mesh: Array
    casts: bool = True
    receives: bool = True

    def __post_init__(self) -> None:
        matrix = np.ascontiguousarray(self.world_from_mesh, dtype=np.float64)
        if matrix.shape != (4, 4) or not np.isfinite(matrix).all():
            raise SceneError(f"node {self.name!r}: its matrix must be (4, 4) and finite, got {self.world_from_mesh!r}")
        object.__setattr__(self, "world_from_mesh", matrix)


@dataclass(frozen=True, eq=False)
class Scene:
    """Placed meshes with a camera and lights.

    Parameters
    ----------
    nodes : tuple of Node
        At least one, and at least one triangle.
    camera, lights : optional
        What the file brought. `camera` and `lights` given as None are replaced by defaults that frame the scene:
        see `default_camera` and `default_sun`.

    Raises
    ------
    SceneError
        If there is nothing to render.
    """

    nodes: tuple[Node, ...]
    camera: PerspectiveCamera = None  # type: ignore[assignment]  # replaced in __post_init__
    lights: tuple[Light, ...] = None  # type: ignore[assignment]
    name: str = "scene"

    def __post_init__(self) -> None:
        object.__setattr__(self, "nodes", tuple(self.nodes))
        if not any(len(node.mesh.triangles) for node in self.nodes):
            raise SceneError(f"{self.name}: nothing to render, it has no triangles")
        if (self.bounds[0] == self.bounds[1]).all():
            raise SceneError(f"{self.name}: nothing to render, its size is zero at {self.bounds[0].tolist()}")
        if self.camera is None:
            object.__setattr__(self, "camera", default_camera(self.bounds))
        object.__setattr__(self, "lights", (default_sun(),) if self.lights is None else tuple(self.lights))

    @cached_property
    def boxes(self) -> tuple[Array, Array]:
        """Mesh bounds (N, 2, 3) and world_from_mesh (N, 4, 4) of all nodes that have triangles."""
        nodes = [node for node in self.nodes if len(node.mesh.triangles)]
        return np.stack([node.mesh.bounds for node in nodes]), np.stack([node.world_from_mesh for node in nodes])

    @cached_property
    def bounds(self) -> Array:
        """(2, 3) least and greatest world corner of all nodes' boxes."""
        return np.stack([self.corners.min(axis=(0, 1)), self.corners.max(axis=(0, 1))])

    @cached_property
    def corners(self) -> Array:
        """World corners (N, 8, 3) of the boxes."""
        return box_corners(*self.boxes)

    def moved(self, matrices: Mapping[str, ArrayLike]) -> Scene:
        """The same scene with some nodes placed anew; meshes, and what the GPU holds of them, are shared.

        Parameters
        ----------
        matrices : mapping from node name to (4, 4) world_from_mesh

        Raises
        ------
        SceneError
            If no node has that name.
        """
        unknown = set(matrices) - {node.name for node in self.nodes}
        if unknown:
            known = ", ".join(sorted({node.name for node in self.nodes})[:8])
            raise SceneError(f"no node is named {', '.join(map(repr, sorted(unknown)))}; the scene has: {known}")
        placed = {name: np.asarray(matrix, dtype=np.float64) for name, matrix in matrices.items()}
        nodes = tuple(
            replace(node, world_from_mesh=placed[node.name]) if node.name in placed else node for node in self.nodes
        )
        return replace(self, nodes=nodes)

    def with_ground(self) -> Scene:
        """The scene on a level square plane that touches its lowest point, three times as wide as the scene is large."""
        low, high = self.bounds.copy()
        low[1] = min(_lowest(node) for node in self.nodes if len(node.mesh.triangles))
        size = float(np.linalg.norm(high - low))
        half = 1.5 * size
        x, y, z = 0.5 * (low[0] + high[0]), low[1], 0.5 * (low[2] + high[2])
        corners = np.array([[-half, 0, half], [half, 0, half], [half, 0, -half], [-half, 0, -half]])
        ground = Mesh(
            corners, np.array([[0, 1, 2], [0, 2, 3]], dtype=np.int32), material=Material(color=(0.7, 0.7, 0.7, 1.0))
        )
        matrix = np.eye(4)
        matrix[:3, 3] = (x, y, z)
        return replace(self, nodes=(*self.nodes, Node("ground", ground, matrix)))


def _lowest(node: Node) -> float:
    """Least world y of a node's triangles: of its vertices, where its box would be too large because it is turned."""
    row = node.world_from_mesh[1]
    used = node.mesh.positions[np.unique(node.mesh.triangles)]
    return float((used @ row[:3]).min() + row[3])


def box_corners(bounds: Array, world_from_mesh: Array) -> Array:
    """World corners (N, 8, 3) of boxes (N, 2, 3) placed by (N, 4, 4)."""
    picks = np.array([[i, j, k] for i in (0, 1) for j in (0, 1) for k in (0, 1)])
    local = np.stack([bounds[:, picks[:, axis], axis] for axis in range(3)], axis=-1)
    return np.asarray(np.einsum("nij,nkj->nki", world_from_mesh[:, :3, :3], local) + world_from_mesh[:, None, :3, 3])


VIEW_DIRECTION = (
    0.55,
    0.45,
    0.70,
)  # from the scene to the default camera: three-quarter view from above, chosen by eye
VIEW_MARGIN = 1.1  # of the picture to what the box needs of it, so that nothing touches the frame
SUN_DIRECTION = (-0.55, -0.8, -0.25)  # the bench courtyard's: 53 degrees high, shadows fall to the left and away


def default_camera(bounds: Array) -> PerspectiveCamera:
    """Camera that frames a box (2, 3): looks along -VIEW_DIRECTION at its middle, fov 50, as near as every corner stays in a square
    picture; a wider one shows more to the sides."""
    centre = 0.5 * (bounds[0] + bounds[1])
    towards = np.asarray(VIEW_DIRECTION) / np.linalg.norm(VIEW_DIRECTION)
    corners = box_corners(bounds[None], np.eye(4)[None])[0] - centre
    x, y, z = view_axes(-towards) @ corners.T
    tangent = (
        np.tan(np.radians(25.0)) / VIEW_MARGIN
    )  # a corner at distance d - z is inside while |x|, |y| <= tangent (d - z)
    eye = centre + towards * float((z + np.maximum(np.abs(x), np.abs(y)) / tangent).max())
    return PerspectiveCamera(tuple(eye), tuple(centre))


def default_sun() -> DirectionalLight:
    """One white sun along SUN_DIRECTION."""
    return DirectionalLight(direction=SUN_DIRECTION)


def warn(message: str) -> None:
    """A GlshadowWarning attributed to the caller's caller."""
    warnings.warn(message, GlshadowWarning, stacklevel=3)
