"""Lights that share a texture: each map as if it were alone, regardless of the order of drawing."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import glshadow as gs
from glshadow.gl.techniques import Mapped
from glshadow.shadows.channel import Channel

SIZE = (240, 136)
SCENE = gs.scenes.courtyard()
LIGHTS: tuple[gs.Light, ...] = (
    gs.SpotLight(position=(6, 7, 6), direction=(-6, -7, -6), outer_angle=35),
    gs.SpotLight(position=(-7, 6, 3), direction=(7, -6, -3), outer_angle=40),
    gs.DirectionalLight(),
    gs.DirectionalLight(direction=(0.4, -0.7, 0.3)),
)
DEPTH_TEST = 2e-5
"""Error of the metric: at silhouettes, where front and back meet, a third of a float depth buffer confuses the two."""
SNAPPED = 12
"""Texels of four million that show another surface: GL may order two at the same depth in either way."""


def with_shadow(lights: tuple[gs.Light, ...], **more: object) -> tuple[gs.Light, ...]:
    shadow = gs.Shadow(filter=gs.Pcf(1), resolution=1024, **more)  # type: ignore[arg-type]
    return tuple(replace(each, shadow=shadow) for each in lights)


@pytest.mark.parametrize("count", [1, 2, 3, 4])
@pytest.mark.parametrize("target", [gs.Target.R32F, gs.Target.R16F, gs.Target.R8], ids=lambda each: each.value)
def test_packed_maps_equal_separate_maps(renderer: gs.Renderer, count: int, target: gs.Target) -> None:
    lights = with_shadow(LIGHTS[:count], target=target)
    outputs = ("visibility", "shadow_maps")
    alone = renderer.render(SCENE, None, lights, SIZE, outputs=outputs, samples=1)
    packed = renderer.render(SCENE, None, gs.PackedShadow(lights), SIZE, outputs=outputs, samples=1)
    for number in range(count):
        assert packed.shadow_maps[number].shape == (1, 1024, 1024)
        gap = np.abs(packed.shadow_maps[number] - alone.shadow_maps[number])
        assert (gap > max(DEPTH_TEST, 4.0 * target.quantum)).sum() <= SNAPPED
        assert (packed.shadow_maps[number] < 1.0).mean() > 0.05
    gap = np.abs(packed.visibility - alone.visibility)
    assert (gap[~np.isnan(gap)] > 0.01).sum() <= SNAPPED
    sources = [renderer._cache.techniques[number, "Mapped"] for number in range(count)]
    atlases = {id(source.map.atlas) for source in sources if isinstance(source, Mapped) and source.map}
    assert len(atlases) == 1
    for number, used in enumerate(packed.used):
        assert used.views[0].tile == packed.used[0].views[0].tile
        assert used.draws > 0, number


@pytest.mark.parametrize("count", [1, 2, 3, 4])
def test_ranges_of_depth_are_exact(count: int) -> None:
    """Adjacent, the last light's range nearest, from 0 to 1 and no more; Riemer's 0.33 leaves a gap and an overlap."""
    ranges = [Channel(number, count, 1).depth_range for number in range(count)]
    assert ranges[-1][0] == 0.0
    assert sum(ranges[0]) == pytest.approx(1.0, abs=1e-15)
    for (first, size), (_, _) in zip(ranges[1:], ranges, strict=False):
        assert size == 1.0 / count
        assert any(first + size == pytest.approx(other, abs=1e-15) for other, _ in ranges)


def test_order_and_cache_change_nothing(renderer: gs.Renderer) -> None:
    pack = gs.PackedShadow(with_shadow(LIGHTS[:3]))
    first = renderer.render(SCENE, None, pack, SIZE, outputs=("visibility",), samples=1)
    backwards = renderer.render(SCENE, None, pack[::-1], SIZE, outputs=("visibility",), samples=1)
    np.testing.assert_array_equal(backwards.visibility[::-1], first.visibility)
    with gs.Renderer("egl") as fresh:  # here the nearest range is drawn first
        afresh = fresh.render(SCENE, None, pack[::-1], SIZE, outputs=("visibility",), samples=1)
        assert all(used.draws > 0 for used in afresh.used)
    np.testing.assert_array_equal(afresh.visibility[::-1], first.visibility)
    again = renderer.render(SCENE, None, pack, SIZE, outputs=("visibility",), samples=1)
    assert [used.draws for used in again.used] == [0, 0, 0]
    np.testing.assert_array_equal(again.visibility, first.visibility)
    assert isinstance(pack[0], gs.SpotLight)
    moved = replace(pack[0], position=(5.5, 7.0, 6.0))
    some = renderer.render(SCENE, None, (moved, pack[1], pack[2]), SIZE, outputs=("visibility",), samples=1)
    assert [used.draws > 0 for used in some.used] == [True, False, False]
    np.testing.assert_array_equal(some.visibility[1:], first.visibility[1:])
    alone = renderer.render(
        SCENE, None, [gs.PackedShadow(with_shadow((moved,)))[0]], SIZE, outputs=("visibility",), samples=1
    )
    gap = np.abs(some.visibility[0] - alone.visibility[0])
    assert (gap[~np.isnan(gap)] > 0.01).sum() <= SNAPPED


def test_two_packs_do_not_interfere(renderer: gs.Renderer) -> None:
    packs = gs.PackedShadow(with_shadow(LIGHTS[:2])), gs.PackedShadow(with_shadow(LIGHTS[2:]))
    both = renderer.render(SCENE, None, (*packs[0], *packs[1]), SIZE, outputs=("visibility",), samples=1)
    alone = renderer.render(
        SCENE, None, with_shadow(LIGHTS, target=gs.Target.R32F), SIZE, outputs=("visibility",), samples=1
    )
    gap = np.abs(both.visibility - alone.visibility)
    assert (gap[~np.isnan(gap)] > 0.01).sum() <= SNAPPED


def test_pack_is_a_sequence_of_lights() -> None:
    pack = gs.PackedShadow(with_shadow(LIGHTS[:3]))
    assert len(pack) == 3
    assert [type(each) for each in pack] == [type(each) for each in LIGHTS[:3]]
    assert pack[1:] == tuple(pack)[1:]
    assert "SpotLight" in repr(pack)


@pytest.mark.parametrize(
    ("lights", "said"),
    [
        ((), "1 to 4"),
        (5 * LIGHTS[:1], "1 to 4"),
        ((gs.PointLight(position=(0, 1, 0)),), "directional or spot lights"),
        ((gs.DirectionalLight(shadow=None),), "have a shadow"),
        (with_shadow(LIGHTS[:1], target=gs.Target.RGBA8), "one target of r32f, r16f, r8, got rgba8"),
        ((gs.DirectionalLight(shadow=gs.Shadow(filter=gs.Exact())),), "must have a filter that compares depths"),
        ((gs.DirectionalLight(shadow=gs.Shadow(filter=gs.Vsm())),), "must have a filter that compares depths"),
        (with_shadow(LIGHTS[2:3], fit=gs.Cascades()), "one view each"),
        ("lights", "PackedShadow|lights must be"),
    ],
)
def test_unsupported_lights_are_refused(lights: tuple[gs.Light, ...], said: str) -> None:
    with pytest.raises(gs.SettingsError, match=said):
        gs.PackedShadow(lights)
