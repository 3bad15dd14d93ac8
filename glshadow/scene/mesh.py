"""Meshes and their materials, frozen."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from functools import cached_property
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from glshadow.core.setting import (
    Numbers,
    Settings,
    fits,
    flag,
    instance,
    number,
    numbers_in,
    optional,
    refuse,
    setting,
    shown,
    vector,
)
from glshadow.core.spaces import Array
from glshadow.errors import SceneError
from glshadow.geometry.closed import connected
from glshadow.scene import summary
from glshadow.scene.alpha import alpha_range

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
    """Base colour and alpha; other material properties are not supported.

    Parameters
    ----------
    color : (4,) floats
        Linear RGBA factor, each from 0 to 1.
    texture : (H, W, 4) uint8, optional
        sRGB colour with linear alpha, row 0 at the top (v = 1), multiplied by `color`.
    alpha_mode : AlphaMode
        MASK: fragments below `cutoff` are discarded, in the camera and the caster pass. BLEND: composited over what is behind it, and a
        translucent caster: it tints the light that passes through it by (1 - alpha) and its colour. Where alpha is 0, there is nothing.
        All outputs but the image ignore it, unless nothing of it is transparent.
    double_sided : bool
        Whether both sides are meant to be visible. (Both are always drawn; culling is only used where it makes no difference.)
    transmission : float
        Share of the light that passes through a thin wall, tinted by the base colour, instead of being scattered.
    transmission_map : (H, W, 4) uint8, optional
        Multiplied with `transmission` by its red channel, which is linear; at the same texture coordinates as `texture`.

    Raises
    ------
    SceneError
        For a value that is not allowed.
    """

    refusal = SceneError

    color: tuple[float, float, float, float] = setting(vector(4, 0.0, 1.0), (1.0,) * 4, help="linear RGBA factor")
    texture: NDArray[np.uint8] | None = setting(optional(_pixels, "none"), None, help="sRGB with linear alpha")
    alpha_mode: AlphaMode = setting(instance(AlphaMode), AlphaMode.OPAQUE, help="how alpha is used")
    cutoff: float = setting(number(), 0.5, help="alpha below which fragments of a MASK material are discarded")
    double_sided: bool = setting(flag(), False, help="both sides are meant to be visible")
    transmission: float = setting(number(0.0, 1.0), 0.0, help="share of the light that passes through, tinted")
    transmission_map: NDArray[np.uint8] | None = setting(optional(_pixels, "none"), None, help="its red channel")

    __repr__ = summary.material_line


@dataclass(frozen=True, eq=False, repr=False)
class Mesh:
    """Triangles with one material.

    Parameters
    ----------
    positions : (V, 3) float64
        In the node's coordinate system.
    triangles : (T, 3) int32
        Indices into `positions`, counter-clockwise seen from the front.
    normals : (V, 3) float32, optional
        Unit shading normals; None: flat shading.
    uv : (V, 2) float32, optional
        Texture coordinates, v up: (0, 0) is the bottom left of the texture.
    colors : (V, 4) float32, optional
        Linear RGBA, alpha straight, each from 0 to 1; interpolated, and multiplied with the material's colour and texture.
    material : Material

    Raises
    ------
    SceneError
        For wrong shapes, indices or colours out of range, and used vertices, normals or texture coordinates that are not
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
            raise SceneError("Mesh triangles must be integers: indices of vertices in positions")
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
        """(2, 3) least and greatest corner of the vertices that triangles use; SceneError if there are no triangles."""
        if len(self.triangles) == 0:
            raise SceneError("a mesh without triangles has no bounds")
        used = np.zeros(len(self.positions), dtype=bool)
        used[self.triangles.ravel()] = True
        # numpy reduces columns much faster than rows of three
        columns = [self.positions[used, axis] for axis in range(3)]
        return np.array([[c.min() for c in columns], [c.max() for c in columns]])

    @cached_property
    def alphas(self) -> tuple[float, float]:
        """Least and greatest alpha, as far as the alpha mode blends by it; otherwise 1."""
        return alpha_range(self)

    @property
    def blends(self) -> bool:
        """Whether anything is seen through it."""
        return self.material.transmission > 0.0 or self.alphas[0] < 1.0

    @property
    def unseen(self) -> bool:
        """Whether its alpha is 0 everywhere: it is not drawn and casts no shadow."""
        return self.alphas[1] == 0.0

    @property
    def closed(self) -> bool:
        """Whether the mesh is watertight when welded by exact position, consistently wound, and turned outward in every part.

        Only then is it safe to cull back faces: they are not visible from outside.
        """
        return self._connected[1]

    @property
    def neighbours(self) -> NDArray[np.uint32]:
        """(T, 3) the triangle across each edge ab, bc, ca, welded by exact position; `glshadow.geometry.adjacency` has its flags."""
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
    with np.errstate(all="ignore"):  # values beyond float32 become infinite
        return np.ascontiguousarray(array, dtype=dtype)
