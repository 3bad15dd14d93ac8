"""What is drawn: Mesh, Material, Node and Scene, all frozen."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from enum import Enum
from functools import cached_property
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from glshadow.core.cameras import Camera
from glshadow.core.lights import LIGHTS, Light
from glshadow.core.setting import (
    Numbers,
    Settings,
    as_floats,
    fits,
    flag,
    instance,
    number,
    numbers_in,
    optional,
    refuse,
    setting,
    several,
    shown,
    text,
    vector,
)
from glshadow.core.spaces import Array
from glshadow.errors import SceneError, SettingsError
from glshadow.scene import summary
from glshadow.scene.box import box_corners, check_place, default_camera, default_sun, ground_under, lowest_of
from glshadow.scene.closed import connected

F = TypeVar("F", bound=np.floating[Any])


class AlphaMode(Enum):
    """glTF's alphaMode."""

    OPAQUE = "OPAQUE"
    MASK = "MASK"
    BLEND = "BLEND"


def _pixels(name: str, value: Any) -> NDArray[np.uint8]:
    if isinstance(value, np.ndarray) and not np.ma.isMaskedArray(value) and value.dtype == np.uint8:
        pixels: NDArray[np.uint8] = np.asarray(value)
        if pixels.ndim == 3 and pixels.shape[2] == 4 and pixels.size:
            return pixels
    raise refuse(name, "an array (H, W, 4) of uint8", value)


@dataclass(frozen=True, eq=False, repr=False)
class Material(Settings):
    """Base colour and how alpha is read; nothing else is modelled.

    Parameters
    ----------
    color : (4,) floats
        Linear RGBA factor, each from 0 to 1.
    texture : (H, W, 4) uint8, optional
        sRGB colour with linear alpha, row 0 at the top (v = 1), multiplied by `color`.
    alpha_mode : AlphaMode
        MASK: fragments below `cutoff` do not exist, in the camera and in the caster pass. BLEND: drawn opaque,
        and tints the light that passes through it, (1 - alpha) of it and of its colour; visibility does not know it.
    double_sided : bool
        Both sides are meant to be seen. (Both are always drawn; culling is only used where it cannot be seen.)

    Raises
    ------
    SceneError
        For a colour or a cutoff out of range.
    """

    refusal = SceneError

    color: tuple[float, float, float, float] = setting(vector(4, 0.0, 1.0), (1.0,) * 4, help="linear RGBA factor")
    texture: NDArray[np.uint8] | None = setting(optional(_pixels, "none"), None, help="sRGB with linear alpha")
    alpha_mode: AlphaMode = setting(instance(AlphaMode), AlphaMode.OPAQUE, help="how alpha is read")
    cutoff: float = setting(number(), 0.5, help="alpha below which a MASK material does not exist")
    double_sided: bool = setting(flag(), False, help="both sides are meant to be seen")

    __repr__ = summary.material_line


