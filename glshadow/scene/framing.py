"""Frames a model: its projected hull fills the image and is centred in it."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from glshadow.core.cameras import MOST_ASPECT, PerspectiveCamera
from glshadow.core.sample_patterns import GOLDEN_ANGLE
from glshadow.core.spaces import Array, view_axes
from glshadow.scene.box import box_corners
from glshadow.scene.capsules import Capsules, radius_scale

if TYPE_CHECKING:
    from glshadow.core.cameras import Camera
    from glshadow.lights import Light
    from glshadow.scene.mesh import Mesh
    from glshadow.scene.nodes import Node, Scene

FILL = 0.86
"""Share of the image's tighter axis that the model fills."""
FOV = 35.0
"""Vertical field of view in an image of USUAL_ASPECT, degrees."""
USUAL_ASPECT = 16.0 / 9.0
MOST_POINTS = 4_000_000
"""Of more vertices the boxes of the nodes are framed."""
_TURNS = 72  # steps of a full turn; a point between two is farther from the axis by 0.1 %
_LEAST_GAP = 0.05  # of the model's size, between the eye and the model: for a needle along the view


def outline(nodes: Sequence[Node], corners: Array) -> Array:
    """World points (N, 3) whose hull is the model's; of very many vertices the corners (N, 8, 3) of the nodes' boxes."""
    if sum(len(node.mesh.positions) for node in nodes) > MOST_POINTS:
        return corners.reshape(-1, 3)
    used: dict[int, Array] = {}
    parts = []
    for node in nodes:
        mesh, matrix = node.mesh, node.world_from_mesh
        if id(mesh) not in used:
            used[id(mesh)] = _used(mesh)
        points = used[id(mesh)] @ matrix[:3, :3].T + matrix[:3, 3]
        if isinstance(mesh, Capsules):
            radii = np.broadcast_to(mesh.radius, len(mesh.ends))[:, None, None, None] * radius_scale(matrix)
            points = (points.reshape(-1, 2, 1, 3) + radii * _ball(len(points))).reshape(-1, 3)
        parts.append(points)
    return np.concatenate(parts)


def _ball(count: int) -> Array:
    """Points (N, 3) whose hull holds the unit ball; of fewer balls more points, so that the hull is at most 2 % larger."""
    number = 162 if count <= 20_000 else 42
    if count > 80_000:  # small beside what they make up
        return np.array([[x, y, z] for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)])
    points, tried = _spread(number), _spread(20 * number)
    farthest = float((tried @ points.T).max(axis=1).min())  # cosine of the largest gap
    return np.asarray(points / (farthest - 0.01))


def _spread(count: int) -> Array:
    """Unit vectors (count, 3) in rings of equal solid angle, a golden angle apart."""
    turns, heights = GOLDEN_ANGLE * np.arange(count), 1.0 - (2.0 * np.arange(count) + 1.0) / count
    across = np.sqrt(1.0 - heights**2)
    return np.stack([across * np.cos(turns), heights, across * np.sin(turns)], axis=-1)


def _used(mesh: Mesh) -> Array:
    """Vertices of triangles (N, 3), or both ends of each capsule (2 E, 3)."""
    if isinstance(mesh, Capsules):
        return mesh.positions[mesh.ends.ravel()]
    used = np.zeros(len(mesh.positions), dtype=bool)
    used[mesh.triangles.ravel()] = True
    return mesh.positions[used]


def model_outline(scene: Scene) -> Array:
    """World points (N, 3) whose hull is that of a scene without a ground; if its look frames boxes, the bounds (2, 3)."""
    if scene.look == "plain":
        return scene.bounds
    drawn = scene.drawn.tolist()
    model = [not scene.nodes[i].ground for i in drawn]
    kept = np.array(model) if any(model) else np.ones(len(model), dtype=bool)
    return outline([scene.nodes[i] for i in np.array(drawn)[kept]], scene.corners[kept])


def given_parts(scene: Scene) -> tuple[Camera | None, list[Light] | None]:
    """Camera and lights of a scene, each None if it is what the studio or the outdoor look derives from the model."""
    if scene.look == "plain":
        return scene.camera, list(scene.lights)
    derived = scene.defaults.camera(model_outline(scene))
    lit = scene.defaults.lights(scene.camera, scene.bounds)
    return None if scene.camera == derived else scene.camera, None if scene.lights == lit else list(scene.lights)


def turning_camera(scene: Scene) -> Camera:
    """See `Scene.turning_camera`."""
    look = scene.defaults
    if scene.look == "plain":
        return scene.camera
    points = model_outline(scene)
    return look.camera(turned(points)) if scene.camera == look.camera(points) else scene.camera


