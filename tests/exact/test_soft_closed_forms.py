"""Closed forms of visible light fractions: half planes, strips, corners and balls in front of a disc, by the tracer and by Exact()."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import quad

import glshadow as gs
from glshadow.scenes import shapes

POINTS, RAYS = 1024, 16384
SIZE = (48, 4)
HEIGHT = 2.0  # height of the casters above the floor
HALF = 0.1  # half width of the light, as a tangent seen from below

Exact = Callable[[np.ndarray, np.ndarray], np.ndarray]  # places on the floor, in units of the penumbra's half width


def beyond(x: float | np.ndarray) -> np.ndarray:
    """Fraction of the unit disc with x greater than the argument."""
    inside = np.clip(x, -1.0, 1.0)
    return np.asarray((np.arccos(inside) - inside * np.sqrt(1.0 - inside**2)) / np.pi)


def quadrant(x: float, y: float) -> float:
    """Fraction of the unit disc with x and y less than the arguments."""
    value, _ = quad(
        lambda s: max(min(np.sqrt(1.0 - s * s), y) + np.sqrt(1.0 - s * s), 0.0),
        -1.0,
        float(np.clip(x, -1.0, 1.0)),
        limit=400,
    )
    return float(value / np.pi)


def sheet(left: float, right: float, front: float = -40.0, back: float = 40.0, height: float = HEIGHT) -> gs.Mesh:
    return gs.Mesh(*shapes.rectangle((left, height, back), (right - left, 0, 0), (0, 0, front - back)))


# A light's point at the tangent (p, q) is hidden where the sheet covers floor + HEIGHT (p, q): a half plane over x < 0 hides p < -x.
CASES: dict[str, tuple[tuple[gs.Mesh, ...], Exact]] = {
    "half plane": ((sheet(-40.0, 0.0),), lambda x, z: beyond(-x)),
    "strip": ((sheet(-0.06, 0.06),), lambda x, z: 1.0 - beyond(-x - 0.3) + beyond(-x + 0.3)),
    "corner": ((sheet(-40.0, 0.0, front=-40.0, back=0.0),),
               lambda x, z: 1.0 - np.vectorize(quadrant)(-x, -z)),
    "two layers": ((sheet(-40.0, 0.0), sheet(-40.0, -0.05, height=1.0)),
                   lambda x, z: np.minimum(beyond(-x), beyond(-2.0 * (x + 0.25)))),
}  # fmt: skip


def scene_of(casters: tuple[gs.Mesh, ...]) -> gs.Scene:
    floor = gs.Mesh(*shapes.rectangle((-2, 0, 2), (4, 0, 0), (0, 0, -4)))
    nodes = [gs.Node(floor, np.eye(4), "floor")]
    return gs.Scene((*nodes, *(gs.Node(mesh, np.eye(4), f"caster {i}") for i, mesh in enumerate(casters))))


def camera_of(width: float) -> gs.OrthographicCamera:
    return gs.OrthographicCamera((0.0, 0.6, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, -1.0), height=width * SIZE[1] / SIZE[0])


@pytest.mark.parametrize("name", list(CASES))
@pytest.mark.parametrize("kind", ["sun", "spot", "point"])
def test_casters_before_a_disc_light(renderer: gs.Renderer, name: str, kind: str) -> None:
    casters, exact = CASES[name]
    far = 2000.0  # for local lights: there a disc that faces each receiver equals the disc of the directional light
    light: gs.Light = gs.DirectionalLight(direction=(0, -1, 0), angle=2.0 * float(np.degrees(np.arctan(HALF))))
    if kind == "spot":
        light = gs.SpotLight(
            position=(0, far, 0), direction=(0, -1, 0), outer_angle=5.0, inner_angle=5.0, radius=far * HALF
        )
    elif kind == "point":
        light = gs.PointLight(position=(0, far, 0), radius=far * HALF)
    scene, camera = scene_of(casters), camera_of(0.7)
    light = replace(light, shadow=gs.Shadow(filter=gs.Exact(light_samples=POINTS)))
    frame = renderer.render(scene, camera, [light], SIZE, outputs=("visibility", "position", "triangle"), samples=1)
    place = frame.position / (HEIGHT * HALF)
    expected = exact(place[..., 0], place[..., 2])
    assert ((expected > 0.05) & (expected < 0.95)).mean() > 0.2
    gap = np.abs(frame.visibility[0] - expected)
    assert gap.max() < 2.0 * POINTS**-0.75, "the discrepancy of a spiral, for up to two edges"
    assert gap.mean() < 0.5 * POINTS**-0.75
    if kind != "sun" and name != "corner":
        return  # the tracer takes seconds, and distinguishes local from directional lights by their rays alone
    truth = gs.trace(scene, camera, [light], SIZE, surface=frame.triangle, light_samples=RAYS, samples=1)
    error = np.abs(truth.visibility[0] - expected)
    # 16,384 rays, one in each ring of equal area: RAYS^-3/4 = 7e-4 where an edge cuts the disc; a finite height adds HEIGHT / far
    assert np.sqrt((error**2).mean()) < 1e-3
    assert error.max() < 5e-3


def cap_beyond(tilt: np.ndarray, half: float) -> np.ndarray:
    """Fraction of a spherical cap's solid angle on one side of a great circle whose plane is tilted away from the cap's axis; radians.

    By Gauss and Bonnet, of the area between the great circle and the cap's boundary: 2 chord - 2 cos(half) arc, their halves as angles;
    that of the cap is 2 pi (1 - cos(half)).
    """
    lean = np.clip(tilt, -half, half)
    chord, arc = np.arccos(np.sin(lean) / np.sin(half)), np.arccos(np.clip(np.tan(lean) / np.tan(half), -1.0, 1.0))
    return np.asarray((chord - np.cos(half) * arc) / (np.pi * (1.0 - np.cos(half))))


@pytest.mark.parametrize("angle", [60.0, 89.0])
def test_wide_directional_light_is_uniform_in_solid_angle(renderer: gs.Renderer, angle: float) -> None:
    """A half plane before a wide light: the plane through its edge and a point of the floor cuts the light's cap."""
    half = 0.5 * float(np.radians(angle))
    scene, camera = scene_of((sheet(-40.0, 0.0),)), camera_of(3.0)
    sun = gs.DirectionalLight(
        direction=(0, -1, 0), angle=angle, shadow=gs.Shadow(filter=gs.Exact(light_samples=POINTS))
    )
    frame = renderer.render(scene, camera, [sun], SIZE, outputs=("visibility", "position", "triangle"), samples=1)
    expected = cap_beyond(np.arctan(-frame.position[..., 0] / HEIGHT), half)
    assert np.ptp(expected) > 0.5
    gap = np.abs(frame.visibility[0] - expected)
    assert gap.max() < 1.3 * POINTS**-0.75, "the discrepancy of a spiral"
    truth = gs.trace(scene, camera, [sun], SIZE, surface=frame.triangle, light_samples=RAYS // 4, samples=1)
    # one in each ring of equal solid angle
    assert np.sqrt(((truth.visibility[0] - expected) ** 2).mean()) < 0.4 * (RAYS // 4) ** -0.75


def test_under_a_ball(renderer: gs.Renderer) -> None:
    """Below the ball's centre: one spherical cap occludes another."""
    radius, away = 0.06, 1.0
    positions, triangles = _ball(radius, away)
    scene = scene_of((gs.Mesh(positions, triangles),))
    camera = gs.OrthographicCamera((0.0, 0.5, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, -1.0), height=0.002)
    sun = gs.DirectionalLight(direction=(0, -1, 0), angle=2.0 * float(np.degrees(np.arctan(HALF))),
                              shadow=gs.Shadow(filter=gs.Exact(light_samples=POINTS)))  # fmt: skip
    frame = renderer.render(scene, camera, [sun], (8, 8), outputs=("visibility", "triangle"), samples=1)
    caster = np.arcsin(radius / away)  # a cap within a cap
    expected = float((np.cos(caster) - np.cos(np.arctan(HALF))) / (1.0 - np.cos(np.arctan(HALF))))
    assert np.abs(frame.visibility[0] - expected).max() < 2.0 * POINTS**-0.75
    truth = gs.trace(scene, camera, [sun], (8, 8), surface=frame.triangle, light_samples=RAYS, samples=1)
    assert np.abs(truth.visibility[0] - expected).mean() < 1e-3


def _ball(radius: float, height: float) -> tuple[np.ndarray, np.ndarray]:
    """A ball of 32,768 triangles, whose silhouette is off by 4e-5 of its radius."""
    lon, lat = np.meshgrid(np.linspace(0.0, 2.0 * np.pi, 256, endpoint=False), np.linspace(0.0, np.pi, 65))
    points = radius * np.stack([np.sin(lat) * np.cos(lon), np.cos(lat), np.sin(lat) * np.sin(lon)], axis=-1)
    number = np.arange(65 * 256).reshape(65, 256)
    a, b = number[:-1], np.roll(number, -1, axis=1)[:-1]
    c, d = number[1:], np.roll(number, -1, axis=1)[1:]
    triangles = np.concatenate(
        [np.stack([a, b, c], axis=-1).reshape(-1, 3), np.stack([b, d, c], axis=-1).reshape(-1, 3)]
    )
    return points.reshape(-1, 3) + np.array([0.0, height, 0.0]), triangles
