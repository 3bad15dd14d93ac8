"""Gradients of visibility and images by a light's settings: a straight penumbra in closed form, exact linearity, other steps."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import glshadow as gs
from glshadow.core.spaces import Array
from glshadow.inverse.gradients import LightFunction
from glshadow.inverse.unknowns import STEP_SIZE, STEP_TURN

from ..outlines.solids import box, sheet

# A plate over x < 0 at this height; the sun comes from there, TILT from the zenith.
HEIGHT, TILT, ANGLE = 2.0, np.radians(30.0), 10.0
SIZE = (64, 8)
PLATE = gs.Scene(
    [
        gs.Node(sheet([(-20, 0, 20), (20, 0, 20), (20, 0, -20), (-20, 0, -20)]), name="floor"),
        gs.Node(sheet([(-20, HEIGHT, 20), (0, HEIGHT, 20), (0, HEIGHT, -20), (-20, HEIGHT, -20)]), name="plate"),
    ],
    camera=gs.OrthographicCamera((1.15, 5.0, 0.0), (1.15, 0.0, 0.0), up=(0.0, 0.0, -1.0), height=0.1),
)
AWAY = np.array([np.sin(TILT), -np.cos(TILT), 0.0])
TURN = np.array([np.cos(TILT), np.sin(TILT), 0.0])  # derivative of AWAY by the tilt
SUN = gs.DirectionalLight(direction=AWAY, angle=ANGLE, shadow=gs.Shadow(filter=gs.Exact(light_samples=1024)))
POST = gs.Scene(
    [
        gs.Node(box((-0.5, 0.0, -0.5), (0.5, 1.5, 0.5)), name="post"),
        gs.Node(sheet([(-6, 0, 6), (6, 0, 6), (6, 0, -6), (-6, 0, -6)]), name="floor"),
    ],
    camera=gs.PerspectiveCamera((4.0, 7.0, 8.0), (0.0, 0.0, 0.0), fov_y=50.0),
)


def function(renderer: gs.Renderer | None, light: gs.Light, output: Any = "visibility", **given: Any) -> LightFunction:
    return LightFunction(renderer, given.pop("scene", POST), None, light, output, given.pop("size", (64, 36)), **given)


def penumbra(tilt: float = TILT, angle: float = ANGLE) -> Array:
    """(W,) closed form: the share of a disc on this side of a chord, which the plate's edge is."""
    x = 1.15 + 0.1 * SIZE[0] / SIZE[1] * ((np.arange(SIZE[0]) + 0.5) / SIZE[0] - 0.5)
    t = np.clip((np.arctan2(x, HEIGHT) - tilt) / np.radians(0.5 * angle), -1.0, 1.0)
    return 0.5 + (t * np.sqrt(1.0 - t * t) + np.arcsin(t)) / np.pi


def weights(count: int) -> Array:
    """(K, H, W) smooth bumps over the penumbra: a single pixel of 1,024 samples has steps of 0.001."""
    x = np.arange(SIZE[0])
    bumps = [np.exp(-(((x - centre) / 6.0) ** 2)) for centre in np.linspace(16, 48, count)]
    return np.stack([np.broadcast_to(bump, SIZE[::-1]) for bump in bumps])


def test_penumbra_is_the_closed_form(renderer: gs.Renderer) -> None:
    seen = function(renderer, SUN, scene=PLATE, size=SIZE).at({"angle": np.array(ANGLE)})
    np.testing.assert_allclose(seen, np.broadcast_to(penumbra(), seen.shape), atol=0.01)
    assert np.ptp(penumbra()) > 0.9


