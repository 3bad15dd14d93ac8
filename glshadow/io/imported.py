"""The result of a reader: nodes, camera, lights, and notes on what was ignored or replaced."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from glshadow.core.cameras import Camera
from glshadow.core.setting import Rule, as_int, refuse, shown
from glshadow.core.spaces import Array
from glshadow.core.srgb import linear_from_srgb
from glshadow.errors import SceneError
from glshadow.lights import Light
from glshadow.scene.mesh import AlphaMode, Material
from glshadow.scene.motion import Motion, moved
from glshadow.scene.nodes import Node

MOST_NOTES = 50  # reported one by one
MOST_LISTED = 12  # cameras in an error
LONGEST = 9  # digits of a camera's number
ALMOST_CLEAR = 25  # alpha, of 255, up to which a texel counts as clear; as far from 255 it counts as opaque
MOST_BETWEEN = 0.1  # share of other texels that the soft edges of a binary mask may have
WIDEST_CONE = 89.0  # degrees from the axis; SpotLight needs less than 90


@dataclass
class Imported:
    """Result of one reader.

    Parameters
    ----------
    nodes : list of Node
    camera : Camera, optional
    lights : list of Light, optional
        None: the source has none, the default light applies.
    notes : list of str
        What was ignored or replaced; each becomes a GlshadowWarning that names the file.
    cameras : dict
        All cameras by name, in the source's order.
    motion : Motion, optional
        How its nodes move.
    no_view : str, optional
        What is wrong with the source's first camera, if it is broken.
    """

    nodes: list[Node] = field(default_factory=list)
    camera: Camera | None = None
    lights: list[Light] | None = None
    notes: list[str] = field(default_factory=list)
    cameras: dict[str, Camera] = field(default_factory=dict)
    motion: Motion | None = None
    no_view: str | None = None

    def at(self, seconds: float) -> None:
        """Place what moves where it is at a time of the chosen animation."""
        if self.motion is None:
            return
        pose = self.motion.source.pose(self.motion.animation, seconds)
        for number, (mesh, matrix) in pose.nodes.items():
            self.nodes[number] = moved(self.nodes[number], mesh, matrix)
        self.cameras, self.lights = dict(pose.cameras), list(pose.lights) or None
        self.camera = next(iter(self.cameras.values()), None)
        self.motion = replace(self.motion, cameras=pose.cameras, lights=pose.lights)

    def camera_named(self, wanted: str | int) -> Camera:
        """A camera by its name or number, also where the number is text.

        Raises
        ------
        SceneError
            Lists the cameras that there are.
        """
        if isinstance(wanted, str) and wanted in self.cameras:
            return self.cameras[wanted]
        number = int(wanted) if isinstance(wanted, int) or (wanted.isdecimal() and len(wanted) < LONGEST) else -1
        if 0 <= number < len(self.cameras):
            return list(self.cameras.values())[number]
        if not self.cameras:
            raise SceneError(f"there is no camera {shown(wanted)}: it has no cameras")
        names = list(self.cameras)[:MOST_LISTED]
        more = ", ..." if len(self.cameras) > len(names) else ""
        known = ", ".join(f"{place}: {shown(name)}" for place, name in enumerate(names))
        raise SceneError(f"there is no camera {shown(wanted)}; it has {known}{more}")


def name_or_number(what: str) -> Rule:
    """Rule: a name, or a number from 0, such as that of a camera."""

    def rule(name: str, value: Any) -> str | int:
        if isinstance(value, str) and value:
            return value
        index = as_int(value)
        if index is None or index < 0:
            raise refuse(name, f"the name or the number of {what}", value)
        return index

    return rule


def shortened(notes: list[str]) -> list[str]:
    """The first notes, and how many more there are."""
    rest = len(notes) - MOST_NOTES
    return notes if rest <= 0 else [*notes[:MOST_NOTES], f"{rest} more of such notes"]


def fans(polygons: ArrayLike) -> NDArray[np.int64]:
    """Triangles (N * (K - 2), 3) of convex polygons (N, K)."""
    corners = np.asarray(polygons, dtype=np.int64)
    first, count = corners[:, 0], corners.shape[1]
    triangles = [np.stack([first, corners[:, k], corners[:, k + 1]], axis=1) for k in range(1, count - 1)]
    return np.stack(triangles, axis=1).reshape(-1, 3)


def reflectance(color: ArrayLike, where: str, notes: list[str]) -> tuple[float, ...]:
    """A base colour clamped to 0..1, the range of reflectance; adds a note if it was outside.

    Raises
    ------
    SceneError
        If it has values that are not finite.
    """
    given = np.asarray(color, dtype=np.float64)
    if not np.isfinite(given).all():
        raise SceneError(f"{where}: its colour must be finite numbers, got {given.tolist()}")
    if (given < 0.0).any() or (given > 1.0 + 1e-6).any():  # rounding to float32 needs no note
        notes.append(f"{where}: its colour ({', '.join(f'{x:g}' for x in given)}) is clipped to 0..1")
    return tuple(np.clip(given, 0.0, 1.0).tolist())


def linear_colors(given: ArrayLike, where: str, notes: list[str]) -> Array:
    """Linear vertex colours (V, 3 or 4) as RGBA (V, 4) in 0..1; notes values outside, and values that are not numbers (then white)."""
    colors = np.asarray(given, dtype=np.float64)
    if colors.ndim != 2 or colors.shape[1] not in (3, 4):
        raise SceneError(f"{where}: colours must have 3 or 4 columns, got shape {colors.shape}")
    result = np.ones((len(colors), 4))
    result[:, : colors.shape[1]] = colors
    lost = ~np.isfinite(result).all(axis=1)
    if lost.any():
        notes.append(
            f"{where}: {int(lost.sum())} of {len(result)} colours are not finite (NaN or infinite): white there"
        )
        result[lost] = 1.0
    beyond = int(((result < 0.0) | (result > 1.0 + 1e-6)).any(axis=1).sum())
    if beyond:
        notes.append(f"{where}: {beyond} of {len(result)} colours are clipped to 0..1")
    return np.clip(result, 0.0, 1.0)


def srgb_colors(given: ArrayLike, where: str, notes: list[str]) -> Array:
    """The same for sRGB colours: bytes, 16-bit integers, or floats in 0..1; alpha is linear."""
    stored = np.asarray(given)
    steps = 65535.0 if stored.dtype == np.uint16 else 255.0 if stored.dtype.kind in "iu" else 1.0
    colors = linear_colors(stored.astype(np.float64) / steps, where, notes)
    colors[:, :3] = linear_from_srgb(colors[:, :3])
    return colors


def rgba(pixels: NDArray[Any]) -> NDArray[np.uint8]:
    """Pixels (H, W, 1 to 4) of bytes, grey or colour, with alpha or without, as (H, W, 4)."""
    result = np.full((*pixels.shape[:2], 4), 255, dtype=np.uint8)
    channels = pixels.shape[2]
    result[..., :3] = pixels[..., :3] if channels >= 3 else pixels[..., :1]
    if channels in (2, 4):
        result[..., 3] = pixels[..., -1]
    return result


def tinted(material: Material, colors: Array | None) -> tuple[Material, NDArray[np.float32] | None]:
    """Material and linear vertex colours (V, 4); a colour shared by all vertices moves to the material."""
    if colors is None:
        return material, None
    if (colors != colors[0]).any():
        return material, colors.astype(np.float32)
    if (colors[0] != 1.0).any():
        material = replace(material, color=tuple((colors[0] * material.color).tolist()))
    return material, None


def used_vertices(triangles: NDArray[np.int64], count: int) -> tuple[NDArray[np.int64] | slice, NDArray[np.int64]]:
    """Indices of those of `count` vertices that triangles use, in order, and the triangles with new indices."""
    if triangles.size < count // 8:  # a small part of a large list: do not process the whole list
        rows, inverse = np.unique(triangles, return_inverse=True)
        return rows, inverse.reshape(triangles.shape).astype(np.int64)
    used = np.zeros(count, dtype=bool)
    used[triangles.ravel()] = True
    if used.all():
        return slice(None), triangles
    return np.flatnonzero(used), (np.cumsum(used) - 1)[triangles]


def used_only(
    positions: Array, triangles: NDArray[np.int64], *attributes: NDArray[Any] | None
) -> tuple[Array, NDArray[np.int64], list[NDArray[Any] | None]]:
    """The same triangles with only the vertices that they use, in their old order; attributes (V, ...) are reduced as well."""
    rows, triangles = used_vertices(triangles, len(positions))
    return positions[rows], triangles, [None if value is None else value[rows] for value in attributes]


def usable_normals(
    positions: Array, triangles: NDArray[np.int64], normals: ArrayLike | None
) -> NDArray[np.float32] | None:
    """Unit normals (V, 3): zero or non-finite ones become the mean face normal; None if no normal is usable."""
    if normals is None or np.shape(normals) != positions.shape:
        return None
    given = np.asarray(normals, dtype=np.float64)
    with np.errstate(all="ignore"):
        length = np.linalg.norm(given, axis=1)
        good = np.isfinite(length) & (length > 1e-6)
        if not good.any():
            return None
        result = given / np.where(good, length, 1.0)[:, None]
        if good.all():
            return result.astype(np.float32)
        corners = positions[triangles]
        faces = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        corner_of = triangles.ravel()
        sums = np.stack([np.bincount(corner_of, np.repeat(faces[:, k], 3), len(positions)) for k in range(3)], axis=1)
        size = np.linalg.norm(sums, axis=1)
        mean = np.where((size > 0)[:, None], sums / np.where(size > 0, size, 1.0)[:, None], (0.0, 0.0, 1.0))
    return np.where(good[:, None], result, mean).astype(np.float32)


def solid(material: Material, colors: NDArray[np.float32] | None = None) -> Material:
    """The material. BLEND becomes OPAQUE if neither material nor vertices are transparent (pyrender and exporters write it so)."""
    if material.alpha_mode is not AlphaMode.BLEND or material.color[3] < 1.0:
        return material
    if colors is not None and (colors[:, 3] < 1.0).any():
        return material
    if material.texture is not None and (material.texture[..., 3] < 255).any():
        return material
    return replace(material, alpha_mode=AlphaMode.OPAQUE)


def of_mtl(diffuse: Array, opacity: float, texture: NDArray[np.uint8] | None) -> Material:
    """The material for OBJ's Kd (taken as linear), d and map_Kd."""
    if texture is not None and not diffuse.any():
        diffuse = np.ones(3)  # exporters that write only the texture leave Kd at zero
    blend = 0.0 < opacity < 1.0  # some exporters write "d 0" for opaque
    return Material(
        color=(*diffuse.tolist(), opacity if blend else 1.0),
        texture=texture,
        alpha_mode=AlphaMode.BLEND if blend else AlphaMode.OPAQUE,
    )


