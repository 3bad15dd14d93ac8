"""The true visibility of every light at every pixel, traced with Embree."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from glshadow.core.cameras import Camera
from glshadow.core.lights import DirectionalLight, Light, Lights, PointLight, SpotLight, to_light
from glshadow.core.setting import as_float, as_floats, refuse, shown, whole
from glshadow.core.spaces import FARTHEST, Array, Bools
from glshadow.errors import SettingsError
from glshadow.reference.rays import LIFT, Ints, Rays, dot
from glshadow.scene.arguments import picture_arguments
from glshadow.scene.mesh import Scene

Floats = NDArray[np.float32]

NEAR_DIRECTIONS = 16  # of the search for a shadow's boundary (see Truth.near_edge)
NEAR_RADII = 3
GOLDEN_ANGLE = np.pi * (3.0 - np.sqrt(5.0))

SAMPLES = whole(1, 1 << 16)

# The last tree of each living scene: a study traces it again and again.
_rays: WeakKeyDictionary[Scene, Rays] = WeakKeyDictionary()


@dataclass(frozen=True, eq=False, repr=False)
class Truth:
    """What the exact picture is, and what it is the picture of.

    Attributes
    ----------
    visibility : (L, H, W) float32
        1 lit, 0 dark, also where N.L <= 0; NaN where no surface; between for several samples.
    cosine : (L, H, W) float32
        N.L of the geometric normal that faces the viewer.
    reached : (L, H, W) bool
        Inside a spot's cone and a light's range; always true for suns.
    triangle, node : (H, W) int32
        Drawn triangle (counted in the order of nodes, then of triangles) and its node at the pixel's centre; -1 for
        none.
    position, normal : (H, W, 3) float64
        World point at the pixel's centre, and its geometric normal facing the viewer; NaN where no surface.
    variance : (L, H, W) float32, optional
        Of the light samples within a pixel, averaged over its subpixels; None for one sample.
    scene, camera, lights, size
        What was traced; size is (width, height).
    """

    visibility: Floats
    cosine: Floats
    reached: Bools
    triangle: Ints
    node: Ints
    position: Array
    normal: Array
    variance: Floats | None
    scene: Scene
    camera: Camera
    lights: tuple[Light, ...]
    size: tuple[int, int]
    rays: Rays = field(repr=False)

    def __repr__(self) -> str:
        seen = int((self.triangle >= 0).sum())
        shares = [f"{float(np.nanmean(plane)):.2%}" for plane in self.visibility] if seen else []
        return (
            f"Truth({shown(self.scene.name)}, {self.size[0]} x {self.size[1]}, {seen:,} pixels see a surface, "
            f"lit of them by each light: {', '.join(shares) or 'none'})"
        )

    @cached_property
    def body(self) -> Ints:
        """(H, W) number of the connected body, welded by exact position, at the pixel's centre; -1 for none."""
        return np.where(self.triangle >= 0, self.rays.body[self.triangle], np.int32(-1))

    def near_edge(self, light: int, radius: Array | float, where: Bools | None = None) -> Bools:
        """Whether the true boundary of a light's shadow passes within a distance of the pixels' points.

        The distance is measured in the light plane (through the point, perpendicular to its light ray). Points in 16
        directions at 1/3, 2/3 and 3/3 of it are carried over to the plane of the point's triangle and then put back on
        the real surface along their own light ray, the nearest either way; the boundary is near if any of them is lit
        where the point is dark, or dark where it is lit.

        Parameters
        ----------
        light : int
            Its number in `lights`.
        radius : float or (H, W) float64
            World units.
        where : (H, W) bool, optional
            Only these pixels are asked, the others are False; all surfaces that face the light if None.

        Returns
        -------
        (H, W) bool
        """
        light, wanted = whole(0, len(self.lights) - 1)("light", light), self.triangle >= 0
        wanted &= self.cosine[light] > 0.0 if where is None else self._mask(where)
        rows = np.flatnonzero(wanted)
        lit = self.visibility[light].ravel()[rows] > 0.5
        reach = self._lengths(radius).ravel()[rows]
        points = self.position.reshape(-1, 3)[rows] - self.rays.origin
        own = self.triangle.ravel()[rows]
        source = _Source(self.lights[light], self.rays.origin)
        near = np.zeros(len(rows), dtype=bool)
        for fraction in range(NEAR_RADII, 0, -1):
            for number in range(NEAR_DIRECTIONS):
                left = np.flatnonzero(~near)
                if len(left) == 0:
                    break
                angle = 2.0 * np.pi * number / NEAR_DIRECTIONS
                moved = _moved(self.rays, source, own[left], points[left], reach[left] * fraction / NEAR_RADII, angle)
                near[left] = source.lit(self.rays, *moved) != lit[left]
        result = np.zeros(wanted.shape, dtype=bool)
        result.ravel()[rows] = near
        return result

    def near_foot(self, radius: Array | float, where: Bools) -> Bools:
        """Whether something stands on the surface within a distance: rays along the surface in 16 directions meet it.

        Parameters
        ----------
        radius : float or (H, W) float64
            World units.
        where : (H, W) bool
            Only these pixels are asked.
        """
        where = self._mask(where)
        rows = np.flatnonzero(where & (self.triangle >= 0))
        points = self.position.reshape(-1, 3)[rows] - self.rays.origin
        normal, own = self.normal.reshape(-1, 3)[rows], self.triangle.ravel()[rows]
        reach = self._lengths(radius).ravel()[rows]
        u, v = _perpendicular(normal)
        starts = points + normal * (LIFT * self.rays.reach[own])[:, None]
        near = np.zeros(len(rows), dtype=bool)
        for angle in 2.0 * np.pi * np.arange(NEAR_DIRECTIONS) / NEAR_DIRECTIONS:
            near |= self.rays.blocked(own, starts, np.cos(angle) * u + np.sin(angle) * v, reach)[0]
        result = np.zeros(where.shape, dtype=bool)
        result.ravel()[rows] = near
        return result

    def _mask(self, where: Bools) -> Bools:
        if not isinstance(where, np.ndarray) or where.dtype != np.bool_ or where.shape != self.triangle.shape:
            raise refuse("where", f"an array {self.triangle.shape} of bool", where)
        return np.asarray(where)

    def _lengths(self, radius: Array | float) -> Array:
        """Of each pixel (H, W)."""
        one = as_float(radius)
        lengths = as_floats(radius, self.triangle.shape) if math.isnan(one) else np.array(one)
        if lengths is None or (lengths < 0.0).any() or (lengths > FARTHEST).any():  # NaN where there is no surface
            raise refuse("radius", f"a length in [0, {FARTHEST:g}] or an array {self.triangle.shape} of them", radius)
        return np.broadcast_to(lengths, self.triangle.shape)

    def _repr_html_(self) -> str:
        """In a notebook: for every light the surfaces it lights, bright, and those in shadow, dark."""
        from glshadow.inline import figure, visibility_picture

        seen = self.triangle >= 0
        figures = []
        for number, light in enumerate(self.lights):
            share = float(self.visibility[number][seen].mean()) if seen.any() else 0.0
            kind = type(light).__name__.removesuffix("Light").lower()
            picture = visibility_picture(self.visibility[number], self.cosine[number])
            figures.append(figure(picture, f"truth, light {number} ({kind}): {share:.2%} of what is seen is lit"))
        return "".join(figures)