@pytest.mark.parametrize("length", [1.0, 250.0])
def test_derivatives_of_a_penumbra_are_the_closed_forms(renderer: gs.Renderer, length: float) -> None:
    """To 6 % of the sum of the pixels' absolute derivatives.

    The step is a tenth of the sun's radius, and a difference is of some 130 of the 1,024 points, whose mean is 0.004 radii off the centre.
    """
    values = {"direction": length * AWAY, "angle": np.array(ANGLE)}
    here = function(renderer, SUN, scene=PLATE, size=SIZE)
    turn, grown = STEP_TURN, np.exp(STEP_SIZE)
    by_step = {
        "tilt": (penumbra(TILT + turn) - penumbra(TILT - turn)) / (2.0 * turn),
        "angle": (penumbra(angle=ANGLE * grown) - penumbra(angle=ANGLE / grown)) / (2.0 * STEP_SIZE * ANGLE),
    }
    by_limit = {
        "tilt": (penumbra(TILT + 1e-6) - penumbra(TILT - 1e-6)) / 2e-6,
        "angle": (penumbra(angle=ANGLE + 1e-5) - penumbra(angle=ANGLE - 1e-5)) / 2e-5,
    }
    for weight in weights(5):
        found = here.pulled_back(values, weight)
        got = {"tilt": length * float(found["direction"] @ TURN), "angle": float(found["angle"])}
        assert abs(found["direction"] @ AWAY) < 1e-9 * np.abs(found["direction"]).max()
        for name, value in got.items():
            largest = np.abs(weight @ np.abs(by_limit[name])).sum()
            assert value == pytest.approx((weight @ by_step[name]).sum(), abs=0.06 * largest), name
            assert value == pytest.approx((weight @ by_limit[name]).sum(), abs=0.06 * largest), name
        # along the edge nothing changes
        assert abs(found["direction"][2]) < 0.02 * np.abs(found["direction"]).max()


@pytest.mark.parametrize("intensity", [0.0, 0.7, 3.0])
def test_images_are_linear_in_strength_and_colour(renderer: gs.Renderer, intensity: float) -> None:
    """To float32: the derivatives are the images of unit strength and of unit channels, without the ambient light."""
    light = gs.DirectionalLight(direction=(-1.0, -1.5, 0.4), angle=3.0)
    color = np.array([1.0, 0.0, 0.25])
    here = function(renderer, light, "linear", options={"ambient": 0.1, "background": (0, 0, 0)})
    values = {"intensity": np.array(intensity), "color": color}
    weight = np.random.default_rng(1).normal(size=(36, 64, 3))
    found = here.pulled_back(values, weight)
    dark = here.at({"intensity": np.array(0.0)}).astype(np.float64)
    unit = here.at({"intensity": np.array(1.0)}).astype(np.float64) - dark
    assert found["intensity"].shape == ()
    assert found["intensity"] == pytest.approx((weight * unit * color).sum(), rel=1e-5)
    np.testing.assert_allclose(found["color"], intensity * (weight * unit).sum(axis=(0, 1)), rtol=1e-5, atol=1e-9)
    np.testing.assert_allclose(here.at(values), dark + intensity * color * unit, atol=1e-5)


def test_visibility_does_not_depend_on_strength(renderer: gs.Renderer) -> None:
    values = {"intensity": np.array([2.0]), "color": np.ones(3), "angle": np.array([3.0])}
    found = function(renderer, SUN).pulled_back(values, np.ones((36, 64)), ["color", "intensity"])
    assert list(found) == ["color", "intensity"]
    assert (found["color"] == 0.0).all()
    assert found["intensity"].shape == (1,)
    assert found["intensity"][0] == 0.0


LIGHTS = [
    (gs.PointLight(position=(2.0, 5.0, 1.0), radius=1.5), ("position", "radius")),
    (gs.SpotLight(position=(2.0, 5.0, 1.0), direction=(-0.3, -1, 0), outer_angle=80, radius=1.5), ("position", "direction", "radius")),
    (gs.RectLight(position=(2, 5, 1), direction=(-0.3, -1, 0), width=3.0, height=2.4), ("position", "width", "height")),
]  # fmt: skip


@pytest.mark.parametrize(("light", "names"), LIGHTS, ids=["point", "spot", "rect"])
@pytest.mark.parametrize("output", ["visibility", "linear"])
def test_gradients_agree_with_differences_of_another_step(
    renderer: gs.Renderer, light: gs.Light, names: tuple[str, ...], output: str
) -> None:
    """To a fifth of the sum of the pixels' absolute derivatives: a penumbra is few pixels wide, the steps differ by a factor of two.

    Visibility has the hard rim of a spot light's cone, so that there it is tested by position alone.
    """
    light = replace(light, shadow=gs.Shadow(filter=gs.Exact(light_samples=256)))
    here = function(renderer, light, output)
    names = names if output == "linear" else ("position",)
    values = {name: np.array(getattr(light, name), dtype=np.float64) for name in names}
    x, y = np.meshgrid(np.linspace(-1, 1, 64), np.linspace(-1, 1, 36))
    weight = 1.0 + x + 0.5 * y
    weight = weight if output == "visibility" else np.stack([weight] * 3, axis=-1)
    found = here.pulled_back(values, weight)
    for name, value in values.items():
        step = {"position": 0.1, "direction": 0.02}.get(name, 0.05 * float(value.max()))
        differences, sizes = [], []
        for index in np.ndindex(value.shape):
            images = []
            for sign in (1.0, -1.0):
                moved = value.copy()
                moved[index] += sign * step
                images.append(here.at({**values, name: moved}).astype(np.float64))
            slope = weight * (images[0] - images[1]) / (2.0 * step)
            differences.append(np.nansum(slope))
            sizes.append(np.nansum(np.abs(slope)))
        wanted = np.array(differences).reshape(value.shape)
        np.testing.assert_allclose(found[name], wanted, rtol=0.0, atol=0.2 * max(sizes), err_msg=name)


