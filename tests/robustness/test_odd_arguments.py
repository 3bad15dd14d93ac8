"""Every public callable with every odd value in place of each argument: it works, or it names the fault; no foreign error, no foreign
warning, and nothing in a picture that is negative or no number."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import glshadow as gs
from glshadow import image, overlay, study

from .odd_values import ODD

SIZE = (8, 6)

Call = tuple[Callable[..., Any], dict[str, Callable[[], Any]]]


def given(value: Any) -> Callable[[], Any]:
    return lambda: value


MESH = gs.Mesh(np.eye(3), np.array([[0, 1, 2]]))
NODE = gs.Node("a", MESH, np.eye(4))
SCENE = gs.Scene((NODE,))
SUN, LAMP, CAMERA = gs.DirectionalLight(), {"position": given((0.0, 3.0, 0.0))}, gs.PerspectiveCamera()
LIGHT = {
    "color": given((1.0, 1.0, 1.0)), "intensity": given(1.0), "near": given(None), "far": given(None), "shadow": given(None),
}  # fmt: skip
LOCAL = LIGHT | LAMP | {"radius": given(0.0), "range": given(None), "falloff": given(0.0)}

# What is built: (callable, its arguments).
SETTINGS: dict[str, Call] = {
    "ConstantBias": (gs.ConstantBias, {"world": given(0.1)}),
    "SlopeScaledBias": (gs.SlopeScaledBias, {"factor": given(1.0), "units": given(1.0)}),
    "NormalOffsetBias": (gs.NormalOffsetBias, {"texels": given(1.0)}),
    "ClipBias": (gs.ClipBias, {"clip": given(0.0), "normal": given(0.0), "caster": given(True)}),
    "ClipSpace": (gs.ClipSpace, {"zero_to_one": given(True), "reversed": given(False)}),
    "DirectionalLight": (gs.DirectionalLight, LIGHT | {"direction": given((0, -1, 0)), "angle": given(0.0)}),
    "SpotLight": (
        gs.SpotLight,
        LOCAL | {"direction": given((0, -1, 0)), "inner_angle": given(10.0), "outer_angle": given(30.0)},
    ),
    "PointLight": (gs.PointLight, LOCAL),
    "Material": (
        gs.Material,
        {
            "color": given((1.0,) * 4), "texture": given(None), "alpha_mode": given(gs.AlphaMode.OPAQUE),
            "cutoff": given(0.5), "double_sided": given(False),
        },
    ),
    "Mesh": (
        gs.Mesh,
        {
            "positions": given(np.eye(3)), "triangles": given([[0, 1, 2]]), "normals": given(None), "uv": given(None),
            "material": gs.Material,
        },
    ),
    "Node": (
        gs.Node,
        {
            "name": given("a"), "mesh": given(MESH), "world_from_mesh": given(np.eye(4)), "casts": given(True),
            "receives": given(True),
        },
    ),
    "Scene": (
        gs.Scene,
        {"nodes": given((NODE,)), "camera": given(None), "lights": given(None), "name": given("scene")},
    ),
    "Scene.moved": (SCENE.moved, {"matrices": given({"a": np.eye(4)})}),
    "Scene.moved matrix": (lambda matrix: SCENE.moved({"a": matrix}), {"matrix": given(np.eye(4))}),
    "scenes.wall": (
        gs.scenes.wall, {"elevation": given(30.0), "height": given(2.0), "half": given(None)},
    ),
    "scenes.plates": (
        gs.scenes.plates,
        {"gap": given(0.1), "elevation": given(45.0), "half": given(1.0), "lamp_height": given(None)},
    ),
    "scenes.plates lamp": (
        gs.scenes.plates,
        {"gap": given(0.1), "half": given(1.0), "lamp_height": given(3.0)},
    ),
    "scenes.sphere": (
        gs.scenes.sphere,
        {
            "elevation": given(45.0), "radius": given(1.0), "height": given(3.0), "lamp_height": given(None),
            "subdivisions": given(1),
        },
    ),
    "scenes.sphere lamp": (
        gs.scenes.sphere,
        {"radius": given(1.0), "height": given(3.0), "lamp_height": given(9.0), "subdivisions": given(1)},
    ),
    "scenes.ball": (gs.scenes.ball, {"elevation": given(30.0), "radius": given(1.0), "subdivisions": given(1)}),
    "scenes.box": (
        gs.scenes.box,
        {"elevation": given(30.0), "azimuth": given(30.0), "extents": given((1.0, 2.0, 1.5))},
    ),
    "scenes.plane": (gs.scenes.plane, {"elevation": given(45.0), "half": given(5.0)}),
    "scenes.room": (gs.scenes.room, {"size": given(2.0), "rods": given(False)}),
    "AnalyticScene.exact": (
        gs.scenes.wall().exact, {"points_w": given((1.0, 0.0, 0.0)), "normals_w": given((0.0, 1.0, 0.0))},
    ),
    "load": (
        gs.load, {"source": given(SCENE), "ground": given(False), "up_axis": given(None), "name": given(None)},
    ),
    "trace": (
        gs.trace,
        {
            "scene": given(SCENE), "camera": given(None), "lights": given(None), "size": given(SIZE),
            "pixel_samples": given(1), "light_samples": given(1), "surface": given(None),
        },
    ),
    "study.Grid": (
        study.Grid,
        {
            "resolutions": given((64,)), "filters": given((gs.Hard(),)), "biases": given((None,)), "targets": given((None,)),
            "more": given(()),
        },
    ),
    "study.Grid.default": (study.Grid.default, {"scene": given(SCENE)}),
    "study.pareto_front": (study.pareto_front, {"costs": given([1.0, 2.0]), "errors": given([2.0, 1.0])}),
    "overlay.required_outputs": (overlay.required_outputs, {"names": given(("map",))}),
    "image.read": (image.read, {"source": given(b"no image")}),
}  # fmt: skip


def verdict(call: Callable[[], Any]) -> str | None:
    """What is wrong with how a call ends; None: nothing."""
    with warnings.catch_warnings(record=True) as caught, np.errstate(all="warn", under="ignore"):
        warnings.simplefilter("always")
        try:
            result = call()
        except gs.GlshadowError as error:
            result = None
            if not str(error).isprintable() or len(str(error)) > 2100:
                return f"unprintable or endless: {str(error)[:200]!r}"
        except Exception as error:
            return f"{type(error).__name__}: {str(error)[:200]}"
    foreign = [each for each in caught if not issubclass(each.category, gs.GlshadowWarning)]
    if foreign:
        return f"{foreign[0].category.__name__}: {foreign[0].message} ({foreign[0].filename}:{foreign[0].lineno})"
    return picture_fault(result) if isinstance(result, gs.Frame) else None


def picture_fault(frame: gs.Frame) -> str | None:
    """What a picture must not hold."""
    linear = frame.outputs.get("linear", np.zeros(1))
    if not np.isfinite(linear).all() or (linear < 0.0).any():
        return f"linear from {linear.min()} to {linear.max()}"
    return None


def faults(function: Callable[..., Any], arguments: dict[str, Callable[[], Any]], name: str) -> list[str]:
    found = []
    for odd, make in ODD.items():
        values = {key: value() for key, value in arguments.items()} | {name: make()}
        fault = verdict(lambda values=values: function(**values))  # type: ignore[misc]
        if fault:
            found.append(f"{name}={odd}: {fault}")
    return found


def cases(calls: dict[str, Call]) -> list[Any]:
    return [pytest.param(*call, name, id=f"{key}-{name}") for key, call in calls.items() for name in call[1]]


@pytest.mark.parametrize(("function", "arguments", "name"), cases(SETTINGS))
def test_settings(function: Callable[..., Any], arguments: dict[str, Callable[[], Any]], name: str) -> None:
    assert verdict(lambda: function(**{key: value() for key, value in arguments.items()})) is None
    assert faults(function, arguments, name) == []


@pytest.fixture(scope="module")
def renderer() -> Iterator[gs.Renderer]:
    with gs.Renderer() as renderer:
        yield renderer


@pytest.fixture(scope="module")
def results(renderer: gs.Renderer) -> tuple[gs.Frame, gs.Truth]:
    outputs = ("image", "visibility", "depth", "shadow_maps")
    return renderer.render(SCENE, size=SIZE, outputs=outputs), gs.trace(SCENE, size=SIZE)


RENDER = {
    "scene": given(SCENE), "camera": given(None), "lights": given(None), "size": given(SIZE), "ambient": given(0.1),
    "background": given((0.0, 0.0, 0.0)), "outputs": given(("image", "linear")),
}  # fmt: skip


@pytest.mark.parametrize("name", RENDER)
def test_render(renderer: gs.Renderer, name: str) -> None:
    assert faults(renderer.render, RENDER, name) == []


def test_odd_arguments_that_are_fine_make_pictures(renderer: gs.Renderer) -> None:
    """Or the tests above would pass if everything were refused."""
    for name, odd in [("lights", "lights"), ("lights", "sun"), ("lights", "()"), ("ambient", "0-d"), ("ambient", "[.5] * 3"),
                      ("background", "read-only"), ("background", "0"), ("outputs", "names"), ("size", "one")]:  # fmt: skip
        values = {key: value() for key, value in RENDER.items()} | {name: ODD[odd]()}
        if name == "size":
            values["size"] = iter((np.int64(8), 6))
        assert isinstance(renderer.render(**values), gs.Frame), (name, odd)


def test_light_is_neither_negative_nor_endless(renderer: gs.Renderer) -> None:
    for refused in (
        {"ambient": -0.1},
        {"ambient": (0.1, -0.1, 0.1)},
        {"background": (0.0, 0.0, 1e308)},
        {"background": (-0.1, 0.0, 0.0)},
    ):
        with pytest.raises(gs.SettingsError, match=next(iter(refused))):
            renderer.render(SCENE, size=SIZE, **refused)  # type: ignore[arg-type]
    for strong in ({"ambient": 1e38}, {"lights": gs.DirectionalLight(color=(1e38,) * 3, intensity=1e38)}):
        frame = renderer.render(SCENE, size=SIZE, outputs=("linear",), **strong)  # type: ignore[arg-type]
        assert picture_fault(frame) is None


RESULTS: dict[str, dict[str, Any]] = {
    "gs.render": {"scene": SCENE, "camera": None, "lights": None, "size": SIZE, "path": None, "ambient": 0.1, "outputs": ("image",)},
    "Renderer": {"backend": "auto", "context": None},
    "gs.measure": {"frame": 0, "truth": 1},
    "gs.flip": {"ours": 0, "reference": 0, "pixels_per_degree": 67.0},
    "overlay.overlay": {"frame": 0, "names": ("map",)},
    "Frame.save": {"path": "a.png"},
    "Frame.save exr": {"path": "a.exr"},
    "image.write": {"path": "a.png", "image": np.zeros((2, 2, 3), dtype=np.uint8)},
    "image.write exr": {"path": "a.exr", "image": {"x": np.zeros((2, 2))}},
    "image.write channel": {"value": np.zeros((2, 2))},
    "Truth.near_edge": {"light": 0, "radius": 0.1, "where": None},
    "Truth.near_foot": {"radius": 0.1, "where": np.ones(SIZE[::-1], dtype=bool)},
    "ShadowError.picture": {"light": 0},
}  # fmt: skip


@pytest.mark.parametrize(("key", "name"), [(key, name) for key, arguments in RESULTS.items() for name in arguments])
def test_results(
    results: tuple[gs.Frame, gs.Truth], key: str, name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    frame, truth = results

    def opened(**arguments: Any) -> None:
        gs.Renderer(**arguments).release()

    functions: dict[str, Callable[..., Any]] = {
        "gs.render": gs.render, "Renderer": opened, "gs.measure": gs.measure, "gs.flip": gs.flip, "overlay.overlay": overlay.overlay,
        "Frame.save": frame.save, "Frame.save exr": frame.save, "image.write": image.write, "image.write exr": image.write,
        "image.write channel": lambda value: image.write("a.exr", {"x": value}), "Truth.near_edge": truth.near_edge,
        "Truth.near_foot": truth.near_foot, "ShadowError.picture": gs.measure(frame, truth).picture,
    }  # fmt: skip
    made = {"frame": frame, "truth": truth, "ours": frame, "reference": frame}
    arguments = {other: given(made.get(other, value)) for other, value in RESULTS[key].items()}
    assert faults(functions[key], arguments, name) == []
    assert not list(tmp_path.glob(".*"))


STUDY: dict[str, Any] = {
    "scene": SCENE, "camera": None, "lights": None, "size": SIZE, "repeats": 1, "resume": None, "progress": None, "backend": "auto",
}  # fmt: skip
PLAN = STUDY | {"wrong": 0.9, "filters": (gs.Hard(),), "resolutions": (64,)}


@pytest.mark.parametrize(
    ("function", "given_arguments", "name"),
    [(study.run_study, STUDY | {"grid": [gs.Shadow(resolution=64)]}, name) for name in (*STUDY, "grid")]
    + [(study.run_plan, PLAN, name) for name in PLAN],
)
def test_studies(
    function: Callable[..., Any],
    given_arguments: dict[str, Any],
    name: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """With a run that is not carried out: what it would be given is checked before."""
    monkeypatch.chdir(tmp_path)

    def stop(*_: object) -> None:
        raise gs.ResourceError("all arguments are fine")

    monkeypatch.setattr("glshadow.study.run.Floor", stop)
    assert faults(function, {key: given(value) for key, value in given_arguments.items()}, name) == []
