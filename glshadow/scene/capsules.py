"""Points and lines, drawn as balls and tubes: meshes without triangles whose elements are capsules."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from glshadow.core.setting import fits, numbers_in, refuse, shown
from glshadow.core.spaces import FARTHEST, Array
from glshadow.errors import SceneError
from glshadow.scene.mesh import AlphaMode, Material, Mesh

SAMPLED = 256  # points whose nearest neighbours give the default radius
TUBE_SHARE = 1.0 / 400.0
"""Default radius of lines, as a share of the diagonal of their bounds."""
WHITE = Material()
_BESIDE = 64  # points before and after, along one axis, that are tried first


class Capsules(Mesh):
    """Elements with two ends and a radius: all points not farther than the radius from the segment. A ball has both ends at one point.

    Code that draws triangles finds none here: `triangles` is empty.

    Attributes
    ----------
    ends : (E, 2) int32
        Indices into `positions`.
    radius : (1,) or (E,) float64
        Of all elements, or of each.
    """

    ends: NDArray[np.int32]
    radius: Array

    def __init__(
        self,
        positions: ArrayLike,
        ends: NDArray[np.int32],
        radius: ArrayLike | None,
        colors: ArrayLike | None,
        material: Material,
    ) -> None:
        kind = type(self).__name__
        if not isinstance(material, Material):
            raise SceneError(f"{kind} material must be a Material, got {shown(material)}")
        mapped = material.texture is not None or material.transmission > 0.0
        if mapped or material.alpha_mode is not AlphaMode.OPAQUE or material.emits or not material.matte:
            raise SceneError(
                f"{kind} material must be opaque and matte, without texture and emission, got {shown(material)}"
            )
        points = np.asarray(positions, dtype=np.float64)
        bad = int((~np.isfinite(points).all(axis=1)).sum())
        if bad:
            raise SceneError(f"{bad} of {len(points)} {kind.lower()} have coordinates that are not finite")
        # what all meshes have is checked by Mesh
        object.__setattr__(self, "normals", None)
        object.__setattr__(self, "uv", None)
        object.__setattr__(self, "colors", _four_channels(colors, len(points), kind))
        object.__setattr__(self, "material", material)
        object.__setattr__(self, "positions", points)
        object.__setattr__(self, "triangles", np.zeros((0, 3), dtype=np.int32))
        super().__post_init__()
        object.__setattr__(self, "ends", ends)
        object.__setattr__(self, "radius", self._radii(radius))

    def __post_init__(self) -> None:
        """Nothing: `__init__` has checked the arguments."""

    def _radii(self, given: ArrayLike | None) -> Array:
        kind = type(self).__name__
        found: Any = self.default_radius() if given is None else numbers_in(given)
        if found is None:
            raise SceneError(str(refuse(f"{kind} radius", "a number, or one for each element", given)))
        with np.errstate(all="ignore"):  # numbers beyond float64 become infinite, and are refused
            radii = np.atleast_1d(np.asarray(found, dtype=np.float64))
        if radii.shape not in ((1,), (self.count,)):
            raise SceneError(f"{kind} radius must be one number or {self.count}, got shape {radii.shape}")
        if not (np.isfinite(radii) & (radii > 0.0)).all():
            raise SceneError(f"{kind} radius must be finite and larger than 0, got {shown(given)}")
        return radii

    def default_radius(self) -> float:
        """The radius where none is given."""
        raise NotImplementedError

    @property
    def count(self) -> int:
        """Number of elements."""
        return len(self.ends)

    @cached_property
    def tubes(self) -> bool:
        """Whether some element has two different ends."""
        return bool((self.ends[:, 0] != self.ends[:, 1]).any())

    @cached_property
    def used(self) -> Array:
        """Positions (V, 3) of all ends."""
        used = np.zeros(len(self.positions), dtype=bool)
        used[self.ends.ravel()] = True
        return self.positions if used.all() else self.positions[used]

    @cached_property
    def bounds(self) -> Array:
        """(2, 3) least and greatest corner, the radius included; SceneError if there are no elements."""
        return self.bounds_for(np.eye(4))

    def bounds_for(self, matrix: Array) -> Array:
        """Bounds in mesh space that contain the elements as a node with this matrix draws them."""
        if self.count == 0:
            raise SceneError(f"{type(self).__name__} without elements have no bounds")
        largest = float(self.radius.max()) * radius_scale(matrix)
        if largest == 0.0:
            raise SceneError(f"{type(self).__name__} cannot be flattened: a node's matrix has the determinant 0")
        inverse = np.linalg.pinv(matrix[:3, :3])
        margin = largest * np.linalg.norm(inverse, axis=1)
        columns = [self.used[:, axis] for axis in range(3)]
        return np.array([[c.min() for c in columns] - margin, [c.max() for c in columns] + margin])

    @property
    def closed(self) -> bool:
        """False: there are no faces that could be culled."""
        return False

    def lowest(self, matrix: Array) -> float:
        """Least world y of the elements of a node with this matrix."""
        heights = self.positions @ matrix[1, :3] + matrix[1, 3]
        low = np.minimum(heights[self.ends[:, 0]], heights[self.ends[:, 1]])
        return float((low - self.radius * radius_scale(matrix)).min())


class Points(Capsules):
    """Points, drawn as balls.

    Parameters
    ----------
    positions : (V, 3) float64
        In the node's coordinate system.
    radius : float or (V,) floats, optional
        In the units of the positions. A node's matrix scales it by the cube root of its determinant's size, so that balls stay balls.
        None: half the median distance between a point and its nearest neighbour elsewhere, of 256 points spread over all.
    colors : (V, 3) or (V, 4), optional
        Linear, each from 0 to 1; multiplied with the material's colour. Alpha is ignored: points are opaque.
    material : Material
        Its colour; without texture.

    Raises
    ------
    SceneError
        For wrong shapes, values out of range, coordinates that are not finite, and points that all coincide and have no radius.
    """

    element = "point"

    def __init__(
        self,
        positions: ArrayLike,
        radius: ArrayLike | None = None,
        colors: ArrayLike | None = None,
        material: Material = WHITE,
    ) -> None:
        points = _positions("Points", positions)
        number = np.arange(len(points), dtype=np.int32)
        super().__init__(points, np.stack([number, number], axis=1), radius, colors, material)

    def default_radius(self) -> float:
        """Half the median distance of nearest neighbours."""
        return 0.5 * median_distance(self.positions)


class Lines(Capsules):
    """Line segments, drawn as tubes with round ends.

    Parameters
    ----------
    positions : (V, 3) float64
        In the node's coordinate system.
    segments : (S, 2) ints, optional
        Indices into `positions`; None: one line through all of them.
    radius : float or (S,) floats, optional
        In the units of the positions, scaled as that of `Points`. None: 1/400 of the diagonal of the bounds.
    colors : (V, 3) or (V, 4), optional
        Linear, each from 0 to 1; interpolated along the segments. Alpha is ignored.
    material : Material
        Its colour; without texture.

    Raises
    ------
    SceneError
        For wrong shapes, indices or values out of range, and coordinates that are not finite.
    """

    element = "line segment"

    def __init__(
        self,
        positions: ArrayLike,
        segments: ArrayLike | None = None,
        radius: ArrayLike | None = None,
        colors: ArrayLike | None = None,
        material: Material = WHITE,
    ) -> None:
        points = _positions("Lines", positions)
        super().__init__(points, _segments(segments, len(points)), radius, colors, material)

    def default_radius(self) -> float:
        """A share of the diagonal of the bounds."""
        _check_reach(self.used)
        diagonal = float(np.linalg.norm(np.ptp(self.used, axis=0))) if len(self.used) else 0.0
        if diagonal == 0.0 and self.count:
            raise SceneError("Lines need a radius: all their ends coincide")
        return TUBE_SHARE * diagonal if self.count else 1.0


def _positions(kind: str, value: Any) -> Array:
    points = numbers_in(value)
    if points is None or not fits(points, (None, 3)):
        shape = "" if points is None else f" of shape {points.shape}"
        raise SceneError(f"{kind} positions must be an array of numbers (V, 3), got {shown(value)}{shape}")
    return np.asarray(points, dtype=np.float64)


def _segments(given: Any, count: int) -> NDArray[np.int32]:
    if given is None:
        number = np.arange(count, dtype=np.int32)
        return np.stack([number[:-1], number[1:]], axis=1)
    pairs = numbers_in(given)
    if pairs is None or not fits(pairs, (None, 2)):
        raise SceneError(f"Lines segments must be an array of integers (S, 2), got {shown(given)}")
    if pairs.dtype.kind == "f" and not (pairs == np.floor(pairs)).all():
        raise SceneError("Lines segments must be integers: indices of vertices in positions")
    if pairs.size and (pairs.min() < 0 or pairs.max() >= count):
        worst = int(pairs.max() if pairs.max() >= count else pairs.min())
        raise SceneError(f"segment index {worst} is out of range: the lines have {count} vertices")
    return np.ascontiguousarray(pairs, dtype=np.int32)


def _four_channels(colors: ArrayLike | None, count: int, kind: str) -> Any:
    """Colours with an alpha; what are no numbers as they are, for Mesh to refuse."""
    given = None if colors is None else numbers_in(colors)
    if given is None:
        return colors
    if not (fits(given, (count, 3)) or fits(given, (count, 4))):
        raise SceneError(f"{kind} colors must have shape ({count}, 3) or ({count}, 4), got {given.shape}")
    return given if given.shape[1] == 4 else np.concatenate([given, np.ones((count, 1))], axis=1)


def radius_scale(matrix: Array) -> float:
    """Factor by which a node's matrix (4, 4) scales a radius."""
    return float(np.cbrt(abs(np.linalg.det(matrix[:3, :3]))))