def framed(scene: Scene, times: Iterable[float]) -> Scene:
    """See `Scene.framed`."""
    scenes = [scene.at(each) for each in times]
    if not scenes:
        return scene
    first = model_outline(scenes[0])
    if len(first) * len(scenes) > MOST_POINTS:
        points = np.concatenate([box_corners(each.bounds[None], np.eye(4)[None])[0] for each in scenes])
    else:
        points = np.concatenate([first, *map(model_outline, scenes[1:])])
    bare = [node for node in scene.nodes if not node.ground]
    made = scene
    if len(bare) < len(scene.nodes) and bare:
        every = np.stack([each.bounds for each in scenes])
        bounds = np.stack([every[:, 0].min(axis=0), every[:, 1].max(axis=0)])
        lowest = min(each.lowest(model=True) for each in scenes)
        catches = any(node.ground and node.catches for node in scene.nodes)
        made = replace(scene, nodes=(*bare, scene.ground_under(bounds, lowest, catches)))
    own = scene.motion is not None and scene.motion.cameras
    return made if own else made.changed({}, camera=scene.defaults.camera(points))


def turned(points: Array) -> Array:
    """The hull (M, 3) of points (N, 3) turned about the vertical axis through the middle of their bounds."""
    low, high = points.min(axis=0), points.max(axis=0)
    middle = 0.5 * (low + high)
    radius = np.hypot(points[:, 0] - middle[0], points[:, 2] - middle[2])
    # the largest radius at each of a hundred heights, at both borders of its slice: a little larger than the body
    span = max(float(high[1] - low[1]), 1e-12 * float(np.abs(middle).max()), np.finfo(float).tiny)
    slices = np.minimum((points[:, 1] - low[1]) / span * 100.0, 99.0).astype(int)
    profile = np.zeros(100)
    np.maximum.at(profile, slices, radius)
    present = np.unique(slices)
    heights = np.concatenate(
        [low[1] + present * span / 100.0, np.minimum(low[1] + (present + 1) * span / 100.0, high[1])]
    )
    radii = np.concatenate([profile[present]] * 2)
    angles = 2.0 * np.pi * np.arange(_TURNS) / _TURNS
    rings = np.zeros((len(radii), _TURNS, 3))
    rings[..., 0] = middle[0] + radii[:, None] * np.cos(angles)
    rings[..., 1] = heights[:, None]
    rings[..., 2] = middle[2] + radii[:, None] * np.sin(angles)
    return rings.reshape(-1, 3)


def framing_camera(points: Array, towards: Array) -> PerspectiveCamera:
    """The camera that looks along -`towards` (3,) at points (N, 3), which fill its image to FILL of the tighter axis at every size.

    It stands where they do so in an image of USUAL_ASPECT with a field of view of FOV, and has them in its middle. Its target is
    where its axis is nearest to the vertical through the middle of their bounds.
    """
    low, high = points.min(axis=0), points.max(axis=0)
    middle = 0.5 * (low + high)
    axes = view_axes(-towards)
    x, y, z = axes @ (points - middle).T
    tall = FILL * np.tan(np.radians(0.5 * FOV))
    # all points are inside of a window of tangents t if |x - eye| <= t (depth - z), for the smallest depth
    size = float(np.linalg.norm(high - low))
    depth = max(*(_room(a, z, t) for a, t in ((x, tall * USUAL_ASPECT), (y, tall))), float(z.max()) + _LEAST_GAP * size)
    (right, wide), (up, high_) = (_centred(a, depth - z) for a in (x, y))
    half = max(high_, wide / MOST_ASPECT)
    aimed = right * axes[0] + up * axes[1]
    level = axes[2] * (1.0, 0.0, 1.0)
    along = float(aimed @ level) / max(float(level @ level), 1e-6)
    eye, target = middle + aimed + depth * axes[2], middle + aimed - along * axes[2]
    return PerspectiveCamera(
        tuple(eye.tolist()),
        tuple(target.tolist()),
        fov_y=float(f"{np.degrees(2.0 * np.arctan(half / FILL)):.10g}"),  # as good as exact, and readable
        aspect=float(np.clip(wide / half, 1.0 / MOST_ASPECT, MOST_ASPECT)),
    )


def _room(across: Array, z: Array, tangent: float) -> float:
    """Depth of the eye from which everything is within a tangent of the middle, which may be anywhere."""
    return float((across + tangent * z).max() - (across - tangent * z).min()) / (2.0 * tangent)


def _centred(across: Array, depths: Array) -> tuple[float, float]:
    """Where the eye sees points at these depths as far to one side as to the other, and the tangent that they reach."""
    eye = 0.0
    for _ in range(60):  # the mean depth of both borders is at most a few times the nearest: a contraction
        least, most = float(((across - eye) / depths).min()), float(((across - eye) / depths).max())
        step = 0.5 * (least + most) * float(depths.min())
        eye += step
        if abs(step) <= 1e-13 * float(depths.min()) * (most - least):
            break
    return eye, 0.5 * (most - least)
