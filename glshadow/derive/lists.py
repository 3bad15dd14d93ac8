"""The grid of a light's per-cell triangle lists, and the error bound of distances to triangle planes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from glshadow.core.spaces import Array, rigid_inverse, view_axes
from glshadow.geometry.fitting import minimum_rectangle
from glshadow.lights import Light
from glshadow.shadows.view import Projection

# Cells along a side of the fine grid: of one grid, or of each face's.
CELLS: dict[Projection, int] = {"orthographic": 512, "perspective": 512, "cube": 256}
RATIO = 16  # fine cells along a side of a coarse one
MOST_DOUBLINGS = 2  # of the number of cells, for many capsules
MOST = 256  # most fine cells of one triangle; a larger one is sorted into coarse cells
LEAST_CELLS = 32  # two coarse cells along a side
_GROWN = 1.0005
_FAR_RADII = 4.0  # radii of the light to the nearest caster: beyond, one grid is enough
_FAR_COSINE = 0.5  # casters within 60 degrees of the axis: tangents to 1.7
_UNIT = 2.0**-24  # float32's relative rounding


@dataclass(frozen=True, eq=False)
class ListGrid:
    """The grid of a light's triangle lists. It depends on the casters and the light, not on the camera.

    Parameters
    ----------
    projection : {"orthographic", "perspective", "cube"}
        A point light far from all casters has a single perspective grid, like a spot light.
    view_from_world : (4, 4) float64
        Rigid: a spot's view; a directional light's view about the centre of the casters; world axes for the six faces of a point light.
    window : (4,) floats
        Left, right, bottom, top: world units for a directional light, else tangents.
    cells : int
        Along a side of the fine grid.
    """

    projection: Projection
    view_from_world: Array
    window: tuple[float, float, float, float]
    cells: int

    @property
    def faces(self) -> int:
        """Number of faces of the grid: 6 or 1."""
        return 6 if self.projection == "cube" else 1

    @property
    def cells_from_window(self) -> tuple[float, float, float, float]:
        """(x, y, z, w) with fine cell = xy or tangent * (x, y) + (z, w)."""
        left, right, bottom, top = self.window
        x, y = self.cells / (right - left), self.cells / (top - bottom)
        return (x, y, -left * x, -bottom * y)


def list_grid(light: Light, casters: Array, halvings: int = 0, receivers: Array | None = None) -> ListGrid:
    """The grid of a light; for an area light large enough for all of its shadow.

    Parameters
    ----------
    casters : (K, 3) float64
        World points whose convex hull contains all casters.
    halvings : int
        How often the default number of cells is halved; negative: doubled.
    receivers : (K, 3) float64, optional
        The same for everything visible; the casters if None.
    """
    seen = casters if receivers is None else receivers
    if light.at_infinity:
        # numpy reduces columns much faster than rows of three
        middle = 0.5 * np.array([x.min() + x.max() for x in casters.T])
        axes = light.disc_axes
        depth = max(0.0, float(((casters - middle) @ axes[2]).max() - ((seen - middle) @ axes[2]).min()))
        spread = light.source_radius * depth
        return _grid("orthographic", axes, middle, (casters - middle) @ axes[:2].T, halvings, spread)
    position, edge = np.asarray(light.place[:3]), light.edge
    offset = casters - position
    if light.axis is None:  # towards the casters
        axes = view_axes(_unit_or_x(0.5 * (offset.min(axis=0) + offset.max(axis=0))))
    else:
        axes = view_axes(np.asarray(light.axis))
    local = offset @ axes.T
    nearest = float(-local[:, 2].max())
    # so far away that no caster comes near the light's plane
    far = nearest > _FAR_RADII * light.source_radius
    if far and (local[:, 2] < -_FAR_COSINE * np.sqrt((local * local).sum(axis=1))).all():
        tangents = local[:, :2] / -local[:, 2:]
        spread = local_light_spread(light.source_radius, tangents, nearest, float(((seen - position) @ -axes[2]).max()))
        if np.abs(tangents).max() + spread <= edge:
            return _grid("perspective", axes, position, tangents, halvings, spread)
        low, high = np.clip([tangents.min(axis=0), tangents.max(axis=0)], -edge, edge)
        if (low < high).all():
            window = _grown(np.stack([low - spread, high + spread]))
            return ListGrid("perspective", rigid_inverse(axes, position), window, _cells("perspective", halvings))
    if light.projection == "cube" or light.source_radius > 0.0:
        window = (-1.0, 1.0, -1.0, 1.0)
        return ListGrid("cube", rigid_inverse(np.eye(3), position), window, _cells("cube", halvings))
    return ListGrid(
        "perspective", rigid_inverse(axes, position), (-edge, edge, -edge, edge), _cells("perspective", halvings)
    )


def _cells(projection: Projection, halvings: int) -> int:
    return CELLS[projection] << MOST_DOUBLINGS >> MOST_DOUBLINGS + halvings


def doublings(count: int, share: float) -> int:
    """How often to double the number of cells for many balls and tubes: to about four cells for each, of at least an eighth of one.

    Parameters
    ----------
    count : int
    share : float
        Mean diameter, as a share of the extent of all casters.
    """
    if count == 0:
        return 0
    wanted = np.log2(np.sqrt(4.0 * count) / CELLS["orthographic"])
    most = np.log2(8.0 / (CELLS["orthographic"] * max(share, 1e-9)))
    return int(np.clip(min(np.round(wanted), np.floor(most)), 0, MOST_DOUBLINGS))


def _unit_or_x(vector: Array) -> Array:
    """A vector scaled to length 1; the x axis for a zero vector."""
    length = float(np.sqrt(vector @ vector))
    return vector / length if length > 0.0 else np.array([1.0, 0.0, 0.0])


def local_light_spread(radius: float, tangents: Array, nearest: float, deepest: float) -> float:
    """By how much a light's radius moves shadows, in tangents: of a caster at the least depth, on receivers at the largest."""
    slant = float(np.sqrt(1.0 + (tangents * tangents).sum(axis=1).max()))
    return (
        radius * slant * max(1.0 - nearest / max(deepest, nearest), 0.0) / (nearest - radius) if radius > 0.0 else 0.0
    )


