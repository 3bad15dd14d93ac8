"""Transparent images: alpha is coverage, straight in bytes and premultiplied in floats; a shadow catcher shows the light that it loses."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import glshadow as gs
from glshadow.core.srgb import linear_from_srgb
from glshadow.scenes import shapes

SIZE = (200, 150)
LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
LIGHTS: dict[str, tuple[gs.Light, ...]] = {
    "sun": (gs.DirectionalLight(direction=(-0.55, -0.8, -0.25), intensity=0.8),),
    "spot and lamp": (
        gs.SpotLight(position=(2, 4, 2), direction=(-2, -4, -2), outer_angle=40.0, intensity=0.5),
        gs.PointLight(position=(-1.5, 3, 1), intensity=0.3, color=(1.0, 1.0, 1.0)),
    ),
}


def scene_of(catches: bool, lights: tuple[gs.Light, ...], body: bool = True) -> gs.Scene:
    """A box above a white plane that fills the image."""
    plane = gs.Mesh(*shapes.rectangle((-30, 0, 30), (60, 0, 0), (0, 0, -60)))
    box = gs.Mesh(*shapes.box((1, 1, 1), (0, 0.9, 0)), material=gs.Material(color=(0.8, 0.3, 0.2, 1.0)))
    nodes = [gs.Node(plane, np.eye(4), "plane", catches=catches)]
    nodes += [gs.Node(box, np.eye(4), "box")] if body else []
    return gs.Scene(tuple(nodes), gs.PerspectiveCamera((3, 4, 5), (0, 0.4, 0)), lights)


@pytest.mark.parametrize("samples", [1, 4])
@pytest.mark.parametrize("name", list(LIGHTS))
@pytest.mark.parametrize("strength", [1.0, 0.6])
def test_catcher_over_the_unshadowed_plane_gives_the_shadowed_plane(
    renderer: gs.Renderer, name: str, samples: int, strength: float
) -> None:
    lights = tuple(replace(light, shadow=gs.Shadow(strength=strength)) for light in LIGHTS[name])
    given: Any = {"size": SIZE, "outputs": ("image", "linear", "alpha"), "samples": samples, "tone": "none"}
    wanted = renderer.render(scene_of(False, lights), **given)
    below = renderer.render(scene_of(False, lights, body=False), **given)
    caught = renderer.render(scene_of(True, lights), background=None, **given)
    assert caught.image.shape == (SIZE[1], SIZE[0], 4)
    light = caught.linear[..., :3] + (1.0 - caught.linear[..., 3:]) * below.linear
    # with several samples the mean of products is not the product of means where the light changes within a pixel
    np.testing.assert_allclose(light, wanted.linear, atol=1e-5 if samples == 1 else 6e-3)
    # and from the bytes alone, straight alpha, composited in linear light
    alpha = caught.image[..., 3:] / 255.0
    bytes_ = linear_from_srgb(caught.image[..., :3] / 255.0) * alpha + (1.0 - alpha) * linear_from_srgb(
        below.image / 255.0
    )
    shown = np.round(255.0 * np.where(bytes_ <= 0.0031308, 12.92 * bytes_, 1.055 * bytes_ ** (1 / 2.4) - 0.055))
    assert np.abs(shown - wanted.image).max() <= 2.0
    assert (caught.alpha > 0.2).any()
    assert (caught.alpha < 1e-6).any()


def test_catcher_matches_the_formula(renderer: gs.Renderer) -> None:
    """alpha = 1 - (luminance with shadow) / (luminance without), with a coloured light and a coloured ambient term."""
    sun = gs.DirectionalLight(direction=(0, -1, 0), color=(1.0, 0.5, 0.2), intensity=0.7)
    ambient = ((0.1, 0.2, 0.4), (0.3, 0.0, 0.0))
    frame = renderer.render(
        scene_of(True, (sun,)),
        size=SIZE,
        background=None,
        ambient=ambient,
        outputs=("alpha", "node", "visibility"),
        samples=1,
    )
    plane = frame.node == 0
    above = LUMINANCE @ ambient[0]
    dark = 1.0 - above / (above + LUMINANCE @ (0.7 * np.array(sun.color)))
    shadowed = plane & (frame.visibility[0] == 0.0)
    assert shadowed.sum() > 50
    np.testing.assert_allclose(frame.alpha[shadowed], dark, atol=1e-5)
    np.testing.assert_allclose(frame.alpha[plane & (frame.visibility[0] == 1.0)], 0.0, atol=1e-6)
    np.testing.assert_array_equal(frame.alpha[frame.node == 1], 1.0)


def test_catcher_darkens_the_background(renderer: gs.Renderer) -> None:
    scene, color = scene_of(True, LIGHTS["sun"]), (0.2, 0.5, 0.8)
    over = renderer.render(scene, size=SIZE, background=color, outputs=("linear", "alpha"), samples=4)
    alone = renderer.render(scene, size=SIZE, background=None, outputs=("linear",), samples=4).linear
    expected = alone[..., :3] + (1.0 - alone[..., 3:]) * linear_from_srgb(color)
    np.testing.assert_allclose(over.linear, expected, atol=1e-6)
    assert over.linear.shape[-1] == 3
    np.testing.assert_allclose(over.alpha, alone[..., 3], atol=1e-6)


@pytest.mark.parametrize("samples", [1, 4, 16])
def test_alpha_is_the_covered_share(renderer: gs.Renderer, samples: int) -> None:
    scene = gs.scenes.box().scene
    frame = renderer.render(scene, size=SIZE, background=None, outputs=("image", "linear", "alpha"), samples=samples)
    np.testing.assert_array_equal(np.unique(np.round(frame.alpha * samples) - frame.alpha * samples), 0.0)
    np.testing.assert_array_equal(frame.linear[..., 3], frame.alpha)
    np.testing.assert_array_equal(frame.image[..., 3], np.rint(255.0 * frame.alpha))
    np.testing.assert_array_equal(frame.linear[frame.alpha == 0.0], 0.0)
    # straight against premultiplied
    some = frame.alpha > 0.0
    straight = np.clip(frame.linear[..., :3][some] / frame.alpha[some][:, None], 0.0, 1.0)
    np.testing.assert_allclose(linear_from_srgb(frame.image[..., :3][some] / 255.0), straight, atol=5e-3)


def test_compositing_over_a_background_gives_the_opaque_image(renderer: gs.Renderer) -> None:
    scene = gs.scenes.courtyard()
    for color in ((0.0, 0.0, 0.0), (0.3, 0.9, 0.5)):
        opaque = renderer.render(scene, size=SIZE, background=color, outputs=("linear",), samples=8).linear
        alone = renderer.render(scene, size=SIZE, background=None, outputs=("linear",), samples=8).linear
        np.testing.assert_allclose(alone[..., :3] + (1.0 - alone[..., 3:]) * linear_from_srgb(color), opaque, atol=1e-6)


def test_ground_as_a_catcher() -> None:
    scene = gs.scenes.box().scene
    plain, catching = scene.with_ground(), scene.with_ground(catches=True)
    assert [node.catches for node in plain.nodes] == [False] * len(plain.nodes)
    assert catching.nodes[-1].catches
    np.testing.assert_array_equal(catching.nodes[-1].mesh.positions, plain.nodes[-1].mesh.positions)


def test_files_keep_alpha(renderer: gs.Renderer, tmp_path_factory: pytest.TempPathFactory) -> None:
    import OpenImageIO as oiio

    folder = tmp_path_factory.mktemp("alpha")
    outputs = ("image", "linear", "alpha", "depth", "normal", "position", "node", "visibility")
    frame = renderer.render(gs.scenes.box().scene, size=SIZE, background=None, outputs=outputs, samples=4)
    frame.save(folder / "a.png")
    np.testing.assert_array_equal(gs.image.read(folder / "a.png"), frame.image)
    frame.save(folder / "a.exr")
    buffer = oiio.ImageBuf(str(folder / "a.exr"))
    names, pixels = list(buffer.spec().channelnames), buffer.get_pixels(oiio.FLOAT)
    channel = {name: pixels[..., k] for k, name in enumerate(names)}
    assert {"R", "G", "B", "A", "Z", "N.X", "N.Y", "N.Z", "P.X", "P.Y", "P.Z", "node", "visibility.0"} == set(names)
    np.testing.assert_array_equal(np.stack([channel[c] for c in "RGBA"], axis=-1), frame.linear)
    np.testing.assert_array_equal(channel["Z"], frame.depth)
    np.testing.assert_array_equal(channel["N.Y"], frame.normal[..., 1])
    np.testing.assert_array_equal(channel["node"].astype(int), frame.node)
