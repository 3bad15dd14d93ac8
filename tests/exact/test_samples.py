"""Several samples in a pixel: they converge to traced ones, and change nothing away from edges."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import glshadow as gs
from glshadow.core.filters.exact import SAMPLES
from glshadow.core.lights import Light
from glshadow.reference.trace import trace
from glshadow.reference.truth import Truth
from glshadow.renderer import Renderer
from glshadow.scene.mesh import Scene

SIZE = (640, 360)
LIGHTS: dict[str, Light] = {
    "sun": gs.DirectionalLight(direction=(-0.55, -0.8, -0.25)),
    "spot": gs.SpotLight(position=(6.0, 9.0, 5.0), direction=(-6.0, -9.0, -5.0), inner_angle=44.0, outer_angle=45.0),
    "point light": gs.PointLight(position=(0.5, 2.2, 0.8)),
}


@pytest.fixture(scope="module")
def courtyard() -> Scene:
    return gs.scenes.courtyard()


def visibility(renderer: Renderer, scene: Scene, light: Light, samples: int, size: tuple[int, int] = SIZE) -> gs.Frame:
    shadow = gs.Shadow(filter=gs.Exact(samples))
    return renderer.render(scene, None, [replace(light, shadow=shadow)], size, outputs=("visibility",))


def edges(values: np.ndarray) -> np.ndarray:
    """Pixels whose 3 x 3 neighbours are not all alike; where there is no surface counts as another value."""
    known = np.pad(np.nan_to_num(values, nan=0.5), 1, mode="edge")
    windows = np.lib.stride_tricks.sliding_window_view(known, (3, 3))
    return np.asarray(windows.max(axis=(2, 3)) - windows.min(axis=(2, 3)) > 0.0)


def inner(truth: Truth) -> np.ndarray:
    """Pixels whose 3 x 3 neighbours all lie in one plane: a silhouette's samples see two surfaces, one of which counts in both."""
    normal = np.nan_to_num(truth.normal)
    height = (normal * np.nan_to_num(truth.position)).sum(axis=-1)
    same = truth.triangle >= 0
    for dy in (-1, 0, 1):
        for dx in (-1, 0, 1):
            other = np.roll(normal, (dy, dx), (0, 1)), np.roll(height, (dy, dx), (0, 1))
            same &= (np.abs(other[0] - normal).max(axis=-1) < 1e-6) & (np.abs(other[1] - height) < 1e-5)
    return same


@pytest.mark.parametrize("name", list(LIGHTS))
def test_more_samples_are_nearer_to_the_traced_mean(renderer: Renderer, courtyard: Scene, name: str) -> None:
    light = LIGHTS[name]
    size = (
        SIZE if name == "point light" else (480, 270)
    )  # the lamp's shadows are thinner than the pixels of a small picture
    truth = trace(courtyard, None, [light], size, pixel_samples=4)
    counted = inner(truth) & truth.reached[0]
    assert counted.mean() > 0.3
    errors = {}
    for samples in SAMPLES:
        values = visibility(renderer, courtyard, light, samples, size).visibility
        assert values is not None
        errors[samples] = float(np.abs(values[0] - truth.visibility[0])[counted].mean())
    # 16 points are those of the trace; 8 and 4 are nearer than the pixel's middle
    assert errors[4] < 0.6 * errors[1], errors
    assert errors[8] < errors[4], errors
    assert errors[16] < 0.1 * errors[8], errors
    # Left are shadows so thin that no pixel's middle meets them: the lamp, near the torus, throws many; sun and spot none.
    assert errors[16] < (1e-3 if name == "point light" else 3e-5), errors


@pytest.mark.parametrize("samples", SAMPLES[1:])
@pytest.mark.parametrize("name", list(LIGHTS))
def test_away_from_edges_nothing_changes(renderer: Renderer, courtyard: Scene, name: str, samples: int) -> None:
    one = visibility(renderer, courtyard, LIGHTS[name], 1).visibility
    many = visibility(renderer, courtyard, LIGHTS[name], samples).visibility
    assert one is not None
    assert many is not None
    np.testing.assert_array_equal(np.isnan(many), np.isnan(one))
    flat = ~edges(one[0]) & ~np.isnan(one[0])
    assert flat.sum() > 50_000
    np.testing.assert_array_equal(many[0][flat], one[0][flat])
    steps = many[0][~np.isnan(many[0])] * samples
    np.testing.assert_allclose(steps, np.round(steps), atol=1e-4)
    between = (many[0] > 0.0) & (many[0] < 1.0)
    assert between.sum() > 500
    assert not (between & flat).any()


def test_samples_beside_a_pixels_own_triangle(renderer: Renderer) -> None:
    """A sample may miss its pixel's triangle; it then lies on that one's plane, no farther off than the triangle reaches."""
    scene = gs.scenes.box(30.0, 30.0).scene
    size = (320, 180)
    truth = trace(scene, None, scene.lights, size, pixel_samples=4)
    for samples in SAMPLES[1:]:
        frame = visibility(renderer, scene, scene.lights[0], samples, size)
        assert np.nanmean(np.abs(frame.visibility[0] - truth.visibility[0])) < 2e-3


def test_the_same_pixels_are_sampled_every_time(renderer: Renderer, courtyard: Scene) -> None:
    """Pixels are collected in whatever order the driver takes them; which ones they are must not depend on it."""
    for light in LIGHTS.values():
        pictures = [visibility(renderer, courtyard, light, 8).visibility for _ in range(4)]
        for picture in pictures[1:]:
            np.testing.assert_array_equal(picture, pictures[0])


def test_several_lights_and_sizes_share_the_samples(renderer: Renderer, courtyard: Scene) -> None:
    lights = [replace(light, shadow=gs.Shadow(filter=gs.Exact(4))) for light in LIGHTS.values()]
    for size in ((160, 90), (161, 89), (160, 90)):
        together = renderer.render(courtyard, None, lights, size, outputs=("visibility",)).visibility
        assert together is not None
        for number, light in enumerate(lights):
            alone = renderer.render(courtyard, None, [light], size, outputs=("visibility",)).visibility
            assert alone is not None
            np.testing.assert_array_equal(together[number], alone[0])