def _check_reach(positions: Array) -> None:
    """Refuse coordinates whose products overflow float64, before a radius is derived from them."""
    far = float(np.abs(positions).max(initial=0.0))
    if far > FARTHEST:
        raise SceneError(f"coordinates up to {far:.3g} are too large, the limit is {FARTHEST:g}: scale them first")


def median_distance(positions: Array) -> float:
    """Median distance between a point and its nearest neighbour at another place, exact for each of some points spread over all.

    Points are sorted along the longest side of their bounds. A neighbour nearer than the best one so far is nearer along this axis too.
    """
    if len(positions) == 0:
        return 1.0
    _check_reach(positions)
    axis = int(np.argmax(np.ptp(positions, axis=0)))
    ordered = positions[np.argsort(positions[:, axis], kind="stable")]
    along = ordered[:, axis]
    chosen = np.unique(np.linspace(0, len(ordered) - 1, min(SAMPLED, len(ordered))).astype(np.int64))
    found = []
    for k in chosen.tolist():
        low, high = max(k - _BESIDE, 0), min(k + _BESIDE + 1, len(ordered))
        nearest = _nearest(ordered[low:high], ordered[k])
        if not np.isfinite(nearest):
            nearest = _nearest(ordered, ordered[k])
        first, last = np.searchsorted(along, (along[k] - nearest, along[k] + nearest))
        found.append(min(nearest, _nearest(ordered[first:last], ordered[k])))
    median = float(np.median(found))
    if not np.isfinite(median):
        raise SceneError("Points need a radius: all of them coincide")
    return median


def _nearest(points: Array, point: Array) -> float:
    """Least distance above 0 of points (K, 3) from a point; infinite if there is none."""
    offset = points - point
    squared = np.einsum("ij,ij->i", offset, offset)
    return float(np.sqrt(np.min(squared, initial=np.inf, where=squared > 0.0)))


def refuse_capsules(scene: Any, what: str) -> None:
    """Raise for a scene with points or lines, for features that know triangles only.

    Raises
    ------
    SceneError
        Names the feature, `what`, and the node.
    """
    for node in scene.nodes:
        if isinstance(node.mesh, Capsules) and node.mesh.count:
            kind = type(node.mesh).__name__.lower()
            raise SceneError(
                f"{scene.name}: {what} does not support {kind}, as {node.label} has: leave them out, or replace them by triangles"
            )
