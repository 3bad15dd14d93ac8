"""Rectangular area lights: what they refuse, and what a filter for point lights does with them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import glshadow as gs

RECT = gs.RectLight(position=(2.0, 4.0, 1.0), direction=(-2.0, -4.0, -1.0), width=1.0, height=0.6)
SIZE = (96, 54)


@pytest.mark.parametrize("name", ["radius", "falloff", "near", "far", "cookie", "angle"])
def test_missing_settings_are_refused(name: str) -> None:
    with pytest.raises(gs.SettingsError, match=f"RectLight has no {name}=1.0; it takes .*width, height"):
        gs.RectLight(position=(0, 1, 0), **{name: 1.0})  # type: ignore[arg-type]


def test_up_along_the_direction_is_refused() -> None:
    with pytest.raises(gs.SettingsError, match="up must not be parallel to direction"):
        gs.RectLight(position=(0, 1, 0), direction=(0, 1, 0), up=(0, -2, 0))


def test_point_filter_uses_the_centre_of_the_rectangle(renderer: gs.Renderer) -> None:
    scene, shadow = gs.scenes.box().scene, gs.Shadow(filter=gs.Pcf(1), resolution=512)
    frame = renderer.render(
        scene, None, [replace(RECT, shadow=shadow)], SIZE, outputs=("visibility", "triangle"), samples=1
    )
    assert any("size is ignored" in said for said in frame.used[0].fallbacks)
    middle = gs.PointLight(position=RECT.position, shadow=shadow)
    of_a_point = renderer.render(scene, None, [middle], SIZE, outputs=("visibility", "triangle"), samples=1)
    known = frame.triangle >= 0
    # at the horizon the centre may be on one side and a part of the rectangle on the other: edge-on surfaces only
    assert (np.abs(frame.visibility[0] - of_a_point.visibility[0])[known] > 1e-6).mean() < 1e-3


@pytest.mark.parametrize("filter", [gs.Exact(), gs.Pcf(1), gs.LightSamples(16)], ids=str)
def test_visibility_behind_it_is_zero(renderer: gs.Renderer, filter: gs.Filter) -> None:
    scene = gs.scenes.box().scene
    above = gs.RectLight(position=(0.5, 3.0, 0.4), direction=(0.3, 1.0, 0.1), shadow=gs.Shadow(filter=filter))
    frame = renderer.render(scene, None, [above], SIZE, outputs=("visibility", "triangle", "position"), samples=1)
    known = frame.triangle >= 0
    behind = ~above.shines_on(np.nan_to_num(frame.position.astype(np.float64)))
    assert (known & behind).mean() > 0.2
    np.testing.assert_array_equal(frame.visibility[0][known & behind], 0.0)


def test_direction_rotates_the_whole_rectangle() -> None:
    turn = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])
    turned = RECT.turned(turn, np.zeros(3))
    np.testing.assert_allclose(turned.axes, RECT.axes @ turn.T, atol=1e-12)
    np.testing.assert_allclose(turned.position, turn @ np.asarray(RECT.position), atol=1e-12)
