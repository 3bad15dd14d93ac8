"""Pcss: correct for one edge, wrong by known amounts for several blockers; the same width for every light, target and clip convention."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import glshadow as gs
from glshadow.scenes import shapes

SIZE = (96, 8)
HALF = 0.05  # tangent of the directional light's half angle
ANGLE = 2.0 * float(np.degrees(np.arctan(HALF)))
SUN = gs.DirectionalLight(direction=(0, -1, 0), angle=ANGLE)
HEIGHT = 1.0


def scene_of(*sheets: tuple[float, float, float]) -> gs.Scene:
    """A floor of 3 x 3, and sheets given by their x ranges and heights."""
    nodes = [gs.Node(gs.Mesh(*shapes.rectangle((-1.5, 0, 1.5), (3, 0, 0), (0, 0, -3))), np.eye(4), "floor")]
    for number, (left, right, height) in enumerate(sheets):
        mesh = gs.Mesh(*shapes.rectangle((left, height, 3), (right - left, 0, 0), (0, 0, -6)))
        nodes.append(gs.Node(mesh, np.eye(4), f"sheet {number}"))
    return gs.Scene(tuple(nodes))


def row(renderer: gs.Renderer, scene: gs.Scene, light: gs.Light, width: float = 0.4) -> tuple[np.ndarray, np.ndarray]:
    camera = gs.OrthographicCamera((0.0, 0.3, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, -1.0), height=width * SIZE[1] / SIZE[0])
    frame = renderer.render(scene, camera, [light], SIZE, outputs=("visibility", "position"), samples=1)
    assert frame.used[0].fallbacks == ()
    return (frame.position[..., 0]).mean(axis=0), frame.visibility[0].mean(axis=0)


def beyond(x: np.ndarray) -> np.ndarray:
    inside = np.clip(x, -1.0, 1.0)
    return np.asarray((np.arccos(inside) - inside * np.sqrt(1.0 - inside**2)) / np.pi)


def with_filter(light: gs.Light, filter: gs.Filter, **more: object) -> gs.Light:
    return replace(light, shadow=gs.Shadow(filter=filter, resolution=1024, fit=gs.SceneFit(), **more))  # type: ignore[arg-type]


LIGHTS: dict[str, gs.Light] = {
    "sun": SUN,
    "spot": gs.SpotLight(
        position=(0, 4, 0), direction=(0, -1, 0), outer_angle=30.0, inner_angle=30.0, radius=4.0 * HALF * 0.75
    ),
    "point": gs.PointLight(position=(0, 4, 0), radius=4.0 * HALF * 0.75),
}  # its disc, seen past an edge at height 1 from a floor 4 below it, is as wide as the directional light's


@pytest.mark.parametrize("target", [None, gs.Target.R32F])
@pytest.mark.parametrize("name", list(LIGHTS))
def test_penumbra_of_one_edge_has_the_exact_width(renderer: gs.Renderer, name: str, target: gs.Target | None) -> None:
    """V = (acos u - u sqrt(1 - u^2)) / pi over a half width of tan * height; 64 taps of two texels, and a texel of 3 / 1024."""
    x, seen = row(renderer, scene_of((-3.0, 0.0, HEIGHT)), with_filter(LIGHTS[name], gs.Pcss(64, 64), target=target))
    half = HALF * HEIGHT
    exact = beyond(-x / half)
    assert np.abs(seen - exact).max() < 0.08
    assert np.abs(seen - exact).mean() < 0.02
    inside = (seen > 0.02) & (seen < 0.98)
    # a texel of a cube map's face is 0.008 there
    assert np.ptp(x[inside]) == pytest.approx(2.0 * half, rel=0.25 if name == "point" else 0.2)


@pytest.mark.parametrize("clip", ["-1..1", "0..1", "0..1 reversed"])
def test_in_every_clip_convention(renderer: gs.Renderer, clip: str) -> None:
    space = {
        "-1..1": gs.ClipSpace(False, False),
        "0..1": gs.ClipSpace(True, False),
        "0..1 reversed": gs.ClipSpace(True, True),
    }[clip]
    scene = scene_of((-3.0, 0.0, HEIGHT))
    _, usual = row(renderer, scene, with_filter(LIGHTS["spot"], gs.Pcss()))
    _, seen = row(renderer, scene, with_filter(LIGHTS["spot"], gs.Pcss(), clip=space))
    np.testing.assert_allclose(seen, usual, atol=0.01)


def test_two_layers_are_treated_as_one(renderer: gs.Renderer) -> None:
    """A low sheet before a high one: their mean depth widens the low one's penumbra and narrows the high one's, by up to a third."""
    scene = scene_of((-3.0, 0.0, 1.0), (-3.0, 0.01, 0.15))
    _, exact = row(renderer, scene, replace(SUN, shadow=gs.Shadow()))
    _, seen = row(renderer, scene, with_filter(SUN, gs.Pcss(64, 64)))
    assert 0.08 < np.abs(seen - exact).max() < 0.5


def test_penumbra_wider_than_the_reach_is_clipped(renderer: gs.Renderer) -> None:
    """32 texels of 6 / 1024 to each side, where the exact penumbra reaches 0.3."""
    x, seen = row(renderer, scene_of((-3.0, 0.0, 6.0)), with_filter(SUN, gs.Pcss(64, 64)), width=0.8)
    inside = (seen > 0.02) & (seen < 0.98)
    assert 0.2 < np.ptp(x[inside]) < 2.0 * 33.0 * 6.0 / 1024.0 < 0.8 * 2.0 * HALF * 6.0


def test_light_without_size_is_hard(renderer: gs.Renderer) -> None:
    scene = scene_of((-3.0, 0.0, HEIGHT))
    sun = replace(SUN, angle=0.0)
    _, seen = row(renderer, scene, with_filter(sun, gs.Pcss()))
    _, bilinear = row(renderer, scene, with_filter(sun, gs.Pcf(0)))
    plateau = (bilinear == 0.0) | (bilinear == 1.0)
    assert (~plateau).sum() <= 3
    np.testing.assert_allclose(seen[plateau], bilinear[plateau], atol=1e-5)


def test_flat_ground_has_no_acne(renderer: gs.Renderer) -> None:
    """The receiver plane is followed over the whole kernel: no acne on a slope under a low light, and no lost plateau."""
    scene = gs.scenes.box().scene
    sun = gs.DirectionalLight(direction=(-0.9, -0.25, -0.3), angle=4.0, shadow=gs.Shadow(filter=gs.Pcss()))
    frame = renderer.render(scene, None, [sun], (160, 120), outputs=("visibility", "triangle"), samples=1)
    truth = gs.trace(scene, None, [sun], (160, 120), surface=frame.triangle, light_samples=64, samples=1)
    error = gs.measure(frame, truth)
    assert error.acne == 0.0
    assert error.mean < 0.02


def test_error_lies_between_hard_map_and_reference(renderer: gs.Renderer) -> None:
    scene = gs.scenes.courtyard()
    sun = replace(scene.lights[0], angle=3.0) if isinstance(scene.lights[0], gs.DirectionalLight) else SUN
    errors, truth = {}, None
    for filter in (gs.Pcf(1), gs.Pcss(), gs.Exact()):
        light = replace(sun, shadow=gs.Shadow(filter=filter))
        frame = renderer.render(scene, None, [light], (240, 135), outputs=("visibility", "triangle"), samples=1)
        truth = truth or gs.trace(
            scene, None, [light], (240, 135), surface=frame.triangle, light_samples=256, samples=1
        )
        tested = truth.reached[0] & (truth.cosine[0] > 0.05)
        errors[type(filter)] = float(np.abs(frame.visibility[0] - truth.visibility[0])[tested].mean())
    assert errors[gs.Exact] < 0.5 * errors[gs.Pcss] < 0.25 * errors[gs.Pcf], errors