def test_pixels_without_a_surface_do_not_count(renderer: gs.Renderer) -> None:
    far = gs.PerspectiveCamera((4.0, 3.0, 8.0), (0.0, 0.0, 0.0), fov_y=50.0)
    here = LightFunction(renderer, POST, far, SUN, "visibility", (32, 18))
    values = {"direction": np.array((-1.0, -1.5, 0.4))}
    empty = np.isnan(here.at(values))
    assert empty.any()
    found = [here.pulled_back(values, np.where(empty, beside, 1.0))["direction"] for beside in (0.0, 7.0, np.nan)]
    np.testing.assert_array_equal(found[1], found[0])
    np.testing.assert_array_equal(found[2], found[0])
    assert np.abs(found[0]).max() > 0.0


def test_shifted_lights_share_one_frame(renderer: gs.Renderer, monkeypatch: pytest.MonkeyPatch) -> None:
    counts = []
    render = gs.Renderer.render

    def counted(self: gs.Renderer, scene: Any, camera: Any, lights: Any, *rest: Any, **options: Any) -> gs.Frame:
        counts.append(len(lights))
        return render(self, scene, camera, lights, *rest, **options)

    monkeypatch.setattr(gs.Renderer, "render", counted)
    values = {"direction": AWAY, "angle": np.array(ANGLE)}
    function(renderer, SUN).pulled_back(values, np.ones((36, 64)))
    assert counts == [6]


def test_a_temporary_renderer_gives_the_same(renderer: gs.Renderer) -> None:
    values = {"angle": np.array(3.0)}
    own, kept = (function(each, SUN, size=(16, 9)) for each in (None, renderer))
    np.testing.assert_array_equal(own.at(values), kept.at(values))
    weight = np.ones((9, 16))
    assert own.pulled_back(values, weight) == kept.pulled_back(values, weight)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"light": gs.SkyLight()}, "light from all around cannot be differentiated, got SkyLight"),
        ({"light": gs.DirectionalLight(shadow=None)}, r"without a shadow \(shadow=None\)"),
        ({"options": {"tone": "none"}}, "a gradient takes no tone"),
        ({"step": 0.0}, "step must be"),
        ({"renderer": 1}, "renderer must be"),
        ({"size": (0, 1)}, "size must be"),
        ({"values": {}}, "parameters must be by name, settings of DirectionalLight: direction, angle, intensity, color"),
        ({"values": 3}, "parameters must be by name"),
        ({"values": {"position": np.zeros(3)}}, r"parameters must be .*got \['position'\]"),
        ({"values": {"direction": np.zeros(3)}}, "direction must not be the zero vector"),
        ({"values": {"angle": np.zeros(2)}}, "angle must be"),
        ({"values": {"angle": np.array(0.0)}}, "angle must be above 0 for its derivative"),
        ({"values": {"angle": np.array(0.01)}}, r"angle must be in \[0.055, 81\] degrees for its derivative"),
        ({"cotangent": np.ones((3, 3))}, r"cotangent must be an array \(36, 64\)"),
    ],
    ids=["sky", "bare", "tone", "step", "renderer", "size", "none", "number", "name", "zero", "two", "hard", "small", "shape"],
)  # fmt: skip
def test_what_is_wrong_is_named(renderer: gs.Renderer, given: dict[str, Any], message: str) -> None:
    values = given.pop("values", {"angle": np.array(3.0)})
    cotangent = given.pop("cotangent", np.ones((36, 64)))
    light = given.pop("light", SUN)
    with pytest.raises(gs.SettingsError, match=message):
        function(given.pop("renderer", renderer), light, **given).pulled_back(values, cotangent)
