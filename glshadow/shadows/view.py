"""ShadowView, the unit of a shadow map, and the views that a light needs: one for sun and spot, up to six for a point light."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Literal

import numpy as np

from glshadow.core.cameras import Camera
from glshadow.core.lights import DirectionalLight, Light, SpotLight
from glshadow.core.spaces import (
    Array,
    ClipSpace,
    bias_matrix,
    orthographic,
    perspective,
    rigid_inverse,
    transform,
    view_axes,
)
from glshadow.geometry.fitting import minimum_rectangle
from glshadow.shadows.metric import Target

Kind = Literal["directional", "spot", "point"]


def kind_of(light: Light) -> Kind:
    """Which of the three a light is."""
    if isinstance(light, DirectionalLight):
        return "directional"
    return "spot" if isinstance(light, SpotLight) else "point"


# Rows x, y, z (backward) of the six faces of a point light: +x -x +y -y +z -z. Signed permutations, so that a face changes no
# coordinate's bits. GLSL twin: glsl/projection/cube.glsl
FACES = np.array(
    [
        rows
        for s in (1, -1)
        for rows in (
            [(0, 0, s), (0, 1, 0), (-s, 0, 0)],
            [(1, 0, 0), (0, 0, s), (0, -s, 0)],
            [(-s, 0, 0), (0, 1, 0), (0, 0, -s)],
        )
    ],
    dtype=np.float64,
)[[0, 3, 1, 4, 2, 5]]

# Shares of the far plane's distance: a derived near plane lies at the first, or before receivers that are nearer, but no nearer than the
# second. Casters nearer still cast, clamped to it (depth clamp), but do not darken what is nearer too. Only reversed float depth, which is
# near / depth, rounds alike whatever near is, and can afford a close one; of others the step at far is far / share of the format's.
USUAL_SHARE, NEAREST_SHARE = {True: 1e-4, False: 5e-3}, {True: 2.0**-30, False: 5e-3}


def fine_depth(target: Target, clip: ClipSpace) -> bool:
    """Whether a map's depth rounds relative to 1 / depth."""
    return target is Target.DEPTH32F and clip.reversed and clip.zero_to_one


@dataclass(frozen=True, eq=False)
class Cascade:
    """What tells a view of several from its neighbours.

    Parameters
    ----------
    start, end : float
        Depths along the camera's view between which it is meant to be asked.
    blend : float
        Share of its half width, or of its slice, over which it fades into the next one.
    by_depth : bool
        Whether depth decides which view is asked; else the first that covers the receiver is.
    depth_of : (4,) float64
        Its product with (world point, 1) is the depth.
    """

    start: float
    end: float
    blend: float
    by_depth: bool
    depth_of: Array


@dataclass(frozen=True, eq=False)
class ShadowView:
    """One rendered view from a light.

    Parameters
    ----------
    kind : str
        Which light it belongs to: decides projection and metric.
    face : int
        Face of a point light, else 0.
    view_from_world : (4, 4) float64
        Rigid; the origin is the light, or for a sun the middle of what it covers.
    window : (4,) floats
        Left, right, bottom, top that the tile shows, guard band included: world units for a sun, else tangents.
    near, far : float
        Distances along the view; a sun's near may be negative.
    clip : ClipSpace
    resolution : int
        Texels along each side of the tile.
    tile : (2,) ints
        Corner of the tile in its atlas, texels.
    inset : int
        Texels along the tile's border that are read but not answered for: where some receivers lie outside, and are lit.
    gutter : int
        Texels around the tile that stay empty: where the map is too small for a guard band inside it.
    cascade : Cascade, optional
        Where a sun has several.
    warp : (4, 4) float64, optional
        Applied in the view before the projection: a sun's map in perspective along its y axis. Window, near and far are then those of
        what it makes of the view.
    """

    kind: Kind
    face: int
    view_from_world: Array = field(repr=False)
    window: tuple[float, float, float, float]
    near: float
    far: float
    clip: ClipSpace
    resolution: int
    tile: tuple[int, int] = (0, 0)
    inset: int = 0
    gutter: int = 0
    cascade: Cascade | None = field(default=None, repr=False)
    warp: Array | None = field(default=None, repr=False)

    @cached_property
    def clip_from_view(self) -> Array:
        """(4, 4) projection."""
        matrix = (orthographic if self.kind == "directional" else perspective)(
            *self.window, self.near, self.far, self.clip
        )
        return matrix if self.warp is None else matrix @ self.warp

    @cached_property
    def clip_from_world(self) -> Array:
        """(4, 4) float64."""
        return self.clip_from_view @ self.view_from_world

    @cached_property
    def uvz_from_world(self) -> Array:
        """(4, 4) bias matrix times clip_from_world: (u, v, window depth) of the tile, before the division by w."""
        return bias_matrix(self.clip) @ self.clip_from_world

    @property
    def texel(self) -> tuple[float, float]:
        """Size of a texel: world units for a sun, else tangents (world units at distance 1)."""
        left, right, bottom, top = self.window
        return ((right - left) / self.resolution, (top - bottom) / self.resolution)

    def placed(self, tile: tuple[int, int]) -> ShadowView:
        """The same view at another place of the atlas."""
        return replace(self, tile=tile)


