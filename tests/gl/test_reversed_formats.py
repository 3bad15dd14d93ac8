"""Formats with equal steps neither gain nor lose by reversed depth: a local light's near plane is chosen for the far end's resolution."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import glshadow as gs

SIZE = (160, 90)
LIGHTS = (
    gs.PointLight(position=(0.0, 6.0, 0.0)),
    gs.SpotLight(position=(0.0, 2.5, 1.0), direction=(-0.4, -0.1, -1.0), outer_angle=50.0),
)


@pytest.fixture(scope="module")
def scene() -> gs.Scene:
    return gs.scenes.courtyard()


@pytest.mark.parametrize("target", [gs.Target.DEPTH16, gs.Target.DEPTH24], ids=str)
@pytest.mark.parametrize("light", LIGHTS, ids=["point", "spot"])
def test_reversed_depth_is_as_accurate(
    renderer: gs.Renderer, scene: gs.Scene, light: gs.Light, target: gs.Target
) -> None:
    """Inside the courtyard, whose boxes enclose the light, so that its near plane is a fraction of far."""
    seen, nears = [], []
    for reverse in (False, True):
        shadow = gs.Shadow(filter=gs.Hard(), target=target, clip=gs.ClipSpace(True, reverse), resolution=1024)
        frame = renderer.render(scene, None, [replace(light, shadow=shadow)], SIZE, outputs=("visibility",), samples=1)
        seen.append(np.nan_to_num(frame.visibility[0]))
        nears.append((frame.used[0].views[0].near, frame.used[0].views[0].far))
    assert nears[0] == nears[1]
    assert nears[0][0] < 0.02 * nears[0][1]
    # values that round to the other of two steps: a step of 16 bits is wider than the bias's margin at an edge
    assert (np.abs(seen[0] - seen[1]) > 0.5).sum() <= 3
    reached = gs.trace(scene, None, [light], SIZE, samples=1).reached[0]
    assert 0.02 < (seen[0][reached] == 0.0).mean() < 0.98
