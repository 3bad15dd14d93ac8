"""The camera pass runs again only if the visible surfaces may have changed; a moving light does not change them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import glshadow as gs
from glshadow.core.spaces import translation

SIZE = (96, 64)
OUTPUTS = ("image", "visibility", "linear", "depth", "triangle")


@pytest.fixture
def renderer() -> Iterator[gs.Renderer]:
    with gs.Renderer() as renderer:
        yield renderer


@pytest.fixture
def drawn(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """One entry for each time that the camera pass runs."""
    from glshadow.gl import draw

    times: list[int] = []
    original = draw.draw_surface

    def counted(*arguments: Any) -> None:
        times.append(len(times))
        original(*arguments)

    monkeypatch.setattr(draw, "draw_surface", counted)
    return times


def fresh(scene: gs.Scene, **options: Any) -> gs.Frame:
    with gs.Renderer() as other:
        return other.render(scene, size=SIZE, **{"samples": 1, **options})


@pytest.mark.parametrize("samples", [1, 4])
@pytest.mark.parametrize("shadow", [gs.Shadow(), gs.Shadow(filter=gs.Pcf())], ids=["exact", "map"])
def test_moving_light_reuses_the_camera_pass(
    renderer: gs.Renderer, drawn: list[int], shadow: gs.Shadow, samples: int
) -> None:
    scene = gs.scenes.box().scene
    for k in range(4):
        lights = [gs.DirectionalLight(direction=(-0.5, -1.0, 0.2 * k), shadow=shadow)]
        options: dict[str, Any] = {"lights": lights, "samples": samples, "outputs": OUTPUTS[:3], "ambient": 0.1 * k}
        frame = renderer.render(scene, size=SIZE, **options)
        assert len(drawn) == 1 + k  # one of ours, the others of fresh renderers
        expected = fresh(scene, **options)
        for name in expected.outputs:
            np.testing.assert_array_equal(frame.outputs[name], expected.outputs[name])


@pytest.mark.parametrize("samples", [1, 4])
def test_changed_inputs_run_the_camera_pass_again(renderer: gs.Renderer, drawn: list[int], samples: int) -> None:
    scene = gs.scenes.box().scene
    name = scene.nodes[-1].name
    changes: list[tuple[gs.Scene, dict[str, Any]]] = [
        (scene, {}),
        (scene, {"camera": replace(scene.camera, fov_y=30.0)}),
        (scene.moved({name: translation((0.3, 0.1, 0.0)) @ scene.nodes[-1].world_from_mesh}), {}),
        (scene, {"outputs": OUTPUTS}),  # other buffers
        (scene, {"outputs": OUTPUTS, "lights": [gs.DirectionalLight()] * 2}),
        (scene, {"samples": 8}),
    ]
    for changed, options in changes:
        settings: dict[str, Any] = {"samples": samples, "outputs": ("image",), **options}
        before = len(drawn)
        frame = renderer.render(changed, size=SIZE, **{"samples": 1, **settings})
        assert len(drawn) > before
        expected = fresh(changed, **settings)
        for each in expected.outputs:
            np.testing.assert_array_equal(frame.outputs[each], expected.outputs[each])


def test_pixel_centres_replace_samples_only_temporarily(renderer: gs.Renderer) -> None:
    scene = gs.scenes.box().scene
    for outputs in (("image",), ("image", "depth"), ("image",), ("depth",), ("image",)):
        frame = renderer.render(scene, size=SIZE, samples=4, outputs=outputs)
        expected = fresh(scene, samples=4, outputs=outputs)
        for name in outputs:
            np.testing.assert_array_equal(frame.outputs[name], expected.outputs[name])


def test_empty_view_is_reported_every_time(renderer: gs.Renderer) -> None:
    scene = gs.scenes.box().scene
    away = gs.PerspectiveCamera((0, 5, 50), (0, 5, 100))
    for _ in range(2):
        with pytest.warns(gs.GlshadowWarning, match="nothing is in view"):
            renderer.render(scene, away, size=SIZE, samples=1)
