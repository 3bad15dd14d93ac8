"""Cost of a coarse shadow map format: the gap between a caster's foot and its shadow, predicted and measured.

The derived bias subtracts one step of the format from the compare depth, and storing rounds by up to half a step either way. On average
a shadow therefore begins where its caster is one step nearer to the light::

      lit      |      light
       ^       | wall   /        gap = step * (unit vector to the light).(wall's normal), step in world units along the ray
     __|_______|______ /__
      dark |gap|
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from glshadow.core.cameras import PerspectiveCamera, pixel_rays
from glshadow.core.spaces import Array, transform
from glshadow.lights import DirectionalLight, Light, PointLight, SpotLight
from glshadow.renderer import Renderer
from glshadow.scenes import analytic
from glshadow.shadows.filters import Hard
from glshadow.shadows.metric import Target, metric_range
from glshadow.shadows.shadow import Shadow
from glshadow.shadows.view import ShadowView

SIZE = (256, 256)
# sees half a metre of ground
CAMERA = PerspectiveCamera((-0.25, 3.0, 0.0), (-0.25, 0.0, 0.0), up=(0.0, 0.0, 1.0), fov_y=10.0)
LAMP = (3.0, 3.0, 2.0)  # to one side: the depth passes many steps along the wall's foot, so that rounding averages out

Spans = dict[Target, tuple[float, float] | None]
"""(near, far) for a step of 2 to 4 cm at the wall, far above a texel; None: the derived range has such a step."""

# One light for each projection of a map.
_PROBES: tuple[tuple[Light, Spans], ...] = (
    (
        DirectionalLight(direction=(-0.7, -0.7, -0.3)),
        {Target.R8: None, Target.RGBA8: (-1.3e5, 1.3e5), Target.DEPTH16: (-1e3, 1e3)},
    ),
    (
        SpotLight(position=LAMP, direction=(-LAMP[0], -LAMP[1], -LAMP[2]), outer_angle=40.0),
        {Target.R8: (0.5, 8.0), Target.RGBA8: (0.5, 2.6e5), Target.DEPTH16: (0.01, 100.0)},
    ),
    (
        PointLight(position=LAMP),
        {Target.R8: (0.5, 6.0), Target.RGBA8: (0.5, 2.6e5), Target.DEPTH16: (0.01, 100.0)},
    ),
)
PROBES = {light.spelling: (light, spans) for light, spans in _PROBES}
"""Probes by the light's spelling."""


@dataclass(frozen=True)
class Gap:
    """The gap at a wall's foot; world units.

    Attributes
    ----------
    light : str
        One of `PROBES`.
    step : float
        One step of the format along the ray to the light.
    predicted, measured : float
        Distance from the foot to the beginning of the shadow.
    """

    light: str
    target: Target
    step: float
    predicted: float
    measured: float


def foot_gap(renderer: Renderer, light: str, target: Target) -> Gap:
    """The gap that a format leaves at the foot of a wall; `light` is one of `PROBES`."""
    scene = analytic.wall(elevation=40.0, height=2.0, half=8.0).scene
    lamp = _light(light, target)
    frame = renderer.render(scene, CAMERA, [lamp], SIZE, outputs=("visibility", "depth"), samples=1)
    foot = np.zeros(3)
    towards, _ = lamp.to_light(foot[None])
    step = step_along_ray(frame.used[0].views, target, foot)
    place = pixel_rays(CAMERA, SIZE) * frame.depth[..., None] + np.asarray(CAMERA.position)
    ground = (place[..., 1] < 1e-3) & (place[..., 0] < 0.0)
    pixel = 2.0 * np.tan(np.radians(0.5 * CAMERA.fov_y)) * CAMERA.position[1] / SIZE[1]
    lit = float(frame.visibility[0][ground].sum()) / SIZE[1]
    return Gap(light, target, step, step * float(towards[0, 0]), lit * float(pixel))


def step_along_ray(views: tuple[ShadowView, ...], target: Target, point_w: Array) -> float:
    """World units along the light ray through a point (3,) of one step of the stored value at that point."""
    view = views[0]
    if view.projection == "orthographic":
        return target.quantum * (view.far - view.near)
    local = transform(view.view_from_world, point_w)
    distance = float(np.linalg.norm(local))
    axial = float(np.abs(local).max()) if view.projection == "cube" else -float(local[2])
    low, high = metric_range(view.projection, view.clip, view.near, view.far)
    if target.is_depth:  # window depth is affine in 1 / axial
        along = axial**2 * (view.far - view.near) / (view.far * view.near)
    elif view.projection == "cube":
        return float(target.quantum * (low + high))
    else:
        along = abs((low + high) / view.clip_from_view[2, 2])
    return float(target.quantum * along * distance / axial)


def _light(name: str, target: Target) -> Light:
    probe, spans = PROBES[name]
    given = {} if (span := spans[target]) is None else {"near": span[0], "far": span[1]}
    # hard: the least slack of its own
    return replace(probe, shadow=Shadow(filter=Hard(), target=target), **given)  # type: ignore[arg-type]