def trace(
    scene: Scene,
    camera: Camera | None = None,
    lights: Lights = None,
    size: tuple[int, int] = (1280, 720),
    pixel_samples: int = 1,
    light_samples: int = 1,
    surface: Ints | None = None,
) -> Truth:
    """Trace the exact shadows of a picture.

    A point is in shadow iff the open segment from it to the light meets a triangle, and unlit where the geometric
    normal that faces the viewer points away from the light. Surfaces are two-sided. A node that does not receive is never in
    shadow, one that does not cast darkens nothing. Texels below the cutoff of a MASK
    material do not exist (alpha sampled bilinearly at the finest level); BLEND materials are seen but cast nothing; a
    light with `shadow=None` is not blocked by anything. Cone, range and strength do not dim visibility (see
    `Truth.reached`).

    Parameters
    ----------
    scene : Scene
    camera, lights : optional
        The scene's own if None.
    size : (2,) ints
        Width and height.
    pixel_samples : int
        n for n x n rays through each pixel; visibility is their mean. 1: its centre.
    light_samples : int
        Points on each light with a radius or an angle, stratified and turned at random (but reproducibly) from pixel to
        pixel. 1: its centre, a hard shadow.

    surface : (H, W) int32, optional
        The triangles that a picture shows (`Frame.triangle`), asked instead of those that exact rays meet first: GL snaps vertices
        to 1/256 pixel, so that a few dozen pixels show another one. Their points are where the rays meet the triangles' planes,
        within each triangle's range of view depth: a picture's filter and its truth are then compared at the same points.

    Raises
    ------
    ReferenceUnavailable
        If embreex is not installed.
    SettingsError
        For a camera, lights, sizes and sample counts that are none.
    SceneError
        For a scene that is none.
    """
    camera, lights, size = picture_arguments(scene, camera, lights, size)
    pixel_samples, light_samples = SAMPLES("pixel_samples", pixel_samples), SAMPLES("light_samples", light_samples)
    if surface is not None:
        surface = _checked_surface(surface, scene, size, pixel_samples)
    rays = _rays_of(scene, camera)
    sources = [_Source(light, rays.origin) for light in lights]
    hits = _surfaces(rays, camera, size, (0.5, 0.5)) if surface is None else _shown(rays, camera, size, surface)
    generator = np.random.default_rng(20)
    steps = (np.arange(pixel_samples) + 0.5) / pixel_samples
    seen = np.zeros(len(hits.triangle))
    total, spread = np.zeros((2, len(lights), len(hits.triangle)))
    for offset in ((float(x), float(y)) for y in steps for x in steps):
        part = hits if pixel_samples == 1 else _surfaces(rays, camera, size, offset)
        seen[part.rows] += 1.0
        for number, source in enumerate(sources):
            mean, variance = source.visibility(rays, part, light_samples, generator)
            total[number, part.rows] += mean
            spread[number, part.rows] += variance
    count = np.where(seen > 0, seen, np.nan)
    shape = (len(lights), size[1], size[0])
    facts = [_facts(source, hits) for source in sources]
    return Truth(
        visibility=(total / count).astype(np.float32).reshape(shape),
        cosine=np.array([cosine for cosine, _ in facts], dtype=np.float32).reshape(shape),
        reached=np.array([reached for _, reached in facts], dtype=bool).reshape(shape),
        triangle=hits.triangle.reshape(shape[1:]),
        node=np.where(hits.triangle >= 0, rays.node[hits.triangle], np.int32(-1)).reshape(shape[1:]),
        position=_spread(hits, hits.points + rays.origin).reshape(*shape[1:], 3),
        normal=_spread(hits, hits.normals).reshape(*shape[1:], 3),
        variance=(spread / count).astype(np.float32).reshape(shape) if light_samples > 1 else None,
        scene=scene,
        camera=camera,
        lights=lights,
        size=size,
        rays=rays,
    )


