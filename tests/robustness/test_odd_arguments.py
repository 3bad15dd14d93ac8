"""Every public callable with every odd value in place of each argument: it works, or it names the fault; no foreign error, no foreign
warning, and nothing in a picture that is negative or no number."""

from __future__ import annotations

import warnings
from collections.abc import Callable
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
