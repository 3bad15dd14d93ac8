"""Triangle lists: the grid in which a light sorts its casters, and the bound below which a distance is rounding."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from glshadow.core.fit import minimum_rectangle
from glshadow.core.lights import DirectionalLight, Light, PointLight, SpotLight
from glshadow.core.spaces import Array, rigid_inverse, view_axes
from glshadow.core.view import Kind, kind_of

# Cells along a side of the fine grid: one grid for a sun or a spot, one per face for a point light.
CELLS: dict[Kind, int] = {"directional": 512, "spot": 512, "point": 256}
RATIO = 16  # fine cells along a side of a coarse one
LEAST_CELLS = 32  # two coarse cells along a side
_GROWN = 1.0005  # window of a sun: its casters, and a little, so that none of them touches the border
_UNIT = 2.0**-24  # float32's relative rounding


@dataclass(frozen=True, eq=False)
class ListGrid:
    """The grid of a light's triangle lists. Follows from the scene and the light, not from the camera.

    Parameters
    ----------
    kind : str
        Which light: decides the projection.
    view_from_world : (4, 4) float64
        Rigid: a spot's view, a sun's about the middle of what casts; a point light's has world axes.
    half : (2,) floats
        Half the window: world units for a sun, else tangents.
    cells : int
        Along a side of the fine grid.
    """

    kind: Kind
    view_from_world: Array
    half: tuple[float, float]
    cells: int

    @property
    def faces(self) -> int:
        """How many grids there are."""
        return 6 if self.kind == "point" else 1

    @property
    def cells_from_window(self) -> tuple[float, float, float, float]:
        """(x, y, z, w) with fine cell = xy or tangent * (x, y) + (z, w)."""
        middle = 0.5 * self.cells
        return (middle / self.half[0], middle / self.half[1], middle, middle)


def list_grid(light: Light, casters: Array, cells: int) -> ListGrid:
    """The grid of a light.

    Parameters
    ----------
    casters : (K, 3) float64
        World points whose convex hull holds everything that casts.
    cells : int
        Along a side of the fine grid.
    """
    kind = kind_of(light)
    if isinstance(light, PointLight):
        return ListGrid(kind, rigid_inverse(np.eye(3), np.asarray(light.position)), (1.0, 1.0), cells)
    axes = view_axes(np.asarray(light.direction))
    if isinstance(light, SpotLight):
        edge = float(np.tan(np.radians(light.outer_angle)))
        return ListGrid(kind, rigid_inverse(axes, np.asarray(light.position)), (edge, edge), cells)
    assert isinstance(light, DirectionalLight)
    middle = 0.5 * (casters.min(axis=0) + casters.max(axis=0))
    angle, rectangle = minimum_rectangle((casters - middle) @ axes[:2].T)
    cosine, sine = np.cos(angle), np.sin(angle)
    axes = np.array([[cosine, sine, 0.0], [-sine, cosine, 0.0], [0.0, 0.0, 1.0]]) @ axes
    middle = middle + rectangle.mean(axis=0) @ axes[:2]
    size = np.ptp(rectangle, axis=0)
    half = 0.5 * _GROWN * np.maximum(size, max(1e-6 * float(np.ptp(casters, axis=0).max()), 1e-300))
    return ListGrid(kind, rigid_inverse(axes, middle), (float(half[0]), float(half[1])), cells)


def distance_bound(world: float, local: float) -> tuple[float, float]:
    """How far from another triangle's plane a receiver may seem to be that lies on it: (a, b) with |gap| <= a + b (|p| + |q|).

    p and q are the receiver's offsets from the corners that its own plane and the other's are measured from, u = 2^-24, and the gap
    is dot(normal, q). A ray from the receiver meets the other triangle, both being parts of one plane:

    - vertices are rounded to float32 relative to the scene's origin, then in the light's frame: each is off by at most
      sqrt(3) u (world + local), and so are both triangles where the ray meets them: 2 sqrt(3) u (world + local);
    - the receiver, put on its plane by a Newton step, is rounded once more: sqrt(3) u local, and is off its plane by 4 u |p|: rounding
      of the normal (1), of the offset (1) and of the three products and two sums (2, in the sum of their sizes);
    - the gap is rounded alike: 4 u |q|.

    What this does not cover: triangles thinner than their vertices' rounding, whose normals are arbitrary.

    Parameters
    ----------
    world : float
        Largest coordinate of a vertex relative to the scene's origin.
    local : float
        Largest coordinate of a vertex, or of the eye, in the light's frame.
    """
    root = float(np.sqrt(3.0))
    return _UNIT * (2.0 * root * world + 3.0 * root * local), 4.0 * _UNIT


def facets(corners: Array) -> Array:
    """What pass/lists.comp writes of triangles: (T, 3, 4) vertices in the light's frame, and in the last column the unit normal.

    Parameters
    ----------
    corners : (T, 3, 3) float64
        Vertices in the light's frame, already rounded to float32.
    """
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    normal = normal / np.where(length > 0.0, length, 1.0)
    return np.concatenate([corners, normal[:, :, None]], axis=2)
