"""Parsing of option values: the settings they give, and the messages of those that are refused."""

import pytest

import glshadow as gs
from glshadow import overlay
from glshadow.cli import main, values
from glshadow.core.spaces import CLIP_SPACES
from glshadow.errors import SettingsError
from glshadow.shadows.filters import FILTERS


def test_help_lists_match_the_settings():
    assert values.OVERLAYS == overlay.OVERLAYS


@pytest.mark.parametrize(
    ("text", "light"),
    [
        ("sun:-1,-2,3", gs.DirectionalLight(direction=(-1, -2, 3))),
        ("sun:0,-1,0:angle=0.5:near=-3:far=40", gs.DirectionalLight(direction=(0, -1, 0), angle=0.5, near=-3, far=40)),
        ("point:1,2,-3", gs.PointLight(position=(1, 2, -3))),
        (
            "point:0,2,0:intensity=2:color=1,0.9,0.8:range=10:falloff=2:radius=0.1",
            gs.PointLight(position=(0, 2, 0), intensity=2, color=(1, 0.9, 0.8), range=10, falloff=2, radius=0.1),
        ),
        ("point:0,2,0:shadow=off", gs.PointLight(position=(0, 2, 0), shadow=None)),
        ("point:0,2,0:photometric=on", gs.PointLight(position=(0, 2, 0), photometric=True)),
        ("spot:0,9,0:0,-1,0.5", gs.SpotLight(position=(0, 9, 0), direction=(0, -1, 0.5))),
        (
            "spot:0,9,0:0,-1,0:45:10",
            gs.SpotLight(position=(0, 9, 0), direction=(0, -1, 0), outer_angle=45, inner_angle=10),
        ),
        (
            "spot:0,9,0:0,-1,0:15:shadow=on",
            gs.SpotLight(position=(0, 9, 0), direction=(0, -1, 0), outer_angle=15, inner_angle=10),
        ),
        (
            "rect:0,3,0:0,-1,0:2,1:intensity=3",
            gs.RectLight(position=(0, 3, 0), direction=(0, -1, 0), width=2, height=1, intensity=3),
        ),
        (
            "rect:0,3,0:1,0,0:2,1",
            gs.RectLight(position=(0, 3, 0), direction=(1, 0, 0), up=(0, 1, 0), width=2, height=1),
        ),
        ("sky", gs.SkyLight()),
        ("sky:intensity=0.4:color=0.8,0.9,1", gs.SkyLight(intensity=0.4, color=(0.8, 0.9, 1))),
    ],
)
def test_light(text, light):
    assert values.light(text) == light


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("moon:1,2,3", r"sun:dx,dy,dz.*spot:.*point:"),
        ("sun", "sun:dx,dy,dz"),
        ("sun:1,2", "3 finite numbers"),
        ("sun:1,2,x", "3 finite numbers"),
        ("sun:1,2,nan", "3 finite numbers"),
        ("sun:0,0,0", "zero vector"),
        ("sun:1,2,3:4", "sun:dx,dy,dz"),
        ("sun:1,2,3:range=4", "a sun has no setting 'range'.*angle"),
        ("point:1,2,3:range=-4", "range must be a finite number in"),
        ("point:1,2,3:range=", "'' is not a finite number"),
        ("point:1,2,3:shadow=maybe", "on or off"),
        ("point:intensity=2:1,2,3", "point:x,y,z"),
        ("rect:0,3,0:0,-1,0", "rect:px,py,pz:dx,dy,dz:width,height"),
        ("rect:0,3,0:0,-1,0:2", "2 finite numbers"),
        ("rect:0,3,0:0,-1,0:2,0", "height must be"),
        ("rect:0,3,0:0,-1,0:2,1:up=0,1,0", "up must not be parallel to direction"),
        ("rect:0,3,0:0,-1,0:2,1:radius=1", "a rect has no setting 'radius'"),
        ("sky:1,2,3", "sky"),
        ("environment", "environment:FILE"),
        ("sky:angle=3", "a sky has no setting 'angle'"),
        ("spot:1,2,3", "spot:px,py,pz:dx,dy,dz"),
        ("spot:1,2,3:0,-1,0:95", "outer_angle"),
        ("spot:1,2,3:0,-1,0:20:30", "inner_angle must not be greater than outer_angle"),
        ("spot:1,2,3:0,-1,0:20:10:5", "spot:px,py,pz"),
    ],
)
def test_light_refused(text, words):
    with pytest.raises(SettingsError, match=words):
        values.light(text)


