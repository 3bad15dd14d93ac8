"""Exposure and tone map of rendered images: the GLSL against its twin, and what they change and leave alone."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import glshadow as gs
from glshadow.core.srgb import linear_from_srgb, srgb_from_linear
from glshadow.core.tone import displayed, neutral
from glshadow.gl.driver.context import GLContext
from glshadow.scene.mesh import AlphaMode
from glshadow.scenes import shapes
from tests.gl.test_twins_of_snippets import evaluated

SIZE = (120, 90)
BYTE = 1.0 / 255.0  # sRGB is fitted within 0.01 / 255, and bytes are rounded


def scene_of(*lights: gs.Light, blends: bool = False, **material: Any) -> gs.Scene:
    """A coloured box on a white plane, before the background; `blends`: above it a sheet that blends."""
    plane = gs.Mesh(*shapes.rectangle((-2, 0, 2), (4, 0, 0), (0, 0, -4)))
    box = gs.Mesh(*shapes.box((1, 1, 1), (0, 0.5, 0)), material=gs.Material(color=(0.9, 0.4, 0.1, 1.0), **material))
    sheet = gs.Mesh(
        *shapes.rectangle((-1.5, 1.5, 1.5), (3, 0, 0), (0, 0, -3)),
        material=gs.Material(color=(0.9, 0.9, 0.9, 0.5), alpha_mode=AlphaMode.BLEND),
    )
    nodes = [plane, box, *([sheet] if blends else [])]
    return gs.Scene(nodes, gs.PerspectiveCamera((3, 4, 5), (0, 0.4, 0)), lights or None)


SUN = gs.DirectionalLight(direction=(-0.5, -1.0, -0.3), intensity=2.5, color=(1.0, 0.9, 0.8))
BULB = gs.PointLight(position=(1.0, 3.0, 1.5), intensity=20.0, falloff=2.0)
COLORED = (1.0, 0.9, 0.2)
LIGHTS: dict[str, tuple[gs.Light, ...]] = {"sun": (SUN,), "both": (SUN, BULB), "none": ()}


def test_the_tone_map_is_that_of_its_twin(glcontext: GLContext, rng: np.random.Generator) -> None:
    colors = (10.0 ** rng.uniform(-3.0, 4.0, (512, 1)) * rng.uniform(0.0, 1.0, (512, 3))).astype(np.float32)
    found = evaluated(glcontext, "lib/tone.glsl", "vec4(toned(color), 0.0)", "#define GLS_TONE 1\n", color=colors)
    expected = neutral(colors)
    unchanged = colors.max(axis=1) <= np.float32(0.8)
    assert unchanged.any()
    np.testing.assert_array_equal(found[unchanged, :3], colors[unchanged])
    np.testing.assert_allclose(found[:, :3], expected, rtol=8.0 * 2.0**-24, atol=8.0 * 2.0**-24)  # eight roundings


@pytest.mark.parametrize(
    ("samples", "background", "name", "blends"),
    [
        (1, COLORED, "both", False),
        (4, COLORED, "sun", False),
        (4, None, "none", False),
        (1, None, "sun", True),
        (4, COLORED, "sun", True),
    ],
)
def test_image_is_that_of_the_linear_output(
    renderer: gs.Renderer, samples: int, background: Any, name: str, blends: bool
) -> None:
    """Scaled, tone mapped and encoded as the twin says, over a background that stays what it is; `linear` to the bit that without."""
    given: dict[str, Any] = {"size": SIZE, "samples": samples, "background": background}
    given |= {"lights": LIGHTS[name], "outputs": ("image", "linear", "alpha")}
    scene = scene_of(blends=blends)
    plain = renderer.render(scene, exposure=None, tone="none", **given)
    behind = None if background is None else linear_from_srgb(background)
    light = np.concatenate([plain.linear[..., :3], plain.alpha[..., None]], axis=2)
    for exposure, tone in ((None, "neutral"), (1.5, "neutral"), (-3.0, "none")):
        frame = renderer.render(scene, exposure=exposure, tone=tone, **given)
        np.testing.assert_array_equal(frame.linear, plain.linear)
        np.testing.assert_array_equal(frame.alpha, plain.alpha)
        scale = 1.0 if exposure is None else 2.0**exposure
        expected = srgb_from_linear(np.clip(displayed(light, behind, scale, tone), 0.0, 1.0))
        # straight colours of pixels of little alpha: divided by it
        error = np.abs(frame.image[..., :3] * BYTE - expected)[plain.alpha > (0.2 if background is None else -1.0)]
        assert error.max() <= 0.6 * BYTE
        assert (frame.exposure, frame.tone) == (exposure or 0.0, tone)
    empty = plain.alpha == 0.0
    assert empty.any()
    if background is not None:
        assert (frame.image[empty] == np.rint(255.0 * np.array(background))).all()


@pytest.mark.parametrize("samples", [1, 4])
def test_colors_up_to_the_start_stay_to_the_bit(renderer: gs.Renderer, samples: int) -> None:
    scene = scene_of(replace(SUN, intensity=1.2), blends=samples == 1)
    outputs = ("image", "linear", "alpha")
    plain = renderer.render(scene, size=SIZE, samples=samples, outputs=outputs, tone="none")
    frame = renderer.render(scene, size=SIZE, samples=samples, outputs=outputs)
    background = linear_from_srgb((0.81, 0.82, 0.84))
    alpha = plain.alpha[..., None]
    straight = (plain.linear - background * (1.0 - alpha)) / np.maximum(alpha, 1e-6)
    dark = straight.max(axis=2) <= 0.8 - 1e-5
    assert dark.any()
    assert (~dark).any()
    np.testing.assert_array_equal(frame.image[dark], plain.image[dark])
    assert (frame.image[~dark] != plain.image[~dark]).any(axis=1).mean() > 0.5
    assert (plain.image.min(axis=2) == 255).any()  # white was clipped,
    assert not (frame.image.min(axis=2) == 255).any()  # and is no longer


@pytest.mark.parametrize(("factor", "blends"), [(1e4, False), (1e-3, True)])
def test_scaled_lights_give_the_same_image(renderer: gs.Renderer, factor: float, blends: bool) -> None:
    """Also on a background, with the default ambient light, surfaces that emit, several lights and several samples."""
    scene = scene_of(SUN, BULB, emission=(0.2, 0.0, 0.1), blends=blends)
    stronger = [replace(each, intensity=each.intensity * factor) for each in scene.lights]
    one = renderer.render(scene, size=SIZE, exposure="auto")
    other = renderer.render(scene, lights=stronger, size=SIZE, exposure="auto")
    assert other.exposure == pytest.approx(one.exposure - np.log2(factor), abs=1e-9)
    # roundings of float32 that differ may move a value across the border of two bytes
    differs = np.abs(one.image.astype(int) - other.image)
    assert differs.max() <= 1
    assert (differs > 0).mean() < 1e-3
    turned = renderer.render(scene, lights=scene.lights[::-1], size=SIZE, exposure="auto")
    assert turned.exposure == one.exposure


def test_lights_in_candela_are_exposed_and_others_are_not(renderer: gs.Renderer) -> None:
    scene = scene_of(BULB)
    strong = replace(BULB, intensity=54_351.0)
    measured = renderer.render(scene, lights=replace(strong, photometric=True), size=SIZE)
    asked = renderer.render(scene, lights=strong, size=SIZE, exposure="auto")
    np.testing.assert_array_equal(measured.image, asked.image)
    assert measured.exposure == asked.exposure < -8.0
    assert not (measured.image.min(axis=2) == 255).any()
    assert renderer.render(scene, lights=strong, size=SIZE).exposure == 0.0
    # the default light as it is: to the bit the image without exposure
    sun = gs.DirectionalLight(intensity=0.8, photometric=True)
    np.testing.assert_array_equal(
        renderer.render(scene, lights=sun, size=SIZE).image,
        renderer.render(scene, lights=sun, size=SIZE, exposure=None).image,
    )


def test_exposure_does_not_depend_on_the_camera(renderer: gs.Renderer) -> None:
    scene = scene_of(replace(BULB, photometric=True))
    cameras = gs.orbit(scene.camera, 3)
    found = {frame.exposure for frame in renderer.sequence(scene, cameras, size=(32, 24))}
    assert len(found) == 1
    near = gs.PerspectiveCamera((0.6, 1.2, 0.6), (0.5, 1.0, 0.5))
    assert renderer.render(scene, near, size=(32, 24)).exposure in found


def test_a_catcher_before_white_stays_white(renderer: gs.Renderer) -> None:
    """Where no shadow falls, it shows the background to the bit, whatever exposure and tone map."""
    plane, box, *_ = scene_of().nodes
    scene = gs.Scene([replace(plane, catches=True), box], scene_of().camera, SUN)
    frame = renderer.render(scene, size=SIZE, background=(1.0, 1.0, 1.0), exposure=-2.0, outputs=("image", "alpha"))
    assert (frame.image[frame.alpha < 1e-6] == 255).all()
    assert (frame.image[frame.alpha > 0.9].max(axis=1) < 255).all()
