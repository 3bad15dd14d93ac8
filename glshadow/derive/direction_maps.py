"""The maps of many directions of light: their views, which of them each pixel samples, and the rows of numbers that the shader reads."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from glshadow.core.spaces import Array, ClipSpace, rigid_inverse, view_axes
from glshadow.lights import Light
from glshadow.shadows.bias import FACET_SLOPE
from glshadow.shadows.view import ShadowView

SETS, MANY_SETS = 4, 16
"""Sets of maps: each pixel of a block of 2 x 2, or 4 x 4, samples one."""
MANY = 1024
"""Directions of equal weight that are divided into `MANY_SETS`."""
FINE = 1 << 16
"""Pixels of an image from which on maps are divided into sets: in a smaller one a mean over neighbours would blur, and all cost little."""
_FEWEST = 64  # directions that are divided into sets
_HEAVY = 2.0
"""A direction that stands for more than this many times the mean is sampled by every pixel."""
REACH = 0.5 * np.sqrt(2.0)
"""Largest distance of a texel's centre from a receiver that it represents, texels."""
MOST_SLACK = 2.0
"""Texels: where the light grazes the surface, the slack of a facet would grow without bound."""
_TURNS = np.radians(15.0) * np.arange(6)
_CORNERS = 512  # corners: of more, their box is covered
_GUARD = 1  # texels without casters along a tile's border: receivers beyond it find them


@dataclass(frozen=True, eq=False)
class DirectionViews:
    """Views of one light's directions.

    Parameters
    ----------
    views : tuple of ShadowView
        One for each direction, all about `middle`, from -radius to radius.
    middle, radius : (3,) float64, float
        Of a ball that holds all casters; world.
    side : int
        Tiles in a row of the atlas, a power of two.
    """

    views: tuple[ShadowView, ...]
    middle: Array
    radius: float
    side: int

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of the atlas, texels."""
        resolution = self.views[0].resolution
        return (self.side * resolution, -(-len(self.views) // self.side) * resolution)

    @property
    def texel(self) -> float:
        """Longest edge of a texel of any map, world units."""
        return max(max(view.texel) for view in self.views)


def direction_views(lights: Sequence[Light], casters: Array, clip: ClipSpace, resolution: int) -> DirectionViews:
    """Views that cover all casters, whatever the camera sees.

    Parameters
    ----------
    lights : sequence of Light
        Directional, without size.
    casters : (K, 3) float64
        World corners of what casts.
    """
    low, high = casters.min(axis=0), casters.max(axis=0)
    middle = 0.5 * (low + high)
    corners = (
        casters if len(casters) <= _CORNERS else np.stack(np.meshgrid(*zip(low, high, strict=True)), -1).reshape(-1, 3)
    )
    corners = corners - middle
    radius = 1.001 * max(float(np.linalg.norm(corners, axis=1).max()), 1e-300)
    side = 1 << int(np.ceil(0.5 * np.log2(len(lights))))
    inner = resolution / max(resolution - 2 * _GUARD, 1)
    views = []
    for number, light in enumerate(lights):
        axes = view_axes(-np.asarray(light.place[:3]))
        x, y = (corners @ axes[:2].T).T
        cosine, sine = np.cos(_TURNS)[:, None], np.sin(_TURNS)[:, None]
        flat = np.stack([cosine * x + sine * y, cosine * y - sine * x], axis=-1)  # (turns, corners, 2)
        least, most = flat.min(axis=1), flat.max(axis=1)
        turn = int((most - least).prod(axis=1).argmin())
        c, s = np.cos(_TURNS[turn]), np.sin(_TURNS[turn])
        axes = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]]) @ axes
        centre = 0.5 * (least[turn] + most[turn])
        half = inner * np.maximum(0.5 * (most[turn] - least[turn]), 1e-6 * radius)
        (left, bottom), (right, top) = (centre - half).tolist(), (centre + half).tolist()
        tile = (number % side * resolution, number // side * resolution)
        views.append(
            ShadowView(
                "orthographic", 0, rigid_inverse(axes, middle), (left, right, bottom, top), -radius, radius, clip,
                resolution, tile,
            )
        )  # fmt: skip
    return DirectionViews(tuple(views), middle, radius, side)


def sets_of(
    lights: Sequence[Light], per_channel: bool, fine: bool, most: int | None = None
) -> tuple[NDArray[np.int64], Array]:
    """Indices (S, L) of the directions that each set samples, and their factors (S, L); what is left over has the factor 0.

    The factors of all sets together are 1 for each direction. `fine`: the image is large enough for several sets; otherwise each pixel
    samples about `most` directions, evenly chosen from those of a light that does not differ by channel.
    """
    count = len(lights)
    step = count // min(most or count, count) if not fine and not per_channel else 1
    sets = MANY_SETS if count >= MANY and count % MANY_SETS == 0 and not per_channel else SETS
    if not fine or count < _FEWEST or (count % sets and not per_channel):
        index = np.arange(0, count, step)[None]
        return index, np.full(index.shape, count / index.size)
    shares = np.array([max(light.color) for light in lights]) if per_channel else np.ones(count)
    heavy = shares > _HEAVY * shares.mean()
    every, rest = np.flatnonzero(heavy), np.flatnonzero(~heavy)
    length = len(every) + -(-len(rest) // sets)
    index, factor = np.zeros((sets, length), dtype=np.int64), np.zeros((sets, length))
    for number in range(sets):
        own = rest[number::sets]
        index[number, : len(every)], factor[number, : len(every)] = every, 1.0 / sets
        end = len(every) + len(own)
        index[number, len(every) : end], factor[number, len(every) : end] = own, 1.0
    return index, factor


def rows_of(
    found: DirectionViews, lights: Sequence[Light], axes: Array, per_channel: bool, fine: bool, most: int | None = None
) -> NDArray[np.float32]:
    """Rows (S, L, 3 or 4, 4) of lib/directionmaps.glsl, in a frame with axes (3, 3).

    Right and up, each with the texel of `middle`; width and height of a texel in world units, corner of the tile; the colour for which the
    direction stands, if the light differs by channel.
    """
    index, factor = sets_of(lights, per_channel, fine, most)
    rows = np.zeros((len(found.views), 3 + per_channel, 4))
    for row, view, light in zip(rows, found.views, lights, strict=True):
        row[:2, :3] = view.view_from_world[:2, :3] @ axes.T
        left, _, bottom, _ = view.window
        row[:2, 3] = -left / view.texel[0], -bottom / view.texel[1]
        row[2] = *view.texel, *view.tile
        if per_channel:
            row[3, :3] = light.color
    rows = rows[index]
    if per_channel:
        rows[:, :, 3, :3] *= factor[:, :, None]
    return rows.astype(np.float32)


def slack(cosine: Array, texel: Array) -> Array:
    """How far a neighbouring facet may rise above the receiver's plane within a texel, world units: the float64 twin of the snippet.

    A plane tilted by 15 degrees more than the receiver's (`FACET_SLOPE`) rises by REACH (tan(tilt + 15 degrees) - tan(tilt)).
    """
    tilt = np.sqrt(np.maximum(1.0 - cosine**2, 0.0)) / cosine
    rise = FACET_SLOPE * (1.0 + tilt**2) / np.maximum(1.0 - FACET_SLOPE * tilt, 1e-3)
    return np.asarray(texel * np.minimum(REACH * rise, MOST_SLACK))