def cut(material: Material, mask: NDArray[np.uint8]) -> Material:
    """The material with the alpha of a mask (H, W): cut out where it is binary but for a few texels at its edges, otherwise blended."""
    base = np.full((1, 1, 4), 255, dtype=np.uint8) if material.texture is None else material.texture
    height, width = max((base.shape[:2], mask.shape), key=np.prod)
    pixels = _resized(base, height, width).copy()
    pixels[..., 3] = _resized(mask, height, width)
    between = float(((mask > ALMOST_CLEAR) & (mask < 255 - ALMOST_CLEAR)).mean())
    binary = between <= MOST_BETWEEN and material.alpha_mode is AlphaMode.OPAQUE
    return replace(material, texture=pixels, alpha_mode=AlphaMode.MASK if binary else AlphaMode.BLEND)


def _resized(pixels: NDArray[np.uint8], height: int, width: int) -> NDArray[np.uint8]:
    """An image of another size, by its nearest pixels."""
    rows, columns = (np.arange(new) * old // new for new, old in ((height, pixels.shape[0]), (width, pixels.shape[1])))
    return pixels if pixels.shape[:2] == (height, width) else pixels[rows[:, None], columns]


def alpha_mode(name: object) -> AlphaMode:
    """Alpha mode by glTF's name; any other name is OPAQUE."""
    return next((mode for mode in AlphaMode if mode.value == name), AlphaMode.OPAQUE)


WHITE = Material()
