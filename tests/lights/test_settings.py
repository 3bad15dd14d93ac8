"""Lights: refused settings, directions and distances, and the cone."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from glshadow.errors import SettingsError
from glshadow.lights import DirectionalLight, PointLight, SpotLight
from glshadow.shadows.shadow import Shadow

SPOT = {"position": (0.0, 4.0, 0.0)}


def test_defaults() -> None:
    sun = DirectionalLight()
    assert sun.shadow == Shadow()
    assert (sun.color, sun.intensity, sun.angle, sun.near, sun.far) == ((1.0, 1.0, 1.0), 1.0, 0.0, None, None)
    spot = SpotLight(position=(1, 2, 3))
    assert spot.position == (1.0, 2.0, 3.0)
    assert (spot.inner_angle, spot.outer_angle, spot.radius, spot.range, spot.falloff) == (20.0, 30.0, 0.0, None, 0.0)
    assert PointLight(position=(1, 2, 3), shadow=None).shadow is None


def test_direction_is_normalised_whatever_its_length() -> None:
    for length in (1e-20, 1.0, 1e20):
        for light in (
            DirectionalLight(direction=(0, -3 * length, 4 * length)),
            SpotLight(**SPOT, direction=(0, -3 * length, 4 * length)),
        ):
            np.testing.assert_allclose(light.direction, (0.0, -0.6, 0.8), rtol=1e-15)
            assert all(type(number) is float for number in light.direction)


def test_a_copy_has_the_same_direction_to_the_last_bit() -> None:
    for direction in np.random.default_rng(5).normal(size=(200, 3)):
        light = DirectionalLight(direction=tuple(direction))
        assert replace(light, intensity=2.0).direction == light.direction


def test_lights_are_frozen_values() -> None:
    assert PointLight(position=np.array([1, 2, 3])) == PointLight(position=(1.0, 2.0, 3.0))
    assert hash(PointLight(position=(1, 2, 3))) == hash(PointLight(position=[1, 2, 3]))
    with pytest.raises(AttributeError):
        DirectionalLight().intensity = 2.0  # type: ignore[misc]


# (constructor, keyword arguments, what the message must name, the refused value)
REFUSED = [
    (DirectionalLight, {"direction": (0, 0, 0)}, "direction", "zero"),
    (DirectionalLight, {"direction": (np.nan, 0, 1)}, "direction", "nan"),
    (DirectionalLight, {"direction": (1, 2)}, "direction", "1, 2"),
    (DirectionalLight, {"angle": -1.0}, r"angle must be a finite number in \[0, 90\)", "-1.0"),
    (DirectionalLight, {"angle": 90.0}, r"angle must be a finite number in \[0, 90\)", "90.0"),
    (DirectionalLight, {"color": (1, -1, 1)}, r"color must be 3 finite numbers, each in \[0, 1e\+38\]", "-1"),
    (DirectionalLight, {"color": (1, np.nan, 1)}, "color", "nan"),
    (DirectionalLight, {"color": 1.0}, "color", "1.0"),
    (DirectionalLight, {"intensity": -0.1}, r"intensity must be a finite number in \[0, 1e\+38\]", "-0.1"),
    (DirectionalLight, {"intensity": np.nan}, r"intensity must be a finite number in \[0, 1e\+38\]", "nan"),
    (DirectionalLight, {"intensity": np.inf}, r"intensity must be a finite number in \[0, 1e\+38\]", "inf"),
    (DirectionalLight, {"near": 5.0, "far": 5.0}, "near must be less than far", "near=5.0, far=5.0"),
    (DirectionalLight, {"near": np.nan}, r"near must be a finite number in \[-1e\+20, 1e\+20\]", "nan"),
    (DirectionalLight, {"far": np.inf}, r"far must be a finite number in \[-1e\+20, 1e\+20\]", "inf"),
    (DirectionalLight, {"shadow": "pcf"}, r"shadow must be Shadow or None \(casts nothing\)", "'pcf'"),
    (SpotLight, {"position": (0, np.inf, 0)}, "position", "inf"),
    (SpotLight, {**SPOT, "direction": (0, 0, 0)}, "direction", "zero"),
    (
        SpotLight,
        {**SPOT, "inner_angle": 31.0},
        "inner_angle must not be greater than outer_angle",
        "inner_angle=31.0, outer_angle=30.0",
    ),
    (
        SpotLight,
        {**SPOT, "inner_angle": 0.0, "outer_angle": 0.0},
        r"outer_angle must be a finite number in \(0, 90\)",
        "0.0",
    ),
    (SpotLight, {**SPOT, "inner_angle": -1.0}, r"inner_angle must be a finite number in \[0, 90\)", "-1.0"),
    (SpotLight, {**SPOT, "outer_angle": 90.0}, r"outer_angle must be a finite number in \(0, 90\)", "90.0"),
    (SpotLight, {**SPOT, "outer_angle": np.nan}, r"outer_angle must be a finite number in \(0, 90\)", "nan"),
    (PointLight, {**SPOT, "radius": -1.0}, r"radius must be a finite number in \[0, 1e\+20\]", "-1.0"),
    (PointLight, {**SPOT, "range": 0.0}, r"range must be a finite number in \[1e-20, 1e\+20\] or None", "0.0"),
    (PointLight, {**SPOT, "range": np.inf}, r"range must be a finite number in \[1e-20, 1e\+20\] or None", "inf"),
    (PointLight, {**SPOT, "falloff": 8.5}, r"falloff must be a finite number in \[0, 8\]", "8.5"),
    (PointLight, {**SPOT, "near": 0.0}, r"near must be a finite number in \[1e-20, 1e\+20\]", "0.0"),
    (PointLight, {**SPOT, "near": 3.0, "far": 2.0}, "near must be less than far", "near=3.0, far=2.0"),
]


@pytest.mark.parametrize(("build", "arguments", "named", "value"), REFUSED)
def test_refused(build: type, arguments: dict[str, object], named: str, value: str) -> None:
    with pytest.raises(SettingsError, match=named) as caught:
        build(**arguments)
    assert value in str(caught.value)


def test_edges_of_the_ranges_are_allowed() -> None:
    DirectionalLight(angle=89.999, intensity=0.0, near=-5.0, far=5.0)
    SpotLight(**SPOT, inner_angle=0.0, outer_angle=89.0)
    SpotLight(**SPOT, inner_angle=30.0, outer_angle=30.0)
    PointLight(**SPOT, falloff=8.0, near=1e-6, far=1e6)


def test_direction_to_a_directional_light() -> None:
    points = np.random.default_rng(3).normal(size=(4, 5, 3))
    towards, distance = DirectionalLight(direction=(0, -3, 4)).to_light(points)
    np.testing.assert_allclose(towards, np.broadcast_to([0.0, 0.6, -0.8], points.shape), rtol=1e-15)
    assert distance.shape == (4, 5)
    assert np.isposinf(distance).all()


def test_direction_to_a_point_light() -> None:
    points = np.array([[0.0, 0.0, 0.0], [3.0, 4.0, 0.0], [0.0, 5.0, 0.0], [0.0, 4.0, 0.0]])
    towards, distance = PointLight(position=(0, 4, 0)).to_light(points)
    np.testing.assert_allclose(towards, [[0, 1, 0], [-1, 0, 0], [0, -1, 0], [0, 0, 0]], atol=1e-15)
    np.testing.assert_allclose(distance, [4, 3, 1, 0], rtol=1e-15)  # at the light itself: no division by zero


def at_angle(degrees: np.ndarray) -> np.ndarray:
    """Points at an angle from the axis of a spot light at (0, 4, 0) that looks down."""
    angle = np.radians(degrees)
    return np.stack([7.0 * np.sin(angle), 4.0 - 7.0 * np.cos(angle), 0.0 * angle], axis=-1)


def test_cone_is_smooth_between_its_angles() -> None:
    light = SpotLight(**SPOT, inner_angle=20.0, outer_angle=30.0)
    assert (light.cone(at_angle(np.array([0.0, 10.0, 19.999]))) == 1.0).all()
    assert (light.cone(at_angle(np.array([30.001, 60.0, 90.0, 179.0]))) == 0.0).all()
    inner, outer = np.cos(np.radians([20.0, 30.0]))
    half_way = np.degrees(np.arccos(0.5 * (inner + outer)))
    np.testing.assert_allclose(light.cone(at_angle(np.array([half_way]))), 0.5, rtol=1e-12)
    strength = light.cone(at_angle(np.linspace(20.0, 30.0, 400)))
    assert (np.diff(strength) <= 0.0).all()
    # smoothstep: flat at both ends, steepest (3/2 of the mean slope) in the middle, in the cosine.
    assert strength[0] - strength[1] < 1e-4
    assert strength[-2] - strength[-1] < 1e-4


def test_cone_with_equal_angles_is_a_step() -> None:
    light = SpotLight(**SPOT, inner_angle=25.0, outer_angle=25.0)
    np.testing.assert_array_equal(light.cone(at_angle(np.array([0.0, 24.999, 25.001, 170.0]))), [1.0, 1.0, 0.0, 0.0])
