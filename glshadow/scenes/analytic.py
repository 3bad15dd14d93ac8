"""Simple scenes whose shadow is known in closed form: references for renderers and the tracer.

y is up, the ground is y = 0; angles in degrees. Ground and camera follow from the given lengths, so that lengths of 1e-6 and 1e7 give
the same image. A point is in shadow iff the open segment from the point to the light meets the caster, and unlit if its normal faces
away from the light.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from glshadow.core.cameras import PerspectiveCamera
from glshadow.core.setting import as_floats, flag, number, optional, refuse, vector, whole
from glshadow.core.spaces import Array, Bools
from glshadow.errors import SettingsError
from glshadow.lights import DirectionalLight, Light, PointLight
from glshadow.scene.mesh import Mesh
from glshadow.scene.nodes import Node, Scene
from glshadow.scenes import shapes
from glshadow.scenes.shapes import Solid

# A point nearer to a caster's surface than this fraction of its size is on it and not shadowed by it: far above
# float64's rounding of a point that was computed on that surface, far below float32's.
ON_SURFACE = 1e-11

# Lengths of a scene, world units: the ground is larger by 1 / tan(LEAST_ELEVATION) and must still be drawn (see scene/checks.py).
SHORTEST, LONGEST, LEAST_ELEVATION = 1e-12, 1e9, 1e-3
LENGTH = number(SHORTEST, LONGEST)
SUBDIVISIONS = whole(0, 9)  # 5 million triangles

Blocked = Callable[[Array, Array, Array], Bools]


@dataclass(frozen=True, eq=False)
class AnalyticScene:
    """A scene with one light and its exact shadow.

    Parameters
    ----------
    scene : Scene
        With a camera that sees the shadow, and one light.
    blocked : callable
        (points (N, 3), unit vectors to the light (N, 3), distances (N,)) -> (N,) bool: whether a caster is in between.
    """

    scene: Scene
    blocked: Blocked

    def exact(self, points_w: ArrayLike, normals_w: ArrayLike = (0.0, 1.0, 0.0)) -> Array:
        """Exact visibility of the light, 1 lit and 0 dark.

        Parameters
        ----------
        points_w : (..., 3) array_like
            World points on the scene's surfaces.
        normals_w : (..., 3) array_like
            Their normals, facing the viewer; for smooth meshes the interpolated ones (`Truth.shading`). The default is correct for points
            on the ground.

        Returns
        -------
        (...) float64

        Raises
        ------
        SettingsError
            For points or normals that are not finite numbers, or not of these shapes.
        """
        points, normals = _points("points_w", points_w), _points("normals_w", normals_w)
        if normals.shape not in (points.shape, (3,)):
            raise SettingsError(f"normals_w must be one normal, or one per point, got {normals.shape}")
        towards, distance = self.scene.lights[0].to_light(points)
        facing = (normals * towards).sum(axis=-1) > 0.0
        dark = self.blocked(points.reshape(-1, 3), towards.reshape(-1, 3), distance.reshape(-1))
        return np.where(facing & ~dark.reshape(points.shape[:-1]), 1.0, 0.0)


def _points(name: str, value: ArrayLike) -> Array:
    array = as_floats(value, (..., 3))
    if array is None or not (np.abs(array) <= LONGEST).all():
        raise refuse(name, f"points (..., 3) of numbers in [{-LONGEST:g}, {LONGEST:g}]", value)
    return array


def wall(elevation: float = 30.0, height: float = 2.0, half: float | None = None) -> AnalyticScene:
    """A thin wall at x = 0 under a directional light: shadow on -height cot(elevation) < x < 0, as wide as the wall.

    `half` is half the wall's width; None: wide enough for the default camera.
    """
    sun, elevation = _sun(elevation)
    height, half = LENGTH("height", height), optional(LENGTH)("half", half)
    reach = height / np.tan(np.radians(elevation))
    half = max(height, 0.25 * reach) if half is None else half
    margin = 0.5 * (height + reach)
    upright = shapes.rectangle((0.0, 0.0, half), (0.0, 0.0, -2.0 * half), (0.0, height, 0.0))
    ground = _ground(-reach - margin, margin, 2.0 * half)
    camera = _camera((-0.5 * reach, 0.0, 0.0), (-0.3, 0.8, 0.6), 1.2 * reach + 3.0 * height)

    def blocked(points: Array, towards: Array, distance: Array) -> Bools:
        t, hit = _plane_crossing(points, towards, distance, 0, 0.0, height)
        hit &= _between(t, points, towards, 1, 0.0, height)
        return hit & _between(t, points, towards, 2, -half, half)

    return AnalyticScene(_scene("wall", {"ground": ground, "wall": upright}, camera, sun), blocked)


def plates(
    gap: float = 0.1, elevation: float = 45.0, half: float = 1.0, lamp_height: float | None = None
) -> AnalyticScene:
    """A thin square plate |x|, |z| <= half, `gap` above the ground and parallel to it.

    Under a directional light its shadow is moved by gap cot(elevation) towards -x; with gap 0 everything is lit. With `lamp_height` the
    light is a point that high above the middle, and the shadow is a square of half-side half * lamp_height / (lamp_height - gap).
    """
    gap, half, lamp_height = (
        number(0.0, LONGEST)("gap", gap),
        LENGTH("half", half),
        optional(LENGTH)("lamp_height", lamp_height),
    )
    sun, elevation = _sun(elevation)
    light = sun if lamp_height is None else _lamp(lamp_height, gap)
    plate = shapes.rectangle((-half, gap, half), (2.0 * half, 0.0, 0.0), (0.0, 0.0, -2.0 * half))
    moved = gap / np.tan(np.radians(elevation)) if lamp_height is None else 0.0
    widest = half if lamp_height is None else half * lamp_height / (lamp_height - gap)
    camera = _camera((-0.5 * moved, 0.0, 0.0), (-0.6, 0.7, 0.4), 2.5 * (widest + moved) + 2.0 * gap)
    ground = _ground(-widest - moved - 2.0 * half, widest + 2.0 * half, widest + 2.0 * half)

    def blocked(points: Array, towards: Array, distance: Array) -> Bools:
        t, hit = _plane_crossing(points, towards, distance, 1, gap, half)
        hit &= _between(t, points, towards, 0, -half, half)
        return hit & _between(t, points, towards, 2, -half, half)

    return AnalyticScene(_scene("plates", {"ground": ground, "plate": plate}, camera, light), blocked)


def sphere(
    elevation: float = 45.0,
    radius: float = 1.0,
    height: float = 3.0,
    lamp_height: float | None = None,
    subdivisions: int = 6,
) -> AnalyticScene:
    """A sphere whose centre is `height` above the ground.

    Under a directional light the shadow is an ellipse with semi-axes radius / sin(elevation) and radius, centred at
    x = -height cot(elevation). With `lamp_height` the light is a point that high above the origin, and the shadow is a disc of radius
    lamp_height * radius / sqrt((lamp_height - height)^2 - radius^2). The mesh is inscribed: its facets are up to
    radius * 0.82 * 4**-subdivisions inside the sphere that `exact` uses.
    """
    radius, height, lamp_height = (
        LENGTH("radius", radius),
        LENGTH("height", height),
        optional(LENGTH)("lamp_height", lamp_height),
    )
    sun, elevation = _sun(elevation)
    light = sun if lamp_height is None else _lamp(lamp_height, height + radius)
    centre = np.array([0.0, height, 0.0])
    positions, triangles = shapes.icosphere(SUBDIVISIONS("subdivisions", subdivisions), radius)
    if lamp_height is None:
        shift, wide = height / np.tan(np.radians(elevation)), radius / np.sin(np.radians(elevation))
    else:
        shift, wide = 0.0, float(lamp_height * radius / np.sqrt((lamp_height - height) ** 2 - radius**2))
    camera = _camera((-0.6 * shift, 0.3 * height, 0.0), (0.25, 0.55, 0.8), 1.3 * shift + 2.5 * wide + 2.0 * height)
    ground = _ground(-shift - 2.0 * wide, 2.0 * wide, 2.0 * wide)
    parts = {"ground": ground, "sphere": (positions + centre, triangles)}

    def blocked(points: Array, towards: Array, distance: Array) -> Bools:
        to_centre = centre - points
        along = (to_centre * towards).sum(axis=1)
        off_axis = np.linalg.norm(to_centre - along[:, None] * towards, axis=1)
        # A point of a facet is inside the sphere: it can only face away from the light, which its normal decides.
        outside = np.linalg.norm(to_centre, axis=1) > radius * (1.0 + ON_SURFACE)
        return np.asarray(outside & (along > 0.0) & (along < distance) & (off_axis < radius))

    return AnalyticScene(_scene("sphere", parts, camera, light, smooth="sphere"), blocked)


def ball(elevation: float = 30.0, radius: float = 1.0, subdivisions: int = 6) -> AnalyticScene:
    """A convex sphere alone: lit iff N.L > 0, so that shadow mapping must not add a shadow."""
    radius, (sun, _) = LENGTH("radius", radius), _sun(elevation)
    positions, triangles = shapes.icosphere(SUBDIVISIONS("subdivisions", subdivisions), radius)
    camera = _camera((0.0, 0.0, 0.0), (0.1, 0.2, 1.0), 3.0 * radius)
    scene = _scene("ball", {"sphere": (positions, triangles)}, camera, sun, smooth="sphere")
    return AnalyticScene(scene, _never_blocked)


def box(
    elevation: float = 30.0, azimuth: float = 30.0, extents: tuple[float, float, float] = (1.0, 2.0, 1.5)
) -> AnalyticScene:
    """A box on the ground: its shadow is the hull of its footprint and of the footprint moved by height cot(elevation)."""
    extents = vector(3, SHORTEST, LONGEST)("extents", extents)
    sun, elevation = _sun(elevation, azimuth)
    low, high = np.array([-0.5, 0.0, -0.5]) * extents, np.array([0.5, 1.0, 0.5]) * extents
    reach = extents[1] / np.tan(np.radians(elevation))
    size = float(max(extents))
    away = np.array([np.asarray(sun.direction)[0], 0.0, np.asarray(sun.direction)[2]])
    away /= max(float(np.linalg.norm(away)), 1e-300)
    camera = _camera(tuple(0.4 * reach * away), (-0.2, 0.75, 1.0), 1.3 * reach + 2.5 * size)
    half = reach + 2.0 * size
    parts = {"ground": _ground(-half, half, half), "box": shapes.box(extents, (0.0, 0.5 * extents[1], 0.0))}

    def blocked(points: Array, towards: Array, distance: Array) -> Bools:
        return _meets_box(points, towards, distance, low, high)

    return AnalyticScene(_scene("box", parts, camera, sun), blocked)


def plane(elevation: float = 45.0, half: float = 5.0) -> AnalyticScene:
    """An empty square plane |x|, |z| <= half: entirely lit, whatever the light's elevation."""
    half, (sun, _) = LENGTH("half", half), _sun(elevation)
    camera = _camera((0.0, 0.0, 0.0), (0.3, 0.6, 0.8), 2.5 * half)
    scene = _scene("plane", {"ground": _ground(-half, half, half)}, camera, sun)
    return AnalyticScene(scene, _never_blocked)