def _checked_surface(surface: Ints, scene: Scene, size: tuple[int, int], pixel_samples: int) -> Ints:
    shape = (size[1], size[0])
    if (
        not isinstance(surface, np.ndarray)
        or surface.dtype.kind not in "iu"
        or surface.shape != shape
        or pixel_samples > 1
    ):
        raise SettingsError(
            f"surface must be an array of integers with one triangle per pixel of the size, and one sample: got {shown(surface)} for "
            f"{shape} (height, width) and pixel_samples {pixel_samples}"
        )
    count = sum(len(node.mesh.triangles) for node in scene.nodes)
    if surface.max() >= count:
        raise SettingsError(
            f"surface must number the scene's {count} triangles from 0, -1 for none, got {int(surface.max())}"
        )
    return surface.astype(np.int32)


def _rays_of(scene: Scene, camera: Camera) -> Rays:
    """The scene's tree about the point of its box nearest to the eye: most precise where the camera is near."""
    origin = np.clip(np.asarray(camera.position), *scene.bounds)
    rays = _rays.get(scene)
    if rays is None or not np.array_equal(rays.origin, origin):
        rays = Rays(scene, origin)
        _rays[scene] = rays
    return rays


@dataclass(frozen=True)
class _Hits:
    """Surfaces seen: `rows` (N,) are the pixels that see one, `points` and `normals` (N, 3) belong to them."""

    triangle: Ints  # (H * W,)
    rows: NDArray[np.int64]
    points: Array
    normals: Array


