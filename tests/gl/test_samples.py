"""Multisampling: the image equals that of shading every sample, visibility that of rays, and nothing else changes."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

import glshadow as gs
from glshadow.core.sampling import SAMPLES
from glshadow.core.srgb import linear_from_srgb
from glshadow.lights import Light
from glshadow.scenes import shapes

from ..exact.test_casters import LIGHTS as LEAF_LIGHTS
from ..exact.test_casters import leaf, leaves, placed, scene_of
from ..pairwise import mostly

SIZE = (320, 180)
LIGHTS: dict[str, Light] = {
    "sun": gs.DirectionalLight(direction=(-0.55, -0.8, -0.25)),
    "spot": gs.SpotLight(position=(6.0, 9.0, 5.0), direction=(-6.0, -9.0, -5.0), inner_angle=44.0, outer_angle=45.0),
    "point light": gs.PointLight(position=(0.5, 2.2, 0.8)),
}
OUTPUTS = ("image", "linear", "alpha", "visibility")


@pytest.fixture(scope="module")
def older() -> Iterator[gs.Renderer]:
    """A renderer that shades every sample."""
    with gs.Renderer("egl") as renderer:
        renderer._context.caps = replace(renderer._context.caps, compute=False)
        yield renderer


@pytest.fixture(scope="module")
def courtyard() -> gs.Scene:
    return gs.scenes.courtyard()


@pytest.fixture(scope="module")
def masked() -> gs.Scene:
    image = leaves(8, 6)
    return scene_of(
        gs.Node(leaf(image), placed(-1.0, 1.0, 0.0, 1), "a"),
        gs.Node(leaf(image, 2.0), placed(1.0, 1.4, -0.5, 3), "b"),
        name="masked",
    )


def ball(normals: bool = True) -> gs.Scene:
    """A red ball with smooth normals over a blue floor, one behind the other."""
    positions, triangles = shapes.icosphere(3, 0.8)
    floor = shapes.rectangle((-2, -0.9, 2), (4, 0, 0), (0, 0, -4))
    smooth = (positions / 0.8).astype(np.float32) if normals else None
    meshes = (
        gs.Mesh(positions, triangles, smooth, material=gs.Material(color=(0.8, 0.2, 0.1, 1.0))),
        gs.Mesh(*floor, material=gs.Material(color=(0.2, 0.3, 0.8, 1.0))),
    )
    return gs.Scene(tuple(gs.Node(mesh, np.eye(4), str(i)) for i, mesh in enumerate(meshes)))


# -- against shading every sample


@pytest.mark.parametrize("samples", mostly(SAMPLES[1:], 8))
@pytest.mark.parametrize("which", ["courtyard", "masked", "ball"])
def test_image_equals_that_of_shading_every_sample(
    renderer: gs.Renderer, older: gs.Renderer, courtyard: gs.Scene, masked: gs.Scene, which: str, samples: int
) -> None:
    scene = {"courtyard": courtyard, "masked": masked, "ball": ball()}[which]
    shadow = gs.Shadow(filter=gs.Pcf(1))
    lights = [replace(light, shadow=shadow) for light in (LEAF_LIGHTS if which == "masked" else LIGHTS).values()]
    for count in (1, 3):
        ours = renderer.render(scene, None, lights[:count], SIZE, outputs=OUTPUTS, samples=samples)
        every = older.render(scene, None, lights[:count], SIZE, outputs=OUTPUTS, samples=samples)
        assert "all" in every.used[0].fallbacks[-1]
        np.testing.assert_array_equal(ours.alpha, every.alpha)
        np.testing.assert_array_equal(np.isnan(ours.visibility), np.isnan(every.visibility))
        off = np.abs(ours.linear - every.linear).max(axis=-1)
        # Shaded once: surfaces that continue smoothly, within 8 degrees and half a pixel: a Lambert term of 0.14 at most, and soft edges
        # of three texels, where the value at the centre is not quite the mean
        assert off.mean() < 1e-3 * (1 + count), f"{off.mean():.5f}"
        assert (off > 0.15 * count).mean() < 1e-3
        one = renderer.render(scene, None, lights[:count], SIZE, outputs=OUTPUTS, samples=1)
        assert off.mean() < 0.3 * np.abs(one.linear - every.linear).max(axis=-1).mean()


def test_shading_every_sample_equals_a_box_mean_in_numpy(older: gs.Renderer) -> None:
    """The same image four times as large in each direction, averaged here; without textures, whose mip level would differ."""
    scene = ball()
    fine = older.render(scene, None, None, (4 * SIZE[0], 4 * SIZE[1]), outputs=OUTPUTS, samples=1)
    mean = older.render(scene, None, None, SIZE, outputs=OUTPUTS, samples=16, tone="none")
    linear = fine.linear.reshape(SIZE[1], 4, SIZE[0], 4, 3).mean(axis=(1, 3))
    np.testing.assert_allclose(mean.linear, linear, atol=1e-6)
    np.testing.assert_allclose(linear_from_srgb(mean.image / 255.0), np.clip(linear, 0, 1), atol=5e-3)


# -- against rays


@pytest.mark.parametrize("name", mostly(LIGHTS, "sun", "spot"))
def test_more_samples_are_closer_to_the_traced_mean(renderer: gs.Renderer, courtyard: gs.Scene, name: str) -> None:
    light = LIGHTS[name]
    # its shadows are thinner than the pixels of a small image
    size = (480, 270) if name == "point light" else (320, 180)
    fine = gs.trace(courtyard, None, [light], size, samples=64)
    counted = fine.reached[0] & (fine.alpha == 1.0)
    errors = {}
    for samples in SAMPLES:
        frame = renderer.render(courtyard, None, [light], size, samples=samples)
        errors[samples] = float(np.abs(frame.visibility[0] - fine.visibility[0])[counted].mean())
    assert errors[4] < 0.6 * errors[1], errors
    assert errors[8] < 0.8 * errors[4], errors
    assert errors[16] < 0.7 * errors[8], errors


@pytest.mark.parametrize("samples", SAMPLES)
@pytest.mark.parametrize("name", list(LIGHTS))
def test_alpha_and_visibility_match_as_many_rays(
    renderer: gs.Renderer, courtyard: gs.Scene, name: str, samples: int
) -> None:
    light = LIGHTS[name]
    truth = gs.trace(courtyard, None, [light], SIZE, samples=samples)
    frame = renderer.render(courtyard, None, [light], SIZE, outputs=OUTPUTS, samples=samples)
    # GL snaps vertices to 1/256 pixel: an edge gains or loses a sample
    assert (frame.alpha != truth.alpha).mean() < 2e-3
    both = ~np.isnan(frame.visibility[0]) & ~np.isnan(truth.visibility[0])
    steps = np.abs(frame.visibility[0] - truth.visibility[0])[both & truth.reached[0]] * samples
    # and where a sample shows the neighbouring surface, its shadow differs; the rest are shadows so thin that no sample of the pixel hit
    # them: the point light, near the torus, casts many
    assert (steps > 1.5).mean() < (0.02 if name == "point light" else 0.01)
    assert steps.mean() / samples < (8e-3 if name == "point light" else 4e-3)
    error = gs.measure(frame, truth)
    assert error.acne + error.leak < (5e-3 if name == "point light" else 2e-4)


def test_measure_requires_equal_sample_counts(renderer: gs.Renderer, courtyard: gs.Scene) -> None:
    frame = renderer.render(courtyard, None, None, (64, 36), samples=4)
    with pytest.raises(gs.SettingsError, match=r"the frame has 4, the reference 1; use trace\(..., samples=4\)"):
        gs.measure(frame, gs.trace(courtyard, size=(64, 36), samples=1))


# -- invariants


@pytest.mark.parametrize("samples", SAMPLES[1:])
@pytest.mark.parametrize("name", list(LIGHTS))
def test_away_from_edges_nothing_changes(renderer: gs.Renderer, courtyard: gs.Scene, name: str, samples: int) -> None:
    one = renderer.render(courtyard, None, [LIGHTS[name]], SIZE, samples=1).visibility[0]
    many = renderer.render(courtyard, None, [LIGHTS[name]], SIZE, samples=samples).visibility[0]
    known = np.pad(np.nan_to_num(one, nan=0.5), 1, mode="edge")
    windows = np.lib.stride_tricks.sliding_window_view(known, (3, 3))
    flat = (windows.max(axis=(2, 3)) == windows.min(axis=(2, 3))) & ~np.isnan(one)
    assert flat.mean() > 0.3
    # except where something thinner than a pixel passes between the centres
    assert (many[flat] != one[flat]).mean() < 0.02


@pytest.mark.parametrize("samples", SAMPLES[1:])
def test_centre_outputs_equal_those_of_one_sample(renderer: gs.Renderer, masked: gs.Scene, samples: int) -> None:
    outputs = ("depth", "depth_metric", "triangle", "node", "normal", "position")
    one = renderer.render(masked, None, None, SIZE, outputs=outputs, samples=1)
    many = renderer.render(masked, None, None, SIZE, outputs=(*outputs, "image"), samples=samples)
    for name in outputs:
        np.testing.assert_array_equal(getattr(many, name), getattr(one, name))
    alone = renderer.render(masked, None, None, SIZE, outputs=("image",), samples=samples)
    np.testing.assert_array_equal(alone.image, many.image)


def test_image_is_deterministic(renderer: gs.Renderer, courtyard: gs.Scene) -> None:
    """The driver collects pixels in any order; the result must not depend on it."""
    lights = list(LIGHTS.values())
    pictures = [renderer.render(courtyard, None, lights, SIZE, outputs=OUTPUTS, samples=8) for _ in range(4)]
    for picture in pictures[1:]:
        for name in OUTPUTS:
            np.testing.assert_array_equal(getattr(picture, name), getattr(pictures[0], name))


def test_lights_and_image_sizes_share_buffers(renderer: gs.Renderer, courtyard: gs.Scene) -> None:
    lights = list(LIGHTS.values())
    for size in ((160, 90), (161, 89), (160, 90)):
        together = renderer.render(courtyard, None, lights, size, samples=4)
        for number, light in enumerate(lights):
            alone = renderer.render(courtyard, None, [light], size, samples=4)
            np.testing.assert_array_equal(together.visibility[number], alone.visibility[0])


def test_samples_beyond_the_buffer_are_shaded_in_batches(
    renderer: gs.Renderer, courtyard: gs.Scene, monkeypatch: pytest.MonkeyPatch
) -> None:
    lights = list(LIGHTS.values())
    whole = renderer.render(courtyard, None, lights, SIZE, outputs=OUTPUTS, samples=16)
    monkeypatch.setattr("glshadow.gl.passes.samples.MOST_SAMPLES", 16 * 777)
    parts = renderer.render(courtyard, None, lights, SIZE, outputs=OUTPUTS, samples=16)
    for name in OUTPUTS:
        np.testing.assert_array_equal(getattr(parts, name), getattr(whole, name))


def test_no_light(renderer: gs.Renderer) -> None:
    frame = renderer.render(ball(), None, [], SIZE, outputs=OUTPUTS, samples=4, ambient=0.5)
    assert frame.visibility.shape == (0, SIZE[1], SIZE[0])
    levels = np.unique(np.round(frame.alpha * 4))
    np.testing.assert_array_equal(levels, np.arange(5))
    np.testing.assert_allclose(frame.linear[frame.alpha == 1.0].max(axis=0), [0.4, 0.15, 0.4], atol=1e-6)


def test_too_large_image_is_refused(renderer: gs.Renderer) -> None:
    with pytest.raises(
        gs.SettingsError, match=r"16 samples of the image's pixels must be 1 to \d+ pixels wide and high"
    ):
        renderer.render(ball(), None, None, (8000, 10), samples=16)