def _grid(projection: Projection, axes: Array, origin: Array, points: Array, halvings: int, spread: float) -> ListGrid:
    """The grid on the smallest rectangle around points (K, 2) of the window, enlarged by `spread`; its axes are rotated into the view's."""
    angle, rectangle = minimum_rectangle(points)
    rectangle = rectangle + spread * np.array([[-1.0], [1.0]])
    cosine, sine = np.cos(angle), np.sin(angle)
    axes = np.array([[cosine, sine, 0.0], [-sine, cosine, 0.0], [0.0, 0.0, 1.0]]) @ axes
    if projection == "orthographic":  # centred, so that coordinates stay small
        origin = origin + rectangle.mean(axis=0) @ axes[:2]
        rectangle = rectangle - rectangle.mean(axis=0)
    return ListGrid(projection, rigid_inverse(axes, origin), _grown(rectangle), _cells(projection, halvings))


def _grown(rectangle: Array) -> tuple[float, float, float, float]:
    """Left, right, bottom, top of corners (K, 2), slightly enlarged, so that nothing touches the border."""
    low, high = rectangle.min(axis=0), rectangle.max(axis=0)
    middle, half = 0.5 * (low + high), 0.5 * (high - low)
    half = _GROWN * np.maximum(half, max(1e-6 * float(half.max()), 1e-6 * float(np.abs(middle).max()), 1e-300))
    (left, bottom), (right, top) = middle - half, middle + half
    return (float(left), float(right), float(bottom), float(top))


def distance_bound(world: float, local: float) -> tuple[float, float]:
    """Bound of the apparent distance of a receiver from the plane of another, coplanar triangle: (a, b) with |gap| <= a + b (|p| + |q|).

    p and q are the receiver's offsets from the corners to which its own plane and the other's are relative, u = 2^-24, and the gap
    is dot(normal, q). A ray from the receiver meets the other triangle, both being parts of one plane:

    - vertices are rounded to float32 relative to the scene's origin, then in the light's frame: each is off by at most
      sqrt(3) u (world + local), and so are both triangles where the ray meets them: 2 sqrt(3) u (world + local);
    - the receiver, put on its plane by a Newton step, is rounded once more: sqrt(3) u local, and is off its plane by 6 u |p|: rounding
      of the normal (1), of the axes that turn normal and vertices, which are not quite orthogonal (2), of the offset (1) and of the three
      products and two sums (2, in the sum of their sizes);
    - the gap is rounded alike: 6 u |q|.

    Triangles thinner than the rounding of their vertices, whose normals are arbitrary, are not covered.

    Parameters
    ----------
    world : float
        Largest coordinate of a vertex relative to the scene's origin.
    local : float
        Largest coordinate of a vertex, or of the eye, in the light's frame.
    """
    root = float(np.sqrt(3.0))
    return _UNIT * (2.0 * root * world + 3.0 * root * local), 6.0 * _UNIT


HUGE_SHARE = (2.0 * 3.0**0.5 * 3.0**0.5 + 3.0 * 3.0**0.5) * _UNIT
"""Growth of the bound with a vertex's coordinate beyond those it is made for: `distance_bound` with world = sqrt(3) local."""


def facets(corners: Array, world: Array, axes: Array) -> Array:
    """Facets as pass/lists.comp writes them: (T, 3, 4) vertices in the light's frame, and in the last column the unit normal.

    Parameters
    ----------
    corners : (T, 3, 3) float64
        Vertices in the light's frame, already rounded to float32.
    world : (T, 3, 3) float64
        The same in world axes, as float32. Normals are computed from these, so that the rounding of rotated vertices does not decide which
        side of a triangle a grazing directional light sees.
    axes : (3, 3) float64
        The light's axes, float32 values.
    """
    normal = np.cross(world[:, 1] - world[:, 0], world[:, 2] - world[:, 0])
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    normal = normal / np.where(length > 0.0, length, 1.0) @ axes.T
    return np.concatenate([corners, normal[:, :, None]], axis=2)