def _surfaces(rays: Rays, camera: Camera, size: tuple[int, int], offset: tuple[float, float]) -> _Hits:
    origins, directions = (each.reshape(-1, 3) for each in camera.rays(size, offset))
    starts = origins - rays.origin + directions * (camera.near or 0.0)
    length = np.full(len(directions), np.inf if camera.far is None else camera.far - (camera.near or 0.0))
    triangle, points = rays.first_hits(starts, directions, length)
    rows = np.flatnonzero(triangle >= 0)
    normals = rays.normals[triangle[rows]]
    away = dot(normals, directions[rows]) > 0.0
    return _Hits(triangle, rows, points[rows], np.where(away[:, None], -normals, normals))


def _shown(rays: Rays, camera: Camera, size: tuple[int, int], surface: Ints) -> _Hits:
    triangle = surface.ravel().astype(np.int32)
    rows = np.flatnonzero(triangle >= 0)
    origins, directions = (each.reshape(-1, 3)[rows] for each in camera.rays(size))
    own, eye = triangle[rows], origins - rays.origin
    corners, normals = rays.corners[own], rays.normals[own]
    depth = (corners - eye[:, None]) @ -camera.view_from_world[2, :3]  # directions have unit view depth
    slant = dot(normals, directions)
    along = dot(normals, corners[:, 0] - eye) / np.where(slant == 0.0, 1.0, slant)
    points = eye + np.clip(along, depth.min(axis=1), depth.max(axis=1))[:, None] * directions
    points -= normals * dot(normals, points - corners[:, 0])[:, None]
    return _Hits(triangle, rows, points, np.where((slant > 0.0)[:, None], -normals, normals))


def _spread(hits: _Hits, values: Array) -> Array:
    image = np.full((len(hits.triangle), *values.shape[1:]), np.nan)
    image[hits.rows] = values
    return image


class _Source:
    """A light relative to the rays' origin."""

    def __init__(self, light: Light, origin: Array) -> None:
        self.light = light
        self.position = None if isinstance(light, DirectionalLight) else np.asarray(light.position) - origin

    def towards(self, points: Array) -> tuple[Array, Array]:
        """Unit vectors (N, 3) to the light and distances (N,)."""
        if self.position is None:
            return to_light(self.light, points)
        offset = self.position - points
        distance = np.sqrt(dot(offset, offset))
        return offset / np.where(distance > 0.0, distance, 1.0)[:, None], distance

    @property
    def spread(self) -> float:
        """Radius of the source as a tangent seen from the receiver (sun), or in world units."""
        light = self.light
        return float(np.tan(np.radians(light.angle) / 2.0)) if isinstance(light, DirectionalLight) else light.radius

    def visibility(self, rays: Rays, hits: _Hits, samples: int, generator: np.random.Generator) -> tuple[Array, Array]:
        """Mean and variance (N,) over samples of the source; parts of it below the receiver's horizon count as dark."""
        own = hits.triangle[hits.rows]
        towards, distance = self.towards(hits.points)
        facing = dot(hits.normals, towards) > 0.0
        total = np.zeros(len(own))
        samples = samples if self.spread > 0.0 else 1
        u, v = _perpendicular(towards)
        turn = generator.uniform(0.0, 2.0 * np.pi, len(own)) if samples > 1 else np.zeros(len(own))
        for number in range(samples):
            # Rings of equal area, a golden angle apart (Vogel); the place within the ring is random.
            place = generator.uniform(size=len(own)) if samples > 1 else 0.0
            radius = np.sqrt((number + place) / samples) * self.spread if samples > 1 else 0.0
            angle = turn + number * GOLDEN_ANGLE
            offset = u * (radius * np.cos(angle))[:, None] + v * (radius * np.sin(angle))[:, None]
            aim = towards + offset if self.position is None else towards * distance[:, None] + offset
            length = np.sqrt(dot(aim, aim))
            aim = aim / np.where(length > 0.0, length, 1.0)[:, None]
            end = distance if self.position is None else length
            open_to = facing & (dot(hits.normals, aim) > 0.0)
            if self.light.shadow is not None:
                asked = open_to & rays.receives[own]
                open_to[asked] = ~rays.blocked(own[asked], hits.points[asked], aim[asked], end[asked])[0]
            total += open_to
        mean = total / samples
        return mean, mean * (1.0 - mean)

    def lit(self, rays: Rays, own: Ints, points: Array) -> Bools:
        """Whether the middle of the light sees points (N, 3) on triangles (N,), whichever side they are seen from."""
        if self.light.shadow is None:
            return np.ones(len(own), dtype=bool)
        return ~rays.blocked(own, points, *self.towards(points))[0] | ~rays.receives[own]


