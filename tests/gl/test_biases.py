"""Biases on the GPU: a bias derived from a filter keeps planes free of acne, and a bias that is too small is reported."""

from __future__ import annotations

import numpy as np
import pytest

import glshadow as gs
from glshadow.core.spaces import Array
from glshadow.scenes import shapes

SIZE = (64, 48)
CAMERA = gs.PerspectiveCamera(position=(0.0, 6.0, 8.0), target=(0.0, 0.0, 0.0), fov_y=50.0)
GROUND = gs.Scene((gs.Node(gs.Mesh(*shapes.rectangle((-9, 0, 9), (18, 0, 0), (0, 0, -18))), np.eye(4), "ground"),), CAMERA)  # fmt: skip
FILTERS: tuple[gs.Filter, ...] = (gs.Hard(), gs.Pcf(1), gs.Pcf(4), gs.Disc(), gs.Poisson())
LIT = 1.0 - 1e-6  # up to 81 weights, summed in float32
DERIVED = (gs.SlopeScaledBias(), gs.NormalOffsetBias())


def drawn(renderer: gs.Renderer, tilt: float, filter_: gs.Filter, bias: gs.Bias) -> tuple[Array, gs.Used]:
    """Visibility of an infinite ground whose normal is tilted `tilt` degrees away from the light."""
    angle = np.radians(tilt)
    aim = (float(-np.sin(angle) * 0.8), float(-np.cos(angle)), float(-np.sin(angle) * 0.6))
    shadow = gs.Shadow(
        filter=filter_, bias=bias, resolution=256, fit=gs.SceneFit()
    )  # so that no point is near its border
    sun = gs.DirectionalLight(direction=aim, shadow=shadow)
    frame = renderer.render(GROUND, None, [sun], SIZE, outputs=("visibility",), samples=1)
    return frame.visibility[0], frame.used[0]


@pytest.mark.parametrize("bias", DERIVED, ids=str)
@pytest.mark.parametrize("filter_", FILTERS, ids=str)
def test_plane_is_lit_with_a_derived_bias(renderer: gs.Renderer, filter_: gs.Filter, bias: gs.Bias) -> None:
    for tilt in (10.0, 45.0, 70.0, 85.0, 89.0):
        seen, used = drawn(renderer, tilt, filter_, bias)
        assert np.nanmin(seen) > LIT, tilt
        assert used.bias == bias.derived(filter_.reach_texels)
        assert used.fallbacks == ()


@pytest.mark.parametrize("bias", [gs.SlopeScaledBias(1.1), gs.NormalOffsetBias(1.0), gs.ConstantBias(1e-3)], ids=str)
def test_too_small_bias_is_reported(renderer: gs.Renderer, bias: gs.Bias) -> None:
    """Without a report, under a smaller filter or a larger bias, the plane is lit."""
    seen, used = drawn(renderer, 60.0, gs.Pcf(1), bias)
    (said,) = used.fallbacks
    assert f"bias {bias} is too small for a filter that reads 2 texels" in said
    assert np.nanmin(seen) < 0.9
    enough = {
        "slope": gs.SlopeScaledBias(4.1),
        "normal-offset": gs.NormalOffsetBias(2.9),
        "constant": gs.ConstantBias(1.0),
    }
    seen, used = drawn(renderer, 60.0, gs.Pcf(1), enough[bias.spelling])
    assert used.fallbacks == ()
    assert np.nanmin(seen) > LIT