def room(size: float = 2.0, rods: bool = False) -> AnalyticScene:
    """The inside of a cube with a point light in its middle; without `rods` everything is lit.

    The rods are four thin square bars from wall to wall around the light, whose shadows cross the borders between the
    faces of a cube map; each is a box rotated by 45 degrees about z.
    """
    size, rods = LENGTH("size", size), flag()("rods", rods)
    half = 0.5 * size
    lamp = PointLight(position=(0.0, 0.0, 0.0))
    camera = PerspectiveCamera((0.8 * half, 0.6 * half, 0.9 * half), (-0.5 * half, -0.4 * half, -half), fov_y=80.0)
    parts = {"room": shapes.box((size, size, size))}
    thin = 0.02 * size
    low, high = np.array([-0.2 * size, -thin, -0.3 * size]), np.array([0.2 * size, thin, -0.3 * size + 2.0 * thin])
    cosine = np.sqrt(0.5)
    corners = [(s, t) for s in (cosine, -cosine) for t in (cosine, -cosine)]
    turns = [np.array([[s, -t, 0.0], [t, s, 0.0], [0.0, 0.0, 1.0]]) for s, t in corners]
    offset = np.array([0.0, 0.35 * size, 0.0])  # distance from the axis, along each rod's own y
    if rods:
        for number, turn in enumerate(turns):
            positions, triangles = shapes.box(high - low, 0.5 * (low + high) + offset)
            parts[f"rod {number}"] = (positions @ turn.T, triangles)

    def blocked(points: Array, towards: Array, distance: Array) -> Bools:
        dark = np.zeros(len(points), dtype=bool)
        for turn in turns if rods else ():
            dark |= _meets_box(points @ turn, towards @ turn, distance, low + offset, high + offset)
        return dark

    return AnalyticScene(_scene("room", parts, camera, lamp), blocked)


