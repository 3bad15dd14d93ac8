"""Shadow.edge_falloff: a shadow fades towards its map's border by Babylon.js's formula."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import glshadow as gs
from glshadow.core.spaces import project
from glshadow.scenes import shapes

SIZE = (160, 120)


@pytest.mark.parametrize("falloff", [0.0, 0.3, 1.0])
@pytest.mark.parametrize("name", ["spot", "sun"])
def test_shadow_fades_with_the_squared_distance_from_the_centre(
    renderer: gs.Renderer, name: str, falloff: float
) -> None:
    """Under a plate that covers everything visibility is the fade itself: smoothstep(1 - falloff, 1, x^2 + y^2)."""
    ground = gs.Node(gs.Mesh(*shapes.rectangle((-3, 0, 3), (6, 0, 0), (0, 0, -6))), np.eye(4), "ground")
    plate = gs.Node(gs.Mesh(*shapes.rectangle((-3.2, 1, 3.2), (6.4, 0, 0), (0, 0, -6.4))), np.eye(4), "plate")
    camera = gs.PerspectiveCamera(position=(0, 0.8, 2.9), target=(0, 0, 0), fov_y=60)
    light: gs.Light = (
        gs.SpotLight(position=(0, 4, 0), direction=(0, -1, 0), inner_angle=40, outer_angle=40)
        if name == "spot"
        else gs.DirectionalLight(direction=(0, -1, 0))
    )
    light = replace(light, shadow=gs.Shadow(filter=gs.Hard(), fit=gs.SceneFit(), resolution=256, edge_falloff=falloff))
    scene = gs.Scene((ground, plate))
    frame = renderer.render(scene, camera, [light], SIZE, outputs=("visibility", "position", "node"), samples=1)
    view = frame.used[0].views[0]
    seen = frame.node == 0
    points = frame.position[seen].astype(np.float64)
    uvw = project(view.uvz_from_world, points)
    texel = uvw[:, :2] / uvw[:, 3:] * view.resolution
    low, high = view.inset, view.resolution - view.inset
    place = (texel - 0.5 * (low + high)) / (0.5 * (high - low))
    squared = np.clip((place**2).sum(axis=1), 0.0, 1.0)
    t = np.clip((squared - (1.0 - falloff)) / max(falloff, 1e-12), 0.0, 1.0)
    expected = t * t * (3.0 - 2.0 * t) if falloff else np.zeros_like(t)
    cone = replace(light, inner_angle=39.9, outer_angle=39.9) if name == "spot" else light  # beyond it visibility is 0
    inside = (np.abs(place) < 1.0).all(axis=1) & cone.shines_on(points)
    assert inside.sum() > 500
    np.testing.assert_allclose(frame.visibility[0][seen][inside], expected[inside], atol=2e-3)
    if falloff:
        assert ((expected[inside] > 0.2) & (expected[inside] < 0.8)).sum() > 50
