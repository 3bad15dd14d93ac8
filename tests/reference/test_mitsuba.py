"""A second opinion on the traced reference: Mitsuba 3 traces the same scene with its own camera, tree and epsilon."""

from __future__ import annotations

import os
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from glshadow import scenes as builtin
from glshadow.core.cameras import PerspectiveCamera
from glshadow.lights import DirectionalLight, Light, PointLight
from glshadow.reference import trace
from glshadow.scene.nodes import Scene

SIZE = (320, 180)

LIFT = 1500.0 * 2.0**-24
"""Mitsuba's shadow rays start (1 + largest coordinate) times this off the surface: if the boundary is closer, the two
may differ. Hit points differ by float32's rounding, which is less."""

MOST = 1e-3
"""Share of pixels that may differ: at 320 x 180 about 2e-4 of the courtyard's lie within LIFT of the boundary."""

LIGHTS = [
    pytest.param(DirectionalLight(direction=(-0.55, -0.8, -0.25)), id="sun"),
    pytest.param(PointLight(position=(3.0, 4.0, 2.0)), id="point"),
]


@pytest.fixture(scope="module")
def mi() -> Any:
    try:
        import mitsuba
    except ImportError:
        message = "Mitsuba is missing (pip install mitsuba)"
        if os.environ.get("CI") == "true":
            pytest.fail(message)
        pytest.skip("optional: " + message)
    mitsuba.set_variant("scalar_rgb")
    return mitsuba


def mitsuba_scene(mi: Any, scene: Scene, camera: PerspectiveCamera) -> Any:
    """Every node as a mesh without vertex normals, and the camera, in Mitsuba's own conventions."""
    parts: dict[str, Any] = {}
    for number, node in enumerate(scene.nodes):
        positions = node.mesh.positions @ node.world_from_mesh[:3, :3].T + node.world_from_mesh[:3, 3]
        mesh = mi.Mesh(f"node{number}", len(positions), len(node.mesh.triangles))
        content = mi.traverse(mesh)
        content["vertex_positions"] = positions.astype(np.float32).ravel()
        content["faces"] = node.mesh.triangles.astype(np.uint32).ravel()
        content.update()
        parts[f"node{number}"] = mesh
    film = {"type": "hdrfilm", "width": SIZE[0], "height": SIZE[1]}
    look = mi.ScalarTransform4f().look_at(list(camera.position), list(camera.target), list(camera.up))
    sensor = {"type": "perspective", "fov": camera.fov_y, "fov_axis": "y", "to_world": look, "film": film}
    return mi.load_dict({"type": "scene", "sensor": {**sensor, "near_clip": 1e-3}, **parts})


def opinion(mi: Any, scene: Any, light: Light) -> tuple[NDArray[np.float32], NDArray[np.float64]]:
    """Visibility (H, W), NaN where no surface, and the hit points (H, W, 3)."""
    width, height = SIZE
    sensor = scene.sensors()[0]
    visibility = np.full((height, width), np.nan, dtype=np.float32)
    points = np.full((height, width, 3), np.nan)
    for row in range(height):
        for column in range(width):
            place = mi.Point2f((column + 0.5) / width, (row + 0.5) / height)
            ray, _ = sensor.sample_ray(0.0, 0.5, place, mi.Point2f(0.5))
            seen = scene.ray_intersect(ray)
            if not seen.is_valid():
                continue
            points[row, column] = np.array(seen.p).ravel()
            if isinstance(light, DirectionalLight):
                towards = -mi.Vector3f(list(light.direction))
                shadow_ray = seen.spawn_ray(towards)
            else:
                towards = mi.Point3f(list(light.position)) - seen.p
                shadow_ray = seen.spawn_ray_to(mi.Point3f(list(light.position)))
            n = np.array(seen.n).ravel()
            faces = (n @ np.array(towards).ravel()) * (n @ np.array(ray.d).ravel()) < 0.0
            visibility[row, column] = faces and not scene.ray_test(shadow_ray)
    return visibility, points


@pytest.mark.parametrize("light", LIGHTS)
def test_mitsuba_agrees(mi: Any, light: Light, record_property: Callable[[str, object], None]) -> None:
    scene = builtin.courtyard()
    theirs, points = opinion(mi, mitsuba_scene(mi, scene, scene.camera), light)
    truth = trace(scene, lights=[light], size=SIZE, samples=1)
    ours = truth.visibility[0]
    lift = LIFT * (1.0 + truth.rays.size)

    # The same surfaces, except for pixels whose centre lies on a silhouette.
    silhouettes = np.isnan(theirs) != np.isnan(ours)
    moved = np.linalg.norm(points - truth.position, axis=-1) > lift
    assert (silhouettes | moved).mean() <= MOST

    # The same shadows, except for pixels on their boundary.
    compared = np.isfinite(theirs) & np.isfinite(ours) & ~moved
    assert compared.sum() > 30000
    assert 0.05 < ours[compared].mean() < 0.95
    differ = compared & (theirs != ours)
    explained = truth.near_edge(0, lift, differ)
    record_property(
        "differ", f"{differ.sum()} of {compared.sum()} pixels, {(differ & ~explained).sum()} without a reason"
    )
    assert not (differ & ~explained).any()
    assert differ.sum() <= MOST * compared.sum()
