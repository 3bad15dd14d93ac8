"""Every filter, bias and fit is parsed from its spelling; input that cannot be parsed is named."""

from __future__ import annotations

import pytest

import glshadow as gs
from glshadow.core.spelling import Spelled, parse
from glshadow.errors import SettingsError
from glshadow.shadows.bias import BIASES
from glshadow.shadows.filters import FILTERS
from glshadow.shadows.fits import FITS

SPELLED: dict[str, Spelled] = {
    "hard": gs.Hard(), "pcf:1": gs.Pcf(), "disc:2,16": gs.Disc(), "disc:0.5,64,rotate": gs.Disc(0.5, 64, True),
    "exact": gs.Exact(), "exact:light_samples=256": gs.Exact(light_samples=256),
    "exact:dither": gs.Exact(dither=True), "pcss:16,64": gs.Pcss(16, 64),
    "lightsamples:16": gs.LightSamples(16), "lightsamples:64,of=hard": gs.LightSamples(of=gs.Hard()),
    "none": gs.NoBias(), "constant:0.25": gs.ConstantBias(0.25),
    "slope": gs.SlopeScaledBias(), "slope:derived,2": gs.SlopeScaledBias(units=2.0), "slope:1.1,4": gs.SlopeScaledBias(1.1),
    "normal-offset": gs.NormalOffsetBias(), "normal-offset:1.5": gs.NormalOffsetBias(1.5), "clip:-0.1,0": gs.ClipBias(-0.1),
    "clip:0.1,0,no-caster": gs.ClipBias(0.1, caster=False), "scene": gs.SceneFit(),
}  # fmt: skip
FAMILIES: tuple[tuple[type[Spelled], ...], ...] = (FILTERS, BIASES, FITS)


def family_of(member: Spelled) -> tuple[type[Spelled], ...]:
    return next(kinds for kinds in FAMILIES if type(member) in kinds)


@pytest.mark.parametrize("text", SPELLED)
def test_spelling_round_trips(text: str) -> None:
    member = SPELLED[text]
    assert str(member) == text
    assert parse(text, family_of(member)) == member


@pytest.mark.parametrize("kind", FILTERS, ids=lambda kind: kind.spelling)
def test_every_setting_of_a_filter_round_trips(kind: type[gs.Filter]) -> None:
    for member in (*kind.variants(), *kind.rungs(), *kind.studied(), *kind.extremes()):
        assert parse(str(member), FILTERS) == member


def test_omitted_values_have_their_defaults() -> None:
    assert parse("disc:3", FILTERS) == gs.Disc(3.0)
    assert parse("disc:rotate", FILTERS) == gs.Disc(rotate=True)
    assert parse("slope", BIASES) == gs.SlopeScaledBias()


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (
            "magic",
            "'magic' is not a filter; expected one of: " + ".*".join(kind.spelling for kind in FILTERS),
        ),
        ("disc:1,2,3,4", r"'3' is not understood; it is written disc\["),
        ("disc:spin", "'spin' is not understood"),
        ("pcf:", "'pcf:' is not a filter"),
        ("exact:light_samples=3", r"light_samples must be an integer in \[16, 1024\]"),
        ("exact:lamps=64", "'lamps=64' is not understood"),
        ("exact:light_samples=64,light_samples=65", "is not understood"),
        ("pcf:nan", "'nan' is not understood"),
        ("hard:1", "it is written hard$"),
    ],
)
def test_input_that_cannot_be_parsed_is_named(text: str, said: str) -> None:
    with pytest.raises(SettingsError, match=said):
        parse(text, FILTERS, "filter")


def test_missing_value_is_named() -> None:
    with pytest.raises(SettingsError, match=r"'constant' is incomplete; it is written constant:WORLD"):
        parse("constant", BIASES, "bias")