def _facts(source: _Source, hits: _Hits) -> tuple[Array, Bools]:
    """N.L (H * W,), NaN where no surface, and whether the light reaches the point."""
    towards, distance = source.towards(hits.points)
    cosine = _spread(hits, dot(hits.normals, towards))
    reached = np.zeros(len(hits.triangle), dtype=bool)
    inside = np.ones(len(hits.rows), dtype=bool)
    light = source.light
    if isinstance(light, SpotLight):
        inside &= -(towards @ np.asarray(light.direction)) >= np.cos(np.radians(light.outer_angle))
    if isinstance(light, SpotLight | PointLight) and light.range is not None:
        inside &= distance < light.range
    reached[hits.rows] = inside
    return cosine, reached


def _perpendicular(directions: Array) -> tuple[Array, Array]:
    """Two unit vectors (N, 3) that span the plane perpendicular to unit vectors (N, 3)."""
    axis = np.eye(3)[np.abs(directions).argmin(axis=1)]
    u = np.cross(axis, directions)
    u /= np.linalg.norm(u, axis=1, keepdims=True)
    return u, np.cross(directions, u)


def _moved(rays: Rays, source: _Source, own: Ints, points: Array, reach: Array, angle: float) -> tuple[Ints, Array]:
    """Points moved in the light plane and put back on the nearest surface along the light; triangles and points."""
    towards, _ = source.towards(points)
    u, v = _perpendicular(towards)
    moved = points + reach[:, None] * (np.cos(angle) * u + np.sin(angle) * v)
    ray, distance = source.towards(moved)
    # Onto the plane of the own triangle, as long as that is not behind the light.
    normal, slope = rays.normals[own], dot(rays.normals[own], ray)
    step = -rays.plane_distance(own, moved) / np.where(slope == 0.0, 1.0, slope)
    step = np.where((slope == 0.0) | (step >= distance), 0.0, step)
    start = moved + step[:, None] * ray
    # Both rays start on the other side of the plane, so that a surface at the point itself is found by both.
    back = (normal * np.sign(slope)[:, None]) * (2.0 * LIFT * rays.reach[own])[:, None]
    found, place, gap = own, start, np.full(len(own), np.inf)
    for sign, length in ((-1.0, np.full(len(own), np.inf)), (1.0, np.maximum(distance - step, 0.0))):
        hit, at = rays.first_hits(start - sign * back, sign * ray, length)
        far = np.where(hit >= 0, np.linalg.norm(at - start, axis=1), np.inf)
        nearer = far < gap
        found, gap = np.where(nearer, hit, found), np.where(nearer, far, gap)
        place = np.where(nearer[:, None], at, place)
    return found, place