def camera_view(camera: Camera, size: tuple[int, int], near: float, far: float, clip: ClipSpace) -> ShadowView:
    """A camera as a view, so that what is asked of lights' views can be asked of it."""
    kind: Kind = "spot" if camera.is_perspective else "directional"
    return ShadowView(kind, 0, camera.view_from_world, camera.window(size), near, far, clip, 1)


def shadow_views(
    light: Light,
    receivers: list[Array],
    casters: Array,
    clip: ClipSpace,
    resolution: int,
    guard: int,
    *,
    fine: bool = False,
    all_inside: bool = True,
) -> tuple[ShadowView, ...]:
    """The views that a light needs to shadow the given receivers.

    Parameters
    ----------
    receivers : list of (M, 3) float64
        Convex corner points in world space, one array per receiving body (see `fit.visible_corners`); may be empty.
    casters : (K, 3) float64
        World corners of everything that casts.
    resolution, guard : int
        Texels along a side of a tile; texels around the fitted window that the filter may reach into.
    fine : bool
        Whether the map's depth rounds relative to 1 / depth, see `fine_depth`: a lamp's near plane may then come close.
    all_inside : bool
        False: the map will be asked for other receivers too, which are lit.

    Returns
    -------
    tuple of ShadowView
        Empty where no receiver can be lit: then nothing needs to be drawn.
    """
    bodies = [points for points in receivers if len(points)]
    if not bodies:
        return ()
    if (
        not all_inside and resolution > 4 * guard
    ):  # a filter's reach is answered for beyond what was fitted, and read beyond that
        found = _views(light, bodies, casters, clip, resolution, 2 * guard, fine)
        return tuple(replace(view, inset=guard) for view in found)
    inside = min(guard, (resolution - 1) // 2)
    gutter = guard if inside < guard else 0
    found = _views(light, bodies, casters, clip, resolution, inside, fine)
    return tuple(replace(view, gutter=gutter) for view in found) if gutter else found


def _views(
    light: Light, bodies: list[Array], casters: Array, clip: ClipSpace, resolution: int, guard: int, fine: bool
) -> tuple[ShadowView, ...]:
    if isinstance(light, DirectionalLight):
        return (_sun_view(light, np.concatenate(bodies), casters, clip, resolution, guard),)
    if isinstance(light, SpotLight):
        axes = view_axes(np.asarray(light.direction))
        edge = float(np.tan(np.radians(light.outer_angle)))
        view = _local_view(light, "spot", 0, axes, edge, bodies, clip, resolution, guard, fine)
        return () if view is None else (view,)
    views = [_local_view(light, "point", i, FACES[i], 1.0, bodies, clip, resolution, guard, fine) for i in range(6)]
    used = [view for view in views if view is not None]
    near, far = min((view.near for view in used), default=0.0), max((view.far for view in used), default=0.0)
    return tuple(replace(view, near=near, far=far) for view in used)  # one depth range: one metric across all faces


def _sun_view(
    light: DirectionalLight, points: Array, casters: Array, clip: ClipSpace, resolution: int, guard: int
) -> ShadowView:
    origin = 0.5 * (points.min(axis=0) + points.max(axis=0))
    axes = view_axes(np.asarray(light.direction))
    flat = (points - origin) @ axes.T
    angle, rectangle = minimum_rectangle(flat[:, :2])
    cosine, sine = np.cos(angle), np.sin(angle)
    axes = np.array([[cosine, sine, 0.0], [-sine, cosine, 0.0], [0.0, 0.0, 1.0]]) @ axes
    size = np.maximum(np.ptp(rectangle, axis=0), 1e-6 * max(np.ptp(points, axis=0).max(), 1e-300))
    origin = origin + rectangle.mean(axis=0) @ axes[:2]
    half = 0.5 * size * (resolution / (resolution - 2 * guard)) if resolution > 2 * guard else 0.5 * size
    near, far = sun_range(light, points, casters, axes, origin, float(size.max()))
    window = (-float(half[0]), float(half[0]), -float(half[1]), float(half[1]))
    return ShadowView("directional", 0, rigid_inverse(axes, origin), window, near, far, clip, resolution)


def sun_range(
    light: DirectionalLight, points: Array, casters: Array, axes: Array, origin: Array, size: float = 0.0
) -> tuple[float, float]:
    """Near and far of a sun's view, unless the light has them.

    Casters nearer than that are clamped to the near plane and still cast. One reach, that of the receivers' depths or `size`, in front of
    the receivers keeps the slack of a receiver's compare depth from passing them.
    """
    depth = -((points - origin) @ axes[2])
    first = -((casters - origin) @ axes[2]).max()
    reach = max(float(np.ptp(depth)), size)
    near = max(float(first), float(depth.min()) - reach) if light.near is None else _along(light, light.near, origin)
    far = float(depth.max()) if light.far is None else _along(light, light.far, origin)
    pad = 1e-3 * (far - near) + 1e-6 * reach
    return near - (pad if light.near is None else 0.0), far + (pad if light.far is None else 0.0)


def _along(light: DirectionalLight, plane: float, origin: Array) -> float:
    """A sun's near or far, given from the world origin, as seen from `origin`."""
    return plane - float(origin @ np.asarray(light.direction))


def _local_view(
    light: Light,
    kind: Kind,
    face: int,
    axes: Array,
    edge: float,
    bodies: list[Array],
    clip: ClipSpace,
    resolution: int,
    guard: int,
    fine: bool,
) -> ShadowView | None:
    """View of a light with a position through a square window of half-width `edge`; None if it shows no receiver."""
    assert not isinstance(light, DirectionalLight)
    view = rigid_inverse(axes, np.asarray(light.position))
    low, high, nearest, farthest, close = np.full(2, np.inf), np.full(2, -np.inf), np.inf, 0.0, np.inf
    for points in bodies:
        local = transform(view, points)
        depth = -local[:, 2]
        lateral = np.concatenate([local[:, :2], -local[:, :2]], axis=1)
        if depth.max() <= 0.0 or (lateral > edge * depth[:, None]).all(axis=0).any():
            continue  # behind the light, or wholly beyond one side of the window
        # its metric is the distance: sqrt(3) more in a corner
        reach = np.linalg.norm(local, axis=1) if kind == "point" else depth
        nearest, farthest = min(nearest, float(depth.min())), max(farthest, float(reach.max()))
        close = min(close, _distance_of_box(points, np.asarray(light.position)))
        if depth.min() <= USUAL_SHARE[True] * depth.max():
            low, high = np.full(2, -edge), np.full(2, edge)  # reaches around the light: every direction
        else:
            tangents = local[:, :2] / depth[:, None]
            low, high = np.minimum(low, tangents.min(axis=0)), np.maximum(high, tangents.max(axis=0))
    if farthest == 0.0:
        return None
    if kind == "point":
        # all faces share one window, so that they share the shader's scale
        low, high = np.full(2, -edge), np.full(2, edge)
    low, high = np.clip(low, -edge, edge), np.clip(high, -edge, edge)
    far = 1.001 * farthest if light.far is None else light.far
    usual = min(
        USUAL_SHARE[fine] * far, 0.5 * close / float(np.hypot(1.0, np.sqrt(2.0) * edge))
    )  # depth in a corner of the window
    near = max(0.5 * nearest, usual, NEAREST_SHARE[fine] * far) if light.near is None else light.near
    half = 0.5 * np.maximum(high - low, 1e-6 * edge) * resolution / (resolution - 2 * guard)
    middle = 0.5 * (low + high)
    window = tuple(
        float(v) for v in (middle[0] - half[0], middle[0] + half[0], middle[1] - half[1], middle[1] + half[1])
    )
    return ShadowView(kind, face, view, window, near, max(far, 1.001 * near), clip, resolution)  # type: ignore[arg-type]


def _distance_of_box(points: Array, position: Array) -> float:
    """From a position to the box along the world's axes around points (N, 3)."""
    return float(
        np.linalg.norm(np.maximum(np.maximum(points.min(axis=0) - position, position - points.max(axis=0)), 0.0))
    )
