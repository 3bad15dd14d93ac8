"""Sample points of area lights: on the light, well distributed, deterministic."""

from __future__ import annotations

import numpy as np
import pytest

import glshadow as gs
from glshadow.core.sample_patterns import ball, disc

COUNTS = [16, 64, 256, 1024]


def shares(points: np.ndarray, lines: int = 200) -> float:
    """Largest difference, over many lines, between the fraction of points beyond a line through the unit disc and that of its area."""
    rng = np.random.default_rng(1)
    worst = 0.0
    for angle, height in zip(rng.uniform(0, 2 * np.pi, lines), rng.uniform(-0.95, 0.95, lines), strict=True):
        beyond = float((points @ (np.cos(angle), np.sin(angle)) > height).mean())
        area = (np.arccos(height) - height * np.sqrt(1.0 - height**2)) / np.pi
        worst = max(worst, abs(beyond - area))
    return worst


@pytest.mark.parametrize("count", COUNTS)
def test_disc_points_are_evenly_distributed(count: int) -> None:
    points = disc(count)
    assert points.shape == (count, 2)
    assert (np.linalg.norm(points, axis=1) < 1.0).all()
    np.testing.assert_allclose(points.mean(axis=0), 0.0, atol=1.0 / count**0.75)
    # error of a straight edge's fraction: for a random set it would be about 1.5 / sqrt(count)
    assert shares(points) < 1.3 * count**-0.75


@pytest.mark.parametrize("count", COUNTS)
def test_ball_points_fill_the_disc_from_every_side(count: int) -> None:
    points = ball(count)
    assert (np.linalg.norm(points, axis=1) <= 1.0).all()
    rng = np.random.default_rng(2)
    worst = []
    for _ in range(12):
        axes, _ = np.linalg.qr(rng.normal(size=(3, 3)))
        worst.append(shares(points @ axes[:, :2], 60))
    assert max(worst) < 0.65 / np.sqrt(count)  # of random points 1.5
    assert np.median(worst) < 0.5 / np.sqrt(count)


def test_directional_light_points_lie_within_its_angle() -> None:
    sun = gs.DirectionalLight(direction=(-1.0, -2.0, 0.5), angle=4.0, intensity=0.3)
    points = sun.hard_lights(64)
    aims = np.array([light.direction for light in points])
    cosine = aims @ np.asarray(sun.direction)
    assert np.degrees(np.arccos(cosine.min())) == pytest.approx(2.0, abs=0.05)
    assert {light.angle for light in points} == {0.0}
    mean = aims.mean(axis=0)
    np.testing.assert_allclose(mean / np.linalg.norm(mean), sun.direction, atol=1e-3)


@pytest.mark.parametrize("angle", [0.53, 10.0, 60.0, 89.9])
def test_directional_light_points_are_uniform_in_solid_angle(angle: float) -> None:
    """Rings about its axis: within t of it lies the fraction (1 - cos t) / (1 - cos a) of a cap of half its angle a."""
    sun = gs.DirectionalLight(direction=(-1.0, -2.0, 0.5), angle=angle)
    half, count = 0.5 * np.radians(angle), 256
    aims = np.array([light.direction for light in sun.hard_lights(count)])
    away = 2.0 * np.arcsin(0.5 * np.linalg.norm(aims - sun.direction, axis=1))
    share = np.sin(0.5 * away) ** 2 / np.sin(0.5 * half) ** 2
    np.testing.assert_allclose(np.sort(share), (np.arange(count) + 0.5) / count, rtol=1e-9)
    seen = sun.to_points(np.zeros((1, 3)), count)[0]
    np.testing.assert_allclose(seen / np.linalg.norm(seen, axis=1, keepdims=True), -aims, atol=1e-12)


def test_point_light_points_lie_within_its_radius() -> None:
    for each in (
        gs.PointLight(position=(1.0, 2.0, 3.0), radius=0.5),
        gs.SpotLight(position=(1.0, 2.0, 3.0), radius=0.5),
    ):
        points = each.hard_lights(64)
        away = np.linalg.norm(np.array([light.position for light in points]) - each.position, axis=1)
        assert 0.4 < away.max() <= 0.5
        assert {light.radius for light in points} == {0.0}
        assert {type(light) for light in points} == {type(each)}


def test_light_without_size_has_one_point() -> None:
    sun = gs.DirectionalLight()
    assert sun.hard_lights(64) == (sun,)
    assert not sun.has_size
    assert gs.PointLight(position=(0, 1, 0), radius=1e-6).has_size
