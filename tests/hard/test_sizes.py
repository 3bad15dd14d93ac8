"""The quantities that the table predicts: required bias, lost gap, lit strip, widths, moire, ramps."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from glshadow.core.spaces import Array, ClipSpace
from glshadow.frame import Frame
from glshadow.lights import DirectionalLight, SpotLight
from glshadow.reference.trace import trace
from glshadow.renderer import Renderer
from glshadow.scenes import analytic
from glshadow.shadows.bias import ConstantBias, NormalOffsetBias
from glshadow.shadows.filters import Hard, Pcf
from glshadow.shadows.metric import Target
from glshadow.shadows.shadow import Shadow
from glshadow.shadows.view import ShadowView

from . import cases_contact, cases_fine
from .judge import SAME, default_allowance, judge, truth_of
from .registry import DEFAULT, HARD, Picture, Technique, overhead, picture_of
from .solids import level, scene_of


def draw(renderer: Renderer, picture: Picture, shadow: Shadow) -> Frame:
    return renderer.render(
        picture.scene,
        picture.camera,
        [replace(picture.light, shadow=shadow)],
        picture.size,
        outputs=("visibility",),
        samples=1,
    )


def visibility(renderer: Renderer, picture: Picture, shadow: Shadow) -> Array:
    values = draw(renderer, picture, shadow).visibility
    assert values is not None
    return values[0].astype(np.float64)


def rise_per_texel(view: ShadowView, normal: Array) -> float:
    """|d depth / du| + |d depth / dv| of a plane, world units."""
    n = view.view_from_world[:3, :3] @ normal
    return float(np.abs(n[:2] / n[2] * np.array(view.texel)).sum())


# -- N6


@pytest.mark.parametrize("number", range(5), ids=[f"{theta:g}" for theta in cases_contact.THETAS[:5]])
def test_n6_required_constant_bias(renderer: Renderer, number: int) -> None:
    picture = cases_contact.planes()[number]
    theta = cases_contact.THETAS[number]
    # A bias of half a texel's rise is required: no dark pixel just above it, some just below.
    view = draw(renderer, picture, Shadow(resolution=1024, filter=Hard())).used[0].views[0]
    needed = 0.5 * rise_per_texel(view, np.array([0.0, 1.0, 0.0]))
    enough = visibility(
        renderer, picture, Shadow(resolution=1024, filter=Hard(), bias=ConstantBias(1.05 * needed + 1e-5))
    )
    assert (enough == 1.0).all()
    if theta == 0.0:
        return
    assert needed == pytest.approx(0.5 * 0.01 * np.tan(np.radians(theta)) * np.cos(np.radians(theta)), rel=0.05)
    less = visibility(renderer, picture, Shadow(resolution=1024, filter=Hard(), bias=ConstantBias(0.7 * needed)))
    assert (less == 0.0).any()


@pytest.mark.parametrize("radius", [0, 1])
def test_n6_required_bias_of_a_filter_grows_with_its_reach(renderer: Renderer, radius: int) -> None:
    picture, flat = cases_contact.planes()[0], Pcf(radius)
    view = draw(renderer, picture, Shadow(resolution=1024, filter=flat)).used[0].views[0]
    needed = flat.reach_texels * rise_per_texel(view, np.array([0.0, 1.0, 0.0]))
    enough = visibility(renderer, picture, Shadow(resolution=1024, filter=flat, bias=ConstantBias(1.05 * needed)))
    less = visibility(renderer, picture, Shadow(resolution=1024, filter=flat, bias=ConstantBias(0.9 * needed)))
    assert (np.abs(enough - 1.0) <= SAME).all()
    assert (less < 1.0 - SAME).any()


def test_n6_required_normal_offset(renderer: Renderer) -> None:
    picture = cases_contact.planes()[0]
    view = draw(renderer, picture, Shadow(resolution=1024, filter=Hard())).used[0].views[0]
    # Along the light the offset n gains n / cos theta; NormalOffsetBias is in texels along which the normal leans.
    up = np.array([0.0, 1.0, 0.0])
    needed = 0.5 * rise_per_texel(view, up) * np.sqrt(0.5)
    texels = needed / np.linalg.norm(view.view_from_world[:2, :3] @ up * view.texel)
    for share, clean in ((1.05, True), (0.6, False)):
        bias = NormalOffsetBias(share * texels)
        lit = visibility(renderer, picture, Shadow(resolution=1024, filter=Hard(), bias=bias))
        assert (lit == 1.0).all() == clean


# -- N7


@pytest.mark.parametrize(
    "target", [Target.R8, Target.DEPTH16, Target.R16F, Target.DEPTH24, Target.DEPTH32F, Target.RGBA8]
)
@pytest.mark.parametrize("filter_", [Hard(), Pcf(1)], ids=["hard", "pcf 1"])
def test_n7_lost_gap(renderer: Renderer, target: Target, filter_: Hard | Pcf) -> None:
    """Lost below 0.45 of quantum x range + rounding + facet allowance, there above twice that.

    Half a step is the rounding of the stored value; 16-bit floats are rounded towards zero, a whole step.
    """
    technique = Technique("layers", filter=filter_, target=target)
    first = cases_fine.layer(0.1)
    used = judge(renderer, first, technique).frame.used[0]
    texel = max(used.texel or (0.0,))
    lost = target.quantum * cases_fine.RANGE + default_allowance(30.0, filter_, texel)
    seen = {}
    for gap in (0.45 * lost, 2.0 * lost):
        picture = cases_fine.layer(gap)
        under = truth_of(picture).visibility[0] == 0.0
        under &= truth_of(picture).cosine[0] > 0.0
        assert under.any()
        seen[gap] = visibility(renderer, picture, technique.shadow(picture))[under].mean()
    assert seen[0.45 * lost] > 0.5 or target is Target.R16F, (
        f"{target}: the shadow of a gap of {0.45 * lost:.2g} is still there"
    )
    assert seen[2.0 * lost] < 0.5, f"{target}: the shadow of a gap of {2.0 * lost:.2g} is lost"


def test_n7_lost_gap_of_a_constant_bias(renderer: Renderer) -> None:
    for gap, lit in ((0.045, True), (0.055, False)):
        picture = cases_fine.layer(gap)
        under = (truth_of(picture).visibility[0] == 0.0) & (truth_of(picture).cosine[0] > 0.0)
        values = visibility(renderer, picture, Shadow(resolution=1024, filter=Hard(), bias=ConstantBias(0.05)))
        assert (values[under].mean() > 0.9) == lit


# -- N8


@pytest.mark.parametrize("name", ["depth24", "depth16"])
def test_n8_a_projected_step_of_149_m_loses_the_shadow(renderer: Renderer, name: str) -> None:
    picture = cases_fine.far_spots()[0]
    step = 5000.0**2 * (1e4 - 0.01) / (1e4 * 0.01) * {"depth24": 2.0**-24, "depth16": 2.0**-16}[name]
    assert step == pytest.approx({"depth24": 149.0, "depth16": 38147.0}[name], rel=0.01)
    dark = (truth_of(picture).visibility[0] == 0.0) & (truth_of(picture).cosine[0] > 0.0)
    lit = visibility(renderer, picture, Technique(name, target=Target(name)).shadow(picture))
    assert lit[dark].mean() > 0.9


def far_plane(near: float | None) -> Picture:
    """An empty plane 45 away from a spot whose near plane is given."""
    spot = SpotLight(
        position=(20.0, 40.0, 0.0), direction=(-0.45, -1.0, 0.0), inner_angle=10.0, outer_angle=15.0, near=near
    )
    return picture_of("far plane", analytic.plane(60.0), spot, dark=False, size=(96, 96))


@pytest.mark.parametrize("clip", [ClipSpace(z, r) for z in (False, True) for r in (False, True)], ids=str)
def test_n8_no_acne_with_far_over_near_of_1e5(renderer: Renderer, clip: ClipSpace) -> None:
    outcome = judge(renderer, far_plane(5e-4), Technique("clip", clip=clip))
    assert outcome.mismatches == 0, str(outcome)


# -- N9


def test_n9_lit_strip_of_a_constant_bias(renderer: Renderer) -> None:
    """b cos e = 4.3 cm for b = 5 cm and e = 30 degrees."""
    picture = cases_contact.feet()[0]
    lit = visibility(renderer, picture, Shadow(resolution=1024, filter=Hard(), bias=ConstantBias(0.05)))
    left = truth_of(picture).position[..., 0] < 0.0
    width = (lit[left] == 1.0).mean() * 0.2
    assert width == pytest.approx(0.05 * np.cos(np.radians(30.0)), abs=2.0 * 0.4 / 192)
    assert width == pytest.approx(0.043, abs=0.005)


# -- N12 and N13


@pytest.mark.parametrize(("width", "angle"), [(2.0, 0.0), (1.0, 17.0), (0.5, 45.0), (0.1, 0.0)])
@pytest.mark.parametrize("technique", [HARD, DEFAULT], ids=["hard", "default"])
def test_n12_thin_wires_are_unbiased_over_phases(
    renderer: Renderer, width: float, angle: float, technique: Technique
) -> None:
    guard = int(np.ceil(technique.filter.reach_texels)) + 1
    picture = replace(cases_fine.wire(width, angle), resolution=1024 + 2 * guard)  # a pixel is a texel, 1 cm
    drawn = 1.0 - visibility(renderer, picture, technique.shadow(picture)).mean()
    true = 64.0 * width / 1024.0
    if angle != 0.0:
        traced = trace(picture.scene, picture.camera, [picture.light], picture.size, samples=16)
        true = 1.0 - float(traced.visibility[0].mean())
    # 64 phases of 1/64 texel: one hit more or less per row of texels.
    assert drawn == pytest.approx(true, abs=1.01 / 1024.0, rel=0.03)


def test_n13_lattice_below_two_texels_is_right_in_the_mean_only(renderer: Renderer) -> None:
    mean = 0.6**2
    errors = {}
    for ratio in (8.0, 2.0, 1.0, 0.5):
        picture = cases_fine.lattice(ratio)
        hard = visibility(renderer, picture, HARD.shadow(picture))
        errors[ratio] = np.abs(hard - truth_of(picture).visibility[0]).mean()
        assert hard.mean() == pytest.approx(mean, abs=0.08)  # texels and bars beat: few periods of it are seen
    # A texel that represents more than a period is right by chance: P(wrong) = 2 v (1 - v).
    chance = 2.0 * mean * (1.0 - mean)
    assert chance / 2.0 < errors[0.5] < chance * 2.0
    assert errors[8.0] < 0.5 * errors[0.5]


# -- N32


@pytest.mark.parametrize("radius", [0, 1, 2, 4])
def test_n32_ramp_of_a_straight_edge(renderer: Renderer, radius: int) -> None:
    """A linear ramp 2 r + 1 texels wide between exact plateaus, its middle within half a texel of the edge."""
    sun = DirectionalLight(direction=(0.0, -1.0, 0.0))
    parts = {"ground": level((-1.0, 1.0), (-1.0, 1.0)), "roof": level((0.123, 3.0), (-2.0, 2.0), cases_fine.HIGH)}
    camera = overhead((-1.0, 1.0), (-1.0, 1.0), 400.0, (1024, 8))
    picture = Picture("ramp", scene_of(parts, camera, sun, "ramp"), sun, camera, size=(1024, 8), resolution=64)
    frame = draw(renderer, picture, Shadow(resolution=64, filter=Pcf(radius)))
    row = frame.visibility[0, 4].astype(np.float64)
    x = -1.0 + (np.arange(1024) + 0.5) * 2.0 / 1024
    texel = frame.used[0].views[0].texel[0]
    inside = (row > SAME) & (row < 1.0 - SAME)
    assert row[0] == pytest.approx(1.0, abs=SAME)
    assert row[-1] == 0.0
    slope, offset = np.polyfit(x[inside], row[inside], 1)
    assert slope == pytest.approx(-1.0 / ((2 * radius + 1) * texel), rel=1e-3)
    assert np.abs(row[inside] - (slope * x[inside] + offset)).max() < 1e-3
    assert (0.5 - offset) / slope == pytest.approx(0.123, abs=0.5 * texel + 1e-6)


# -- N31: the reference of an area light


def test_n31_penumbra_of_a_disc_light() -> None:
    """V(u) = 1/2 + (u sqrt(1 - u^2) + asin u) / pi over a penumbra of w_l d_r / d_b, traced."""
    width, to_blocker, to_receiver = 0.5, 5.0, 5.0
    disc_light = SpotLight(position=(0.0, to_blocker + to_receiver, 0.0), radius=0.5 * width, outer_angle=40.0)
    parts = {"ground": level((-1.0, 1.0), (-1.0, 1.0)), "roof": level((-9.0, 0.0), (-9.0, 9.0), to_receiver)}
    camera = overhead((-0.5, 0.5), (-0.02, 0.02), 2.0, (64, 8))
    truth = trace(
        scene_of(parts, camera, disc_light, "disc"), camera, [disc_light], (64, 8), light_samples=256, samples=1
    )
    u = 2.0 * truth.position[..., 0] / (width * to_receiver / to_blocker)
    inside = np.clip(u, -1.0, 1.0)
    exact = 0.5 + (inside * np.sqrt(1.0 - inside**2) + np.arcsin(inside)) / np.pi
    # 256 stratified samples: an error of about 256^-3/4 = 0.016 where the edge cuts the disc.
    assert np.abs(truth.visibility[0] - exact).max() < 0.05
    assert np.abs(truth.visibility[0] - exact).mean() < 0.01
    assert (truth.visibility[0][u < -1.05] == 0.0).all()
    assert (truth.visibility[0][u > 1.05] == 1.0).all()
