"""Textures: pixels, and how they are placed on a surface and filtered."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshadow.core.setting import Settings, as_floats, one_of, optional, refuse, setting, whole
from glshadow.core.spaces import Array
from glshadow.errors import SceneError, SettingsError

REPEAT, CLAMP, MIRROR = WRAPS = ("repeat", "clamp", "mirror")
LINEAR, NEAREST = MAGNIFY = ("linear", "nearest")
MINIFY = (
    "linear mipmap linear",
    "linear mipmap nearest",
    "nearest mipmap linear",
    "nearest mipmap nearest",
    *MAGNIFY,
)


def _wraps(name: str, value: Any) -> tuple[str, str]:
    pair = (value, value) if isinstance(value, str) else value
    if isinstance(pair, tuple | list) and len(pair) == 2:
        try:
            first, second = (one_of(*WRAPS)(name, each) for each in pair)
            return first, second
        except SettingsError:
            pass
    raise refuse(name, f"one of {', '.join(map(repr, WRAPS))}, or a pair of them, along u and v", value)


def _affine(name: str, value: Any) -> Array:
    matrix = as_floats(value, (3, 3))
    if matrix is None or not np.isfinite(matrix).all() or (matrix[2] != (0.0, 0.0, 1.0)).any():
        raise refuse(name, "a finite matrix (3, 3) whose last row is 0, 0, 1", value)
    return matrix


@dataclass(frozen=True, eq=False)
class Sampler(Settings):
    """How a texture is placed on a surface and filtered.

    Parameters
    ----------
    wrap : str or pair of str
        Outside 0..1, along u and v: "repeat", "clamp" (the texels at the border) or "mirror" (repeated, every second copy mirrored).
    magnify : str
        Between texels: "linear" or "nearest". Alpha tests use it at any distance.
    minify : str
        Where texels are smaller than pixels: "linear", "nearest", or, of the mip levels, the words that OpenGL joins by MIPMAP, such as
        "linear mipmap linear".
    uv_set : int
        The texture coordinates that it is placed by: 0 is `Mesh.uv`, 1 is `Mesh.second_uv`.
    transform : (3, 3) float64, optional
        Applied to these coordinates, as columns (u, v, 1).
    """

    refusal = SceneError

    wrap: tuple[str, str] = setting(_wraps, (REPEAT, REPEAT), help="outside 0..1: repeat, clamp or mirror")
    magnify: str = setting(one_of(*MAGNIFY), LINEAR, help="between texels: linear or nearest")
    minify: str = setting(one_of(*MINIFY), MINIFY[0], help="where texels are smaller than pixels")
    uv_set: int = setting(whole(0, 1), 0, help="set of texture coordinates")
    transform: Array | None = setting(optional(_affine, "none"), None, help="applied to the texture coordinates")

    @property
    def filtering(self) -> tuple[str, str, str, str]:
        """What the driver is told: wrap along u and v, magnify, minify."""
        return (*self.wrap, self.magnify, self.minify)

    def place(self, uv: NDArray[np.float32] | None, second: NDArray[np.float32] | None) -> NDArray[np.float32] | None:
        """Coordinates (V, 2) in the texture, of a mesh's two sets; None if the mesh does not have the set."""
        chosen = second if self.uv_set else uv
        if chosen is None or self.transform is None:
            return chosen
        with np.errstate(all="ignore"):
            placed = chosen.astype(np.float64) @ self.transform[:2, :2].T + self.transform[:2, 2]
            return np.asarray(placed, dtype=np.float32)

    def indices(self, texels: NDArray[np.int64], size: int, axis: int) -> NDArray[np.int64]:
        """Texel indices of any value, wrapped into 0..size - 1 along u (axis 0) or v (axis 1). Twin: glsl/lib/mask.glsl"""
        if self.wrap[axis] == CLAMP:
            return np.clip(texels, 0, size - 1)
        if self.wrap[axis] == REPEAT:
            return texels % size
        turned = texels % (2 * size)
        return np.minimum(turned, 2 * size - 1 - turned)


def pixels_rule(name: str, value: Any) -> NDArray[np.uint8]:
    """Rule: the pixels of a texture."""
    if isinstance(value, np.ndarray) and not np.ma.isMaskedArray(value) and value.dtype == np.uint8:
        pixels: NDArray[np.uint8] = np.asarray(value)
        if pixels.ndim == 3 and pixels.shape[2] == 4 and pixels.size:
            return pixels
    raise refuse(name, "an array (H, W, 4) of uint8", value)


def sampler_rule(name: str, value: Any) -> Sampler:
    """Rule: a Sampler."""
    if not isinstance(value, Sampler):
        raise refuse(name, "a Sampler", value)
    return value


@dataclass(frozen=True, eq=False, repr=False)
class Texture(Settings):
    """Pixels of a material's map, and how they are sampled.

    Parameters
    ----------
    pixels : (H, W, 4) uint8
        Row 0 at the top (v = 1).
    sampler : Sampler
    """

    refusal = SceneError

    pixels: NDArray[np.uint8] = setting(pixels_rule, help="(H, W, 4) uint8")
    sampler: Sampler = setting(sampler_rule, Sampler(), help="how they are placed and filtered")

    def __repr__(self) -> str:
        return f"Texture({self.pixels.shape[1]} x {self.pixels.shape[0]})"


def texture_rule(name: str, value: Any) -> Texture:
    """Rule: a texture, or its pixels alone."""
    if isinstance(value, Texture):
        return value
    try:
        return Texture(pixels_rule(name, value))
    except SettingsError:
        raise refuse(name, "a Texture or an array (H, W, 4) of uint8", value) from None
