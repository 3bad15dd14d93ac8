"""Shadow: defaults, and messages that name the setting, the value and the allowed values."""

from __future__ import annotations

from dataclasses import fields
from typing import Any

import numpy as np
import pytest

from glshadow.core.spaces import ClipSpace
from glshadow.derive.resolved import resolve_shadow
from glshadow.errors import SettingsError
from glshadow.lights import DirectionalLight
from glshadow.shadows.bias import ClipBias, ConstantBias, NoBias, NormalOffsetBias, ReceiverPlaneBias, SlopeScaledBias
from glshadow.shadows.filters import Exact, Hard, Pcf
from glshadow.shadows.fits import SceneFit, ViewFit
from glshadow.shadows.metric import Target
from glshadow.shadows.shadow import Faces, Shadow


def test_default_settings_are_derived() -> None:
    shadow = Shadow()
    values = (getattr(shadow, item.name) for item in fields(shadow) if item.name not in ("strength", "edge_falloff"))
    assert set(values) == {None}
    resolved = shadow.resolved()
    assert (resolved.resolution, resolved.filter, resolved.fit, shadow.strength) == (2048, Exact(), ViewFit(), 1.0)
    assert hash(shadow) == hash(Shadow())


@pytest.mark.parametrize(
    "given",
    [
        {"resolution": 2048},
        {"bias": ReceiverPlaneBias()},
        {"target": Target.DEPTH32F},
        {"clip": ClipSpace(True, False)},
        {"fit": ViewFit()},
    ],
    ids=lambda given: next(iter(given)),
)
def test_map_setting_selects_a_map(given: dict[str, Any]) -> None:
    resolved = Shadow(**given).resolved()
    assert resolved.filter == Pcf(1)
    assert resolved.why == f"only a shadow map has {next(iter(given))}"
    assert Shadow(**given, faces=Faces.BACK, strength=0.5).resolved().filter == Pcf(1)


def test_other_reasons_for_the_filter() -> None:
    assert Shadow(faces=Faces.BACK, strength=0.5).resolved().filter == Exact()
    assert Shadow().resolved(without_map="OpenGL 3.3").why == "OpenGL 3.3"
    assert Shadow().resolved(without_map="OpenGL 3.3").filter == Pcf(1)
    assert Shadow(filter=Exact()).resolved(without_map="OpenGL 3.3").filter == Exact()
    assert resolve_shadow(DirectionalLight(near=1.0)).why == "only a shadow map has the light's near and far"
    assert resolve_shadow(DirectionalLight(shadow=None)) is None


def test_spelled_out_shadow_is_equivalent() -> None:
    for shadow in (Shadow(), Shadow(bias=NoBias()), Shadow(filter=Hard(), strength=0.5)):
        written = shadow.spelled_out()
        assert written.resolved().filter == shadow.resolved().filter
        assert written == written.spelled_out()
        assert (written.bias, written.strength) == (shadow.bias, shadow.strength)


@pytest.mark.parametrize(
    "bias",
    [None, ReceiverPlaneBias(), ConstantBias(0.1), SlopeScaledBias(), NormalOffsetBias(), ClipBias(1e-3), NoBias()],
)
@pytest.mark.parametrize("filter_", [Hard(), Pcf(0), Pcf(2)])
def test_every_pair_of_bias_and_filter_is_accepted(bias: object, filter_: object) -> None:
    shadow = Shadow(
        filter=filter_,
        bias=bias,
        fit=SceneFit(),
        faces=Faces.BOTH,
        clip=ClipSpace(False, True),
        strength=0.0,
        resolution=1,
    )  # type: ignore[arg-type]
    assert shadow.bias is bias
    assert shadow.filter is filter_


@pytest.mark.parametrize("resolution", [0, -5, 16385, 1024.0, "2048", True, np.nan])
def test_resolution(resolution: object) -> None:
    with pytest.raises(
        SettingsError, match=r"resolution must be an integer in \[1, 16384\] texels or None \(derived\), got"
    ) as caught:
        Shadow(resolution=resolution)  # type: ignore[arg-type]
    assert repr(resolution) in str(caught.value)


@pytest.mark.parametrize("strength", [-0.01, 1.01, np.nan, np.inf])
def test_strength(strength: float) -> None:
    with pytest.raises(SettingsError, match=rf"strength must be a finite number in \[0, 1\], got {strength!r}"):
        Shadow(strength=strength)


@pytest.mark.parametrize(
    ("name", "value", "allowed"),
    [
        ("filter", "pcf", ("Hard", "Pcf")),
        ("filter", Pcf, ("Hard", "Pcf")),
        (
            "bias",
            0.005,
            ("ReceiverPlaneBias", "ConstantBias", "SlopeScaledBias", "NormalOffsetBias", "ClipBias", "NoBias"),
        ),
        ("target", "depth32f", ("Target",)),
        ("clip", "0..1", ("ClipSpace",)),
        ("fit", "view", ("ViewFit", "SceneFit")),
        ("faces", "front", ("Faces",)),
    ],
)
def test_kinds(name: str, value: object, allowed: tuple[str, ...]) -> None:
    with pytest.raises(SettingsError, match=f"{name} must be ") as caught:
        Shadow(**{name: value})  # type: ignore[arg-type]
    for word in (*allowed, repr(value)):
        assert word in str(caught.value)


@pytest.mark.parametrize("target", list(Target))
def test_slope_scaled_bias_needs_a_depth_texture(target: Target) -> None:
    if target.is_depth:
        assert Shadow(bias=SlopeScaledBias(), target=target).target is target
    else:
        with pytest.raises(SettingsError, match=rf"SlopeScaledBias.*target {target.value}.*Use ReceiverPlaneBias"):
            Shadow(bias=SlopeScaledBias(), target=target)
