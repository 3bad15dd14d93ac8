"""Spot lights: visibility is 0 outside the cone, whatever is there, for every technique and for rays."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import glshadow as gs
from glshadow.scenes import shapes

SIZE = (120, 90)
OUTPUTS = ("visibility", "position", "triangle", "linear")
HEIGHT = 2.0
SPOT = gs.SpotLight(position=(0.3, HEIGHT, -0.2), inner_angle=10.0, outer_angle=30.0)
RADIUS = HEIGHT * np.tan(np.radians(30.0))
SHADOWS = {
    "none": None,
    "exact": gs.Shadow(),
    "hard": gs.Shadow(filter=gs.Hard(), resolution=256),
    "pcf": gs.Shadow(filter=gs.Pcf(2), resolution=256),
    "vsm": gs.Shadow(filter=gs.Vsm(), resolution=256),
    "metric": gs.Shadow(filter=gs.Pcf(1), target=gs.Target.R32F, resolution=256),
    "many maps": gs.Shadow(filter=gs.LightSamples(16), resolution=256),
}


def floor(*more: gs.Node) -> gs.Scene:
    mesh = gs.Mesh(*shapes.rectangle((-2.5, 0, 2.5), (5, 0, 0), (0, 0, -5)))
    camera = gs.PerspectiveCamera(position=(0.0, 5.0, 0.01), target=(0.0, 0.0, 0.0), fov_y=50.0)
    return gs.Scene((gs.Node(mesh, np.eye(4), "floor"), *more), camera)


def away(frame: gs.Frame) -> np.ndarray:
    """Distance (H, W) from the centre of the cone's circle on the floor."""
    position = frame.position.astype(np.float64)
    return np.hypot(position[..., 0] - SPOT.position[0], position[..., 2] - SPOT.position[2])


@pytest.mark.parametrize("radius", [0.0, 0.1])
@pytest.mark.parametrize("name", list(SHADOWS))
def test_empty_floor_shows_the_circle_of_the_cone(renderer: gs.Renderer, name: str, radius: float) -> None:
    frame = renderer.render(
        floor(), None, [replace(SPOT, shadow=SHADOWS[name], radius=radius)], SIZE, outputs=OUTPUTS, samples=1
    )
    distance, known = away(frame), frame.triangle >= 0
    np.testing.assert_array_equal(frame.visibility[0][known & (distance > RADIUS * (1.0 + 1e-5))], 0.0)
    # the weights of a kernel add up to 1 within float32's rounding
    np.testing.assert_allclose(frame.visibility[0][known & (distance < RADIUS * (1.0 - 1e-5))], 1.0, atol=2.0**-22)
    assert 0.1 < (distance < RADIUS).mean() < 0.5


@pytest.mark.parametrize("inner", [10.0, 30.0])
def test_multisampled_circle_has_the_exact_area(renderer: gs.Renderer, inner: float) -> None:
    light = replace(SPOT, inner_angle=inner)
    frame = renderer.render(floor(), None, [light], (240, 180), outputs=OUTPUTS, samples=16)
    pixel = 5.0 * 2.0 * np.tan(np.radians(25.0)) / 180
    assert frame.visibility[0][frame.triangle >= 0].sum() * pixel**2 == pytest.approx(np.pi * RADIUS**2, rel=2e-3)
    assert ((frame.visibility[0] > 0.0) & (frame.visibility[0] < 1.0)).any()


@pytest.mark.parametrize("name", ["exact", "none"])
def test_visibility_matches_rays(renderer: gs.Renderer, name: str) -> None:
    """With casters inside the cone, across its border and outside."""
    boxes = [
        gs.Node(gs.Mesh(*shapes.box((0.3, 0.4, 0.3), (x, 0.2, 0.3))), np.eye(4), f"box {x}") for x in (0.0, 1.3, 2.0)
    ]
    scene, light = floor(*boxes), replace(SPOT, shadow=SHADOWS[name])
    frame = renderer.render(scene, None, [light], SIZE, outputs=OUTPUTS, samples=1)
    truth = gs.trace(scene, None, [light], SIZE, surface=frame.triangle, samples=1)
    known = frame.triangle >= 0
    wrong = frame.visibility[0][known] != truth.visibility[0][known]
    assert wrong.sum() <= 1  # a ray within float32's rounding of an edge or of the cone
    assert (truth.visibility[0][known & ~truth.reached[0]] == 0.0).all()
    lit = truth.visibility[0][known & truth.reached[0]]
    assert 0.0 < lit.mean() <= 1.0
    assert (lit.min() == 0.0) == (name == "exact")


def test_image_applies_the_cone_once(renderer: gs.Renderer) -> None:
    """Intensity falls smoothly to 0 at the border; visibility, which is a step there, removes nothing more."""
    light = replace(SPOT, shadow=None, range=9.0, falloff=1.0)
    frame = renderer.render(floor(), None, [light], SIZE, outputs=(*OUTPUTS, "normal"), ambient=0.0, samples=1)
    known = frame.triangle >= 0
    points = frame.position[known].astype(np.float64)
    expected = light.irradiance(points, frame.normal[known].astype(np.float64))
    color = np.array(frame.scene.nodes[0].mesh.material.color[:3])
    np.testing.assert_allclose(frame.linear[known], expected[:, None] * color, atol=2e-6)


def test_measure_ignores_pixels_outside_the_cone(renderer: gs.Renderer) -> None:
    scene = gs.scenes.box().scene
    light = gs.SpotLight(position=(2.0, 4.0, 1.5), direction=(-2.0, -3.5, -1.5), outer_angle=20.0)
    frame = renderer.render(scene, None, [light], SIZE, outputs=OUTPUTS, samples=1)
    error = gs.measure(frame, gs.trace(scene, None, [light], SIZE, samples=1)).lights[0]
    assert error.wrong <= 1e-3
    assert error.counted < 0.5
