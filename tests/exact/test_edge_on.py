"""Surfaces whose plane contains the light: no light reaches them, and no pixel is lit by rounding."""

from __future__ import annotations

import numpy as np
import pytest

import glshadow as gs
from glshadow.scenes import shapes


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("far", [0.0, 1e5])
def test_light_in_the_plane_of_a_floor(renderer: gs.Renderer, seed: int, far: float) -> None:
    rng = np.random.default_rng(seed)
    axes, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    axes *= np.sign(np.linalg.det(axes))
    origin = rng.normal(size=3) * 3.0 + far

    def turned(*point: float) -> tuple[float, float, float]:
        return tuple((np.asarray(point) @ axes.T).tolist())

    def placed(*point: float) -> tuple[float, float, float]:
        return tuple((np.asarray(turned(*point)) + origin).tolist())

    floor = shapes.rectangle(placed(-2, 0, 2), turned(4, 0, 0), turned(0, 0, -4))
    positions, triangles = shapes.box((0.3, 1.0, 0.3), (0.5, 0.5, 0.2))
    scene = gs.Scene([gs.Mesh(*floor), gs.Mesh(positions @ axes.T + origin, triangles)])
    camera = gs.PerspectiveCamera(placed(1, 5, 4), placed(0, 0, 0), turned(0, 1, 0))
    lights: list[gs.Light] = [gs.PointLight(position=placed(x, 0, 1)) for x in (1.3, 3.1)]
    lights.append(gs.SpotLight(position=placed(3, 0, 0), direction=turned(-1, 0, 0), inner_angle=60, outer_angle=60))
    frame = renderer.render(scene, camera, lights, (96, 72), samples=1, outputs=("visibility", "node"))
    assert (frame.visibility[:, frame.node == 0] == 0.0).all()
    assert (frame.visibility[:, frame.node == 1] == 1.0).any(axis=1).all(), "the box is lit"
