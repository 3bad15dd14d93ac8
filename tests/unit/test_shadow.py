"""Shadow: defaults, and messages that name the setting, the value and what is allowed."""

from __future__ import annotations

import numpy as np
import pytest

from glshadow.core.bias import ClipBias, ConstantBias, NoBias, NormalOffsetBias, ReceiverPlaneBias, SlopeScaledBias
from glshadow.core.filters import Hard, Pcf
from glshadow.core.fit import SceneFit, ViewFit
from glshadow.core.metric import Target
from glshadow.core.shadow import Faces, Shadow
from glshadow.core.spaces import ClipSpace
from glshadow.errors import SettingsError


def test_defaults_derive_what_they_can() -> None:
    shadow = Shadow()
    assert (shadow.resolution, shadow.filter, shadow.fit, shadow.strength) == (2048, Pcf(1), ViewFit(), 1.0)
    assert (shadow.bias, shadow.target, shadow.clip, shadow.faces) == (None, None, None, None)
    assert hash(shadow) == hash(Shadow())


@pytest.mark.parametrize(
    "bias",
    [None, ReceiverPlaneBias(), ConstantBias(0.1), SlopeScaledBias(), NormalOffsetBias(), ClipBias(1e-3), NoBias()],
)
@pytest.mark.parametrize("filter_", [Hard(), Pcf(0), Pcf(2)])
def test_every_pair_of_bias_and_filter_is_a_setting(bias: object, filter_: object) -> None:
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


@pytest.mark.parametrize("resolution", [0, -5, 16385, 1024.0, "2048", None, True, np.nan])
def test_resolution(resolution: object) -> None:
    with pytest.raises(SettingsError, match=r"resolution must be an integer in \[1, 16384\] texels, got") as caught:
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
        ("filter", None, ("Hard", "Pcf")),
        ("filter", Pcf, ("Hard", "Pcf")),
        (
            "bias",
            0.005,
            ("ReceiverPlaneBias", "ConstantBias", "SlopeScaledBias", "NormalOffsetBias", "ClipBias", "NoBias"),
        ),
        ("target", "depth32f", ("Target",)),
        ("clip", "0..1", ("ClipSpace",)),
        ("fit", None, ("ViewFit", "SceneFit")),
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