def _never_blocked(points: Array, towards: Array, distance: Array) -> Bools:
    return np.zeros(len(points), dtype=bool)


def _plane_crossing(
    points: Array, towards: Array, distance: Array, axis: int, level: float, size: float
) -> tuple[Array, Bools]:
    """Intersection of rays with the plane coordinate[axis] = level, and whether it is strictly between point and light."""
    step, slope = level - points[:, axis], towards[:, axis]
    crosses = (np.abs(step) > ON_SURFACE * size) & (slope != 0.0)
    t = np.where(crosses, step / np.where(slope == 0.0, 1.0, slope), 0.0)
    return t, np.asarray(crosses & (t > 0.0) & (t < distance))


def _between(t: Array, points: Array, towards: Array, axis: int, low: float, high: float) -> Bools:
    at = points[:, axis] + t * towards[:, axis]
    return np.asarray((at >= low) & (at <= high))


def _meets_box(points: Array, towards: Array, distance: Array, low: Array, high: Array) -> Bools:
    """Whether open segments to the light meet an axis-aligned box, other than at their starting point."""
    start, end = np.zeros(len(points)), np.array(distance)
    outside = np.zeros(len(points), dtype=bool)
    for axis in range(3):
        slope = towards[:, axis]
        flat = slope == 0.0
        with np.errstate(divide="ignore", invalid="ignore"):
            a, b = (low[axis] - points[:, axis]) / slope, (high[axis] - points[:, axis]) / slope
        start = np.where(flat, start, np.maximum(start, np.minimum(a, b)))
        end = np.where(flat, end, np.minimum(end, np.maximum(a, b)))
        outside |= flat & ((points[:, axis] < low[axis]) | (points[:, axis] > high[axis]))
    return np.asarray(~outside & (end - start > 0.0) & (end > ON_SURFACE * float((high - low).max())))


