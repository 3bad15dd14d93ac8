"""Every kind of light: its GLSL equals its float64 twin, and its sample points are where the twin puts them."""

from __future__ import annotations

import inspect
from dataclasses import replace

import numpy as np
import pytest

import glshadow as gs
from glshadow.lights import LIGHTS, Light
from glshadow.lights.environment_map import LUMINANCE

SIZE = (96, 54)
SURROUNDINGS = np.random.default_rng(5).random((12, 24, 3)) ** 6
OUTPUTS = ("linear", "triangle", "position", "normal", "node", "visibility")
EXAMPLES: dict[type[Light], Light] = {
    gs.DirectionalLight: gs.DirectionalLight(direction=(-0.5, -0.9, 0.2), angle=4.0),
    gs.SpotLight: gs.SpotLight(
        position=(2.0, 4.0, 1.5), direction=(-2.0, -4.0, -1.5), outer_angle=35.0, range=12.0, falloff=1.0, radius=0.3
    ),
    gs.PointLight: gs.PointLight(position=(1.5, 3.0, 1.0), range=10.0, falloff=2.0, intensity=6.0, radius=0.3),
    gs.RectLight: gs.RectLight(position=(1.5, 3.5, 1.0), direction=(-1.0, -2.0, -0.5), width=1.5, range=20.0),
    gs.SkyLight: gs.SkyLight(direction=(0.2, -1.0, 0.1)),
    gs.EnvironmentLight: gs.EnvironmentLight(SURROUNDINGS, turn=20.0, direction=(0.2, -1.0, 0.1)),
}
each_light = pytest.mark.parametrize("light", EXAMPLES.values(), ids=lambda light: light.spelling)


def test_every_kind_has_an_example() -> None:
    assert set(EXAMPLES) == set(LIGHTS)
    assert not any(inspect.isabstract(kind) for kind in LIGHTS)


@each_light
def test_snippet_equals_its_twin(renderer: gs.Renderer, light: Light) -> None:
    scene, bare = gs.scenes.box().scene, replace(light, shadow=None, color=(1.0, 0.6, 0.2))
    frame = renderer.render(scene, None, [bare], SIZE, outputs=OUTPUTS, ambient=0.0, samples=1)
    known = frame.triangle >= 0
    points, normals = frame.position[known].astype(np.float64), frame.normal[known].astype(np.float64)
    colors = np.array([node.mesh.material.color[:3] for node in scene.nodes])[frame.node[known]]
    given = bare.irradiance(points, normals)
    given = given if light.per_channel else given[:, None]
    expected = colors * np.array([1.0, 0.6, 0.2]) * bare.intensity * given
    # a form factor is a float32 sum of angles between corners seen near each other, divided by their sines
    np.testing.assert_allclose(frame.linear[known], expected, atol=2e-4 if light.wide else 5e-6)
    assert expected.max() > 0.05
    facing = (normals * bare.to_light(points)[0]).sum(axis=1) > 1e-3
    seen = frame.visibility[0][known]
    if not light.wide:
        assert (seen[facing] == bare.shines_on(points)[facing]).mean() > 0.999  # pixels on a cone's border


@each_light
def test_sample_points_have_equal_weights(light: Light, rng: np.random.Generator) -> None:
    """Directions to hard lights, to the sample points of the penumbra pass and to random points have about the same mean."""
    receiver = np.array([[0.4, 0.1, -0.3]])
    middle, distance = light.to_light(receiver)
    points = light.hard_lights(256)
    weights = [float(LUMINANCE @ each.color) for each in points] if light.per_channel else None
    hard = np.average(np.concatenate([each.to_light(receiver)[0] for each in points]), axis=0, weights=weights)
    traced = np.concatenate([aim for aim, _ in light.aims(receiver, 256, rng)]).mean(axis=0)
    size = light.source_radius / (1.0 if light.at_infinity else float(distance[0])) if light.source_radius else 1.0
    np.testing.assert_allclose(traced, hard, atol=0.1 * size)
    if light.penumbra is not None:
        ways = light.to_points(receiver, 256)[0]
        counted = (ways / np.linalg.norm(ways, axis=1, keepdims=True)).mean(axis=0)
        np.testing.assert_allclose(counted, hard, atol=0.1 * size)
        np.testing.assert_allclose(hard / np.linalg.norm(hard), middle[0], atol=0.15 * size)


@pytest.mark.parametrize(
    "light", [light for light in EXAMPLES.values() if not light.weighted], ids=lambda light: light.spelling
)
def test_hull_of_the_extremes_contains_all_points(light: Light) -> None:
    """Along random directions no point lies farther out than all extremes. (No finite number of directions holds the sky.)"""
    rng = np.random.default_rng(4)
    extremes = np.array([each.place[:3] for each in light.extremes()])
    points = np.array([each.place[:3] for each in light.hard_lights(512)])
    if light.at_infinity:  # where the rays hit a plane across the light
        axes = light.disc_axes
        extremes, points = (ways @ axes[:2].T / (ways @ axes[2])[:, None] for ways in (extremes, points))
    for way in rng.normal(size=(200, points.shape[1])):
        assert (points @ way).max() <= (extremes @ way).max() + 1e-9


@each_light
def test_color_and_intensity_are_not_geometry(light: Light) -> None:
    dimmed = replace(light, intensity=0.1, color=(0.0, 1.0, 0.0), shadow=None)
    assert dimmed.geometry == light.geometry
    assert light.nudged(1e-3, 1e-3).geometry != light.geometry


@each_light
def test_light_is_invariant_to_the_origin(light: Light) -> None:
    origin, points = np.array([3.0, -2.0, 1.0]), np.random.default_rng(3).normal(size=(5, 3))
    moved = light.relative_to(origin)
    np.testing.assert_allclose(moved.to_light(points - origin)[0], light.to_light(points)[0], atol=1e-12)
    np.testing.assert_array_equal(moved.shines_on(points - origin), light.shines_on(points))
    assert np.array_equal(moved.reaches(points - origin), light.reaches(points))


def test_unknown_setting_is_named() -> None:
    with pytest.raises(gs.SettingsError, match=r"PointLight has no colour=3 and no size=2; it takes color, intensity"):
        gs.PointLight(position=(0, 1, 0), colour=3, size=2)  # type: ignore[call-arg]