@pytest.mark.parametrize(
    ("text", "bias"),
    [
        ("receiver-plane", gs.ReceiverPlaneBias()),
        ("constant:0.01", gs.ConstantBias(0.01)),
        ("slope", gs.SlopeScaledBias()),
        ("slope:2,3", gs.SlopeScaledBias(2, 3)),
        ("normal-offset", gs.NormalOffsetBias()),
        ("normal-offset:3", gs.NormalOffsetBias(3)),
        ("clip:-0.001", gs.ClipBias(-0.001)),
        ("none", gs.NoBias()),
    ],
)
def test_bias(text, bias):
    assert values.bias(text) == bias


@pytest.mark.parametrize(
    "text", ["constant", "constant:", "constant:x", "constant:-1", "slope:x", "none:1", "", "magic"]
)
def test_bias_refused(text):
    with pytest.raises(SettingsError):
        values.bias(text)


@pytest.mark.parametrize(
    ("text", "filter_"), [("hard", gs.Hard()), ("pcf", gs.Pcf()), ("pcf:0", gs.Pcf(0)), ("pcf:4", gs.Pcf(4))]
)
def test_filter(text, filter_):
    assert values.shadow_filter(text) == filter_


@pytest.mark.parametrize("text", ["hard:1", "pcf:5", "pcf:", "pcf:-1", "pcf:1.5", "PCSS", ""])
def test_filter_refused(text):
    with pytest.raises(SettingsError, match=".*".join(kind.spelling for kind in FILTERS) + r"|\[0, 4\]|it is written"):
        values.shadow_filter(text)


@pytest.mark.parametrize("space", CLIP_SPACES)
def test_clip(space):
    assert values.clip(str(space)) == space


@pytest.mark.parametrize("text", ["12", "0x5", "5x0", "-3x4", "3x4x5", "1.5x2", "99999x2", "x", ""])
def test_size_refused(text):
    with pytest.raises(SettingsError, match=r"WIDTHxHEIGHT.*1 to 16384"):
        values.size(text)


def test_view_counts():
    assert values.size("640X480") == (640, 480)
    assert values.ambient("0.25") == (0.25, 0.25)
    assert values.ambient("0,0.5,1") == ((0.0, 0.5, 1.0), (0.0, 0.5, 1.0))
    assert values.ambient("0,0.5,1/0.1") == ((0.0, 0.5, 1.0), 0.1)
    assert (values.background("none"), values.background("0,0.5,1")) == (None, (0.0, 0.5, 1.0))
    assert [values.exposure(text) for text in ("none", "auto", "scene", "-2.5")] == [None, "auto", "scene", -2.5]
    assert values.samples("16") == 16
    assert values.overlays("grid, map") == ("grid", "map")
    refused = {
        values.ambient: ("-1", "1/2/3", "1/-1"), values.samples: ("2", "x"), values.background: ("clear",),
        values.exposure: ("65", "bright", "1_0"), values.color: ("0,0,2",),
        values.plane: ("0",), values.resolution: ("0", "2.5", "20000"), values.strength: ("1.1",), values.fov: ("180",),
        values.overlays: ("map,,grid",),
    }  # fmt: skip
    for read, text in ((read, text) for read, texts in refused.items() for text in texts):
        with pytest.raises(SettingsError):
            read(text)


@pytest.mark.parametrize(
    ("name", "has"), [("view", {"--size"}), ("export", set()), ("study", {"--size", "--backend", "--device"})]
)
def test_commands_offer_only_options_that_apply(name: str, has: set[str]) -> None:
    options = {each for param in main.commands[name].params for each in param.opts}
    assert options & {"--size", "--backend", "--device"} == has
