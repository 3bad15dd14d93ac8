"""Meshes and their materials, frozen."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from functools import cached_property
from typing import Any, ClassVar, TypeVar

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
from glshadow.scene.texture import Sampler, Texture, pixels_rule, sampler_rule, texture_rule

F = TypeVar("F", bound=np.floating[Any])


class AlphaMode(Enum):
    """glTF's alphaMode."""

    OPAQUE = "OPAQUE"
    MASK = "MASK"
    BLEND = "BLEND"


ROUGHEST = 1.0 - 0.5 / 254.0
"""Least roughness that counts as 1: the surface buffer stores it in 254 steps."""
MOST = 65408.0
"""Largest emission that the surface buffer stores."""
MAPS = ("metallic_roughness_map", "normal_map", "occlusion_map", "emission_map")
"""A material's textures beside that of its base colour."""
_MAP = optional(texture_rule, "none")


@dataclass(frozen=True, eq=False, repr=False)
class Material(Settings):
    """How a surface reflects and emits light: glTF's metallic-roughness model, whose terms these are.

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
        Whether both sides are meant to be visible: back faces are then drawn even where that makes no difference.
    transmission : float
        Share of the light that passes through a thin wall, tinted by the base colour, instead of being scattered.
    transmission_map : (H, W, 4) uint8, optional
        Multiplied with `transmission` by its red channel, which is linear; placed and filtered as `texture`.
    sampler : Sampler
        How `texture` is placed and filtered.
    cull_back_faces : bool
        Whether the camera sees through triangles from behind, as glTF demands of what is not double-sided. They cast shadows as others do.
    metallic : float
        From 0 to 1.
    roughness : float or None
        From 0 to 1. None: matte, reflects by Lambert's law alone (of a metal: 1). All else also by GGX.
    metallic_roughness_map : Texture or pixels, optional
        Factors of roughness (green) and metallic (blue).
    normal_map : Texture or pixels, optional
        Shading normals in tangent space: red along u, green along v, blue outwards. Shadows fall on the triangles as they are.
    normal_scale : float
        Factor of the map's red and green.
    occlusion_map : Texture or pixels, optional
        Share of the ambient light that arrives (red). `occlusion_strength`, from 0 to 1: how much of the map applies.
    emission : (3,) floats
        Linear RGB that the surface emits; it lights nothing else.
    emission_map : Texture or pixels, optional
        sRGB factor of it.
    unlit : bool
        Whether the surface emits its base colour and reflects nothing.

    Raises
    ------
    SceneError
        For a value that is not allowed.
    """

    refusal = SceneError

    color: tuple[float, float, float, float] = setting(vector(4, 0.0, 1.0), (1.0,) * 4, help="linear RGBA factor")
    texture: NDArray[np.uint8] | None = setting(optional(pixels_rule, "none"), None, help="sRGB with linear alpha")
    alpha_mode: AlphaMode = setting(instance(AlphaMode), AlphaMode.OPAQUE, help="how alpha is used")
    cutoff: float = setting(number(), 0.5, help="alpha below which fragments of a MASK material are discarded")
    double_sided: bool = setting(flag(), False, help="both sides are meant to be visible")
    transmission: float = setting(number(0.0, 1.0), 0.0, help="share of the light that passes through, tinted")
    transmission_map: NDArray[np.uint8] | None = setting(optional(pixels_rule, "none"), None, help="its red channel")
    sampler: Sampler = setting(sampler_rule, Sampler(), help="how the texture is placed and filtered")
    cull_back_faces: bool = setting(flag(), False, help="the camera sees through triangles from behind")
    metallic: float = setting(number(0.0, 1.0), 0.0, help="share of a metal")
    roughness: float | None = setting(optional(number(0.0, 1.0), "matte"), None, help="of the surface's reflection")
    metallic_roughness_map: Texture | None = setting(_MAP, None, help="roughness (green) and metallic (blue)")
    normal_map: Texture | None = setting(_MAP, None, help="shading normals in tangent space")
    normal_scale: float = setting(number(-MOST, MOST), 1.0, help="factor of the normal map's red and green")
    occlusion_map: Texture | None = setting(_MAP, None, help="share of the ambient light (red)")
    occlusion_strength: float = setting(number(0.0, 1.0), 1.0, help="how much of the occlusion map applies")
    emission: tuple[float, float, float] = setting(vector(3, 0.0, MOST), (0.0,) * 3, help="linear RGB that it emits")
    emission_map: Texture | None = setting(_MAP, None, help="sRGB factor of the emission")
    unlit: bool = setting(flag(), False, help="emits its base colour and reflects nothing")

    @property
    def matte(self) -> bool:
        """Whether it reflects by Lambert's law alone."""
        plain = self.metallic == 0.0 and self.metallic_roughness_map is None
        return self.unlit or (plain and self.roughness is None)

    @property
    def rough(self) -> bool:
        """Whether it is not matte, but as rough as can be, and not metallic: its reflection is a simpler formula."""
        plain = self.metallic == 0.0 and self.metallic_roughness_map is None
        return not self.unlit and plain and self.roughness is not None and self.roughness >= ROUGHEST

    @property
    def emits(self) -> bool:
        """Whether it emits light."""
        return self.unlit or any(self.emission)

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
    second_uv : (V, 2) float32, optional
        A second set of texture coordinates, for samplers of `uv_set` 1.
    tangents : (V, 4) float32, optional
        For the normal map: unit vectors along u, and in w the sign (1 or -1) of cross(normal, tangent) along v. None: derived for each
        triangle from its texture coordinates.

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
    second_uv: NDArray[np.float32] | None = None
    tangents: NDArray[np.float32] | None = None

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
        for name, columns in (("normals", 3), ("uv", 2), ("colors", 4), ("second_uv", 2), ("tangents", 4)):
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

    element: ClassVar[str] = "triangle"  # its elements' name, in the singular

    @property
    def count(self) -> int:
        """Number of elements that are drawn: of triangles."""
        return len(self.triangles)

    def lowest(self, matrix: Array) -> float:
        """Least world y of a node with this matrix, from its vertices: under a rotation its box would be too large."""
        used = self.positions[np.unique(self.triangles)]
        return float((used @ matrix[1, :3]).min() + matrix[1, 3])

    def bounds_for(self, matrix: Array) -> Array:
        """Bounds in mesh space, of a node with this matrix; the same for all."""
        return self.bounds

    @cached_property
    def placed_uv(self) -> NDArray[np.float32] | None:
        """(V, 2) coordinates in the material's base colour texture and transmission map; None if there is neither, or no coordinates."""
        material = self.material
        mapped = material.texture is not None or (material.transmission > 0.0 and material.transmission_map is not None)
        return material.sampler.place(self.uv, self.second_uv) if mapped else None

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


def sampler_of(material: Material, name: str) -> Sampler:
    """The sampler of the base colour's `texture`, which is the transmission map's too, or of one of MAPS."""
    if name in ("texture", "transmission_map"):
        return material.sampler
    sampler: Sampler = getattr(material, name).sampler
    return sampler