def _sun(elevation: float, azimuth: float = 0.0) -> tuple[DirectionalLight, float]:
    """A directional light at an elevation above the ground, in degrees, and that elevation."""
    elevation = number(LEAST_ELEVATION, 90.0, unit="degrees above the ground")("elevation", elevation)
    e, a = np.radians(elevation), np.radians(number(unit="degrees")("azimuth", azimuth))
    level = 0.0 if elevation == 90.0 else float(np.cos(e))
    direction = (-level * float(np.cos(a)), -float(np.sin(e)), level * float(np.sin(a)))
    return DirectionalLight(direction=direction), elevation


def _lamp(height: float, above: float) -> PointLight:
    if not height > above * (1.0 + 1e-9):
        raise SettingsError(f"lamp_height must be greater than the caster's top {above:g}, got {height!r}")
    return PointLight(position=(0.0, height, 0.0))


def _ground(x_low: float, x_high: float, z_half: float) -> Solid:
    return shapes.rectangle((x_low, 0.0, z_half), (x_high - x_low, 0.0, 0.0), (0.0, 0.0, -2.0 * z_half))


def _camera(target: ArrayLike, away: ArrayLike, distance: float) -> PerspectiveCamera:
    centre, direction = np.asarray(target, dtype=np.float64), np.asarray(away, dtype=np.float64)
    eye = centre + direction / np.linalg.norm(direction) * distance
    return PerspectiveCamera(tuple(eye), tuple(centre))


def _scene(name: str, parts: dict[str, Solid], camera: PerspectiveCamera, light: Light, smooth: str = "") -> Scene:
    nodes = tuple(
        Node(Mesh(*solid, normals=shapes.vertex_normals(solid) if part == smooth else None), np.eye(4), part)
        for part, solid in parts.items()
    )
    return Scene(nodes, camera, (light,), name=name)