@dataclass(frozen=True, eq=False, repr=False)
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
        For wrong shapes, indices out of range, colours out of range, and coordinates of used vertices, normals or uv that are not
        finite.
    """

    positions: Array
    triangles: NDArray[np.int32]
    normals: NDArray[np.float32] | None = None
    uv: NDArray[np.float32] | None = None
    colors: NDArray[np.float32] | None = None
    material: Material = Material()

    __repr__ = summary.mesh_line

    def __post_init__(self) -> None:
        if not isinstance(self.material, Material):
            raise SceneError(f"Mesh material must be a Material, got {shown(self.material)}")
        points, given = _array("positions", self.positions), _array("triangles", self.triangles)
        if not (fits(points, (None, 3)) and fits(given, (None, 3))):
            raise SceneError(
                f"a mesh needs positions (V, 3) and triangles (T, 3), got shapes {points.shape} and {given.shape}"
            )
        positions = _floats(points, np.float64)
        if given.dtype.kind == "f" and not (given == np.floor(given)).all():
            raise SceneError("Mesh triangles must be whole numbers: the places of vertices in positions")
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
            given = _array(name, value)
            if given.shape != (len(positions), columns):
                raise SceneError(f"{name} must have shape ({len(positions)}, {columns}), got {given.shape}")
            array = _floats(given, np.float32)
            if not np.isfinite(array).all():
                bad = int((~np.isfinite(array).all(axis=1)).sum())
                raise SceneError(f"{bad} of {len(array)} {name} are not finite numbers that float32 holds")
            if name == "colors" and not ((array >= 0.0) & (array <= 1.0)).all():
                bad = int((~((array >= 0.0) & (array <= 1.0))).any(axis=1).sum())
                raise SceneError(f"colors must be numbers from 0 to 1 (linear RGBA), {bad} of {len(array)} are not")
            object.__setattr__(self, name, array)

    @cached_property
    def bounds(self) -> Array:
        """(2, 3) least and greatest corner of the vertices that triangles use; SceneError where there are none."""
        if len(self.triangles) == 0:
            raise SceneError("a mesh without triangles has no bounds")
        used = np.zeros(len(self.positions), dtype=bool)
        used[self.triangles.ravel()] = True
        # numpy reduces columns much faster than rows of three
        columns = [self.positions[used, axis] for axis in range(3)]
        return np.array([[c.min() for c in columns], [c.max() for c in columns]])

    @property
    def closed(self) -> bool:
        """Whether it is watertight once welded by exact position, consistently wound, and every part of it turned outward.

        Only then is it safe to cull back faces: nobody outside can see them.
        """
        return self._connected[1]

    @property
    def neighbours(self) -> NDArray[np.uint32]:
        """(T, 3) the triangle across each edge ab, bc, ca, welded by exact position; see `glshadow.core.adjacency` for its marks."""
        return self._connected[0]

    @cached_property
    def _connected(self) -> tuple[NDArray[np.uint32], bool]:
        return connected(self.positions, self.triangles)


def _array(name: str, value: Any) -> Numbers:
    array = numbers_in(value)
    if array is None:
        raise SceneError(str(refuse(f"Mesh {name}", "an array of numbers", value)))
    return array


def _floats(array: Numbers, dtype: type[F]) -> NDArray[F]:
    with np.errstate(all="ignore"):  # what is beyond float32 becomes infinite
        return np.ascontiguousarray(array, dtype=dtype)


def _affine(name: str, value: Any) -> Array:
    matrix = as_floats(value, (4, 4))
    if matrix is None or not np.isfinite(matrix).all():
        raise refuse(name, "a finite matrix (4, 4)", value)
    if np.abs(matrix[3] - (0.0, 0.0, 0.0, 1.0)).max() > 1e-6:
        raise SettingsError(f"{name} must be affine: its last row is {matrix[3].tolist()}, not [0, 0, 0, 1]")
    return matrix


@dataclass(frozen=True, eq=False, repr=False)
class Node(Settings):
    """One placement of a mesh: instances share the Mesh object.

    Parameters
    ----------
    name : str
    mesh : Mesh
    world_from_mesh : (4, 4) float64
    casts, receives : bool
        Whether it darkens what lies behind it, and whether others darken it.
    catches : bool
        It shows nothing but the shadow that falls on it: black, its alpha 1 - (light with shadow) / (light without), of luminances.
    """

    refusal = SceneError

    name: str = setting(text(), help="need not be unique")
    mesh: Mesh = setting(instance(Mesh), help="what is placed; nodes may share it")
    world_from_mesh: Array = setting(_affine, help="(4, 4) placement")
    casts: bool = setting(flag(), True, help="it darkens what lies behind it")
    receives: bool = setting(flag(), True, help="others darken it")
    catches: bool = setting(flag(), False, help="it shows nothing but the shadow that falls on it")

    __repr__ = summary.node_line

    @property
    def label(self) -> str:
        """What messages call it."""
        return f"Node {shown(self.name)}"


@dataclass(frozen=True, eq=False, repr=False)
class Scene(Settings):
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
        If there is nothing to render, or its places overflow.
    """

    refusal = SceneError

    nodes: tuple[Node, ...] = setting(several(instance(Node), "Node", 10**8), help="what is drawn")
    camera: Camera = setting(optional(instance(Camera), "frames the scene"), None, help="the eye")
    lights: tuple[Light, ...] = setting(optional(LIGHTS, "one sun"), None, help="what lights it")
    name: str = setting(text(), "scene", help="what messages and files call it")

    __repr__ = summary.scene_line
    _repr_html_ = summary.scene_html

    def __post_init__(self) -> None:
        super().__post_init__()
        if not any(len(node.mesh.triangles) for node in self.nodes):
            raise SceneError(f"{self.name}: nothing to render, it has no triangles")
        check_place(self.corners, f"{self.name}: ")
        if (self.bounds[0] == self.bounds[1]).all():
            raise SceneError(f"{self.name}: nothing to render, its size is zero at {self.bounds[0].tolist()}")
        if self.camera is None:
            object.__setattr__(self, "camera", default_camera(self.bounds))
        if self.lights is None:
            object.__setattr__(self, "lights", (default_sun(),))

    @cached_property
    def drawn(self) -> NDArray[np.int64]:
        """(N,) which nodes have triangles."""
        counts = np.fromiter((len(node.mesh.triangles) for node in self.nodes), dtype=np.int64, count=len(self.nodes))
        return np.flatnonzero(counts)

    @cached_property
    def boxes(self) -> tuple[Array, Array]:
        """Mesh bounds (N, 2, 3) and world_from_mesh (N, 4, 4) of all nodes that have triangles."""
        nodes = [self.nodes[i] for i in self.drawn.tolist()]
        bounds = np.concatenate([node.mesh.bounds for node in nodes]).reshape(-1, 2, 3)
        return bounds, np.concatenate([node.world_from_mesh for node in nodes]).reshape(-1, 4, 4)

    @cached_property
    def bounds(self) -> Array:
        """(2, 3) least and greatest world corner of all nodes' boxes."""
        columns = [self.corners[..., axis] for axis in range(3)]
        return np.array([[c.min() for c in columns], [c.max() for c in columns]])

    @cached_property
    def corners(self) -> Array:
        """World corners (N, 8, 3) of the boxes."""
        return box_corners(*self.boxes)

    def moved(self, matrices: Mapping[str, Any]) -> Scene:
        """The same scene with some nodes placed anew; meshes, and what the GPU holds of them, are shared.

        Parameters
        ----------
        matrices : mapping from node name to (4, 4) world_from_mesh

        Raises
        ------
        SceneError
                If no node has that name, or a matrix is none.
        """
        if not isinstance(matrices, Mapping):
            raise SceneError(f"moved needs a mapping from node names to matrices, got {shown(matrices)}")
        names = {node.name for node in self.nodes}
        if unknown := set(matrices) - names:
            known = ", ".join(sorted(names)[:8])
            raise SceneError(f"no node is named {', '.join(sorted(map(shown, unknown)))}; the scene has: {known}")
        nodes = tuple(
            replace(node, world_from_mesh=matrices[node.name]) if node.name in matrices else node for node in self.nodes
        )
        return replace(self, nodes=nodes)

    def with_ground(self, catches: bool = False) -> Scene:
        """The scene on a level square plane that touches its lowest point, three times as wide as the scene is large.

        Parameters
        ----------
        catches : bool
            It shows nothing but the shadow, see `Node`.
        """
        nodes = [self.nodes[i] for i in self.drawn.tolist()]
        lowest = min(lowest_of(node.mesh.positions, node.mesh.triangles, node.world_from_mesh) for node in nodes)
        matrix, corners, triangles = ground_under(self.bounds, lowest)
        ground = Mesh(corners, triangles, material=Material(color=(0.7, 0.7, 0.7, 1.0)))
        return replace(self, nodes=(*self.nodes, Node("ground", ground, matrix, catches=catches)))
