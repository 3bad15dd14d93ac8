"""Arguments that no caller should pass, and some that look odd but are fine; and every public callable that takes them."""

from __future__ import annotations

import datetime
import inspect
import itertools
import math
from collections import UserDict, UserList
from collections.abc import Callable
from dataclasses import dataclass
from decimal import Decimal
from enum import StrEnum
from fractions import Fraction
from typing import Any

import numpy as np

import glshadow as gs
from glshadow import batch, image, overlay, study
from glshadow.shadows.filters import FILTERS


class Raising:
    """Raises whatever is done with it."""

    def __fail(self, *_: object, **__: object) -> Any:
        raise RuntimeError("a foreign object's own fault")

    __repr__ = __str__ = __float__ = __int__ = __index__ = __len__ = __iter__ = __array__ = __bool__ = __fspath__ = (
        __fail
    )
    __eq__ = __lt__ = __getitem__ = __call__ = __complex__ = __fail
    __hash__ = object.__hash__


class Escaping:
    """Its repr controls a terminal."""

    def __repr__(self) -> str:
        return "\x1b]0;title\x07\u202e" + "x" * 10_000


class RaisingNumber(int):
    """An integer whose conversions fail."""

    def __float__(self) -> float:
        raise ZeroDivisionError("a foreign number's own fault")

    __index__ = __int__ = __float__  # type: ignore[assignment]


class Word(StrEnum):
    """A string that is a member of an enum."""

    IMAGE = "image"


class ShoutingText(str):
    """A string whose str() differs from its value."""

    __slots__ = ()

    def __str__(self) -> str:
        raise RuntimeError("a foreign string's own fault")


def _self_containing() -> list[Any]:
    rows: list[Any] = [1.0, 2.0]
    rows.append(rows)
    return rows


def _stairs() -> Any:
    yield from (0.25, 0.5, 0.75)


# Created anew for every call: iterators are consumed, arrays could be written to.
ODD: dict[str, Callable[[], Any]] = {
    "None": lambda: None,
    "True": lambda: True,
    "np.False_": lambda: np.False_,
    "0": lambda: 0,
    "-1": lambda: -1,
    "1": lambda: 1,
    "0.5": lambda: 0.5,
    "-0.0": lambda: -0.0,
    "3.0": lambda: 3.0,
    "nan": lambda: float("nan"),
    "inf": lambda: float("inf"),
    "-inf": lambda: float("-inf"),
    "1e308": lambda: 1e308,
    "5e-324": lambda: 5e-324,
    "10**400": lambda: 10**400,
    "-10**400": lambda: -(10**400),
    "10**5000": lambda: 10**5000,
    "2**31": lambda: 2**31,
    "2**64": lambda: 2**64,
    "1j": lambda: 1j,
    "Fraction": lambda: Fraction(1, 3),
    "Decimal": lambda: Decimal("0.5"),
    "raising number": lambda: RaisingNumber(3),
    "float16": lambda: np.float16(0.5),
    "longdouble": lambda: np.longdouble("1e4000"),
    "int8": lambda: np.int8(-128),
    "uint64": lambda: np.uint64(2**64 - 1),
    "complex64": lambda: np.complex64(1 + 2j),
    "datetime": lambda: datetime.datetime(2026, 1, 1),
    "datetime64": lambda: np.datetime64("2026-01-01"),
    "timedelta64": lambda: np.timedelta64(3, "D"),
    "text": lambda: "text",
    "empty text": lambda: "",
    "image": lambda: "image",
    "escape": lambda: "\x1b]0;title\x07",
    "NUL": lambda: "a\0b.png",
    "surrogate": lambda: "\udcff.png",
    "long text": lambda: "x" * 5000,
    "text of a number": lambda: "3",
    "text enum": lambda: Word.IMAGE,
    "shouting text": lambda: ShoutingText("image"),
    "np.str_": lambda: np.str_("image"),
    "bytes": lambda: b"abc",
    "bytearray": lambda: bytearray(b"abc"),
    "memoryview": lambda: memoryview(b"abc"),
    "object": object,
    "class": lambda: gs.Shadow,
    "module": lambda: np,
    "function": lambda: len,
    "raising": Raising,
    "escaping": Escaping,
    "ellipsis": lambda: ...,
    "NotImplemented": lambda: NotImplemented,
    "slice": lambda: slice(None),
    "()": tuple,
    "[]": list,
    "{}": dict,
    "set()": set,
    "dict": lambda: {"x": 1.0, "y": 2.0, "z": 3.0},
    "dict of numbers": lambda: {0: 1, 1: 2, 2: 3},
    "set": lambda: {1.0, 2.0, 3.0},
    "frozenset": lambda: frozenset((1, 2, 3)),
    "UserDict": lambda: UserDict(a=1),
    "UserList": lambda: UserList([0.5, 0.5, 0.5]),
    "range": lambda: range(3),
    "iterator": lambda: iter((0.5, 0.5, 0.5)),
    "generator": _stairs,
    "endless": lambda: itertools.repeat(0.5),
    "map": lambda: map(float, ("1", "2", "3")),
    "zip": lambda: zip((1, 2, 3), (4, 5, 6), strict=True),
    "(1, 2, 3)": lambda: (1, 2, 3),
    "[.5] * 3": lambda: [0.5] * 3,
    "[.5] * 4": lambda: [0.5] * 4,
    "(1, nan, 3)": lambda: (1.0, float("nan"), 3.0),
    "(1, inf, 3)": lambda: (1.0, float("inf"), 3.0),
    "(-1, -1, -1)": lambda: (-1.0, -1.0, -1.0),
    "(1e308,) * 3": lambda: (1e308, 1e308, 1e308),
    "(10**400,) * 3": lambda: (10**400, 0, 0),
    "(None,) * 3": lambda: (None, None, None),
    "(True,) * 3": lambda: (True, False, True),
    "texts": lambda: ("1", "2", "3"),
    "names": lambda: ("image", "image"),
    "complexes": lambda: (1j, 2j, 3j),
    "ragged": lambda: [[1.0, 2.0], [3.0]],
    "self-containing": _self_containing,
    "list of raising": lambda: [Raising(), Raising(), Raising()],
    "list of None": lambda: [None],
    "list of objects": lambda: [object(), object()],
    "0-d": lambda: np.array(0.5),
    "0-d of ints": lambda: np.array(3),
    "0-d of objects": lambda: np.array(None),
    "0-d of dict": lambda: np.array({}),
    "one": lambda: np.array([0.5]),
    "empty array": lambda: np.zeros(0),
    "(0, 3)": lambda: np.zeros((0, 3)),
    "(3, 1)": lambda: np.ones((3, 1)),
    "(1, 3)": lambda: np.ones((1, 3)),
    "(3, 3)": lambda: np.eye(3),
    "(4, 4)": lambda: np.eye(4),
    "(4, 4) nan": lambda: np.full((4, 4), np.nan),
    "(4, 4) zeros": lambda: np.zeros((4, 4)),
    "(4, 4) 1e300": lambda: np.diag([1e300, 1e300, 1e300, 1.0]),
    "(2, 3, 4)": lambda: np.zeros((2, 3, 4)),
    "float16 array": lambda: np.full(3, 0.5, dtype=np.float16),
    "longdouble array": lambda: np.full(3, np.longdouble("1e4000")),
    "big-endian": lambda: np.full(3, 0.5, dtype=">f8"),
    "strided": lambda: np.linspace(0.0, 1.0, 6)[::2],
    "read-only": lambda: np.broadcast_to(np.float64(0.5), 3),
    "bools": lambda: np.array([True, False, True]),
    "complex array": lambda: np.ones(3, dtype=complex),
    "text array": lambda: np.array(["1", "2", "3"]),
    "bytes array": lambda: np.array([b"1", b"2", b"3"]),
    "object array": lambda: np.array([1.0, None, "x"], dtype=object),
    "object array of numbers": lambda: np.array([0.5, 0.5, 10**400], dtype=object),
    "datetime array": lambda: np.array(["2026-01-01"] * 3, dtype="datetime64[D]"),
    "timedelta array": lambda: np.array([1, 2, 3], dtype="timedelta64[s]"),
    "NaT": lambda: np.array(["NaT"] * 3, dtype="datetime64[s]"),
    "structured": lambda: np.zeros(3, dtype=[("x", "f4"), ("y", "i4")]),
    "record": lambda: np.rec.array([(1, 2.0)] * 3),
    "masked": lambda: np.ma.masked_array([1.0, 2.0, 3.0], [False, True, False]),
    "np.ma.masked": lambda: np.ma.masked,
    "list of masked": lambda: [np.ma.masked, 1.0, 2.0],

    "uint64 array": lambda: np.full((1, 3), 2**64 - 1, dtype=np.uint64),
    "int8 array": lambda: np.full((3, 3), -128, dtype=np.int8),
    "huge": lambda: np.broadcast_to(np.float64(0.5), (1 << 31, 5)),
    "huge and flat": lambda: np.broadcast_to(np.float64(0.5), 1 << 40),
    "Scene": lambda: gs.scenes.plane().scene,
    "camera": gs.PerspectiveCamera,
    "sun": gs.DirectionalLight,
    "Shadow": gs.Shadow,
    "Hard": gs.Hard,
    "Target": lambda: gs.Target.R8,
    "AlphaMode": lambda: gs.AlphaMode.MASK,
    "lights": lambda: (light for light in (gs.DirectionalLight(), gs.PointLight(position=(0, 3, 0)))),
    "set of lights": lambda: {gs.DirectionalLight()},
    "lights and None": lambda: [gs.DirectionalLight(), None],
}  # fmt: skip

SIZE = (8, 6)
Call = tuple[Callable[..., Any], dict[str, Callable[[], Any]]]


def given(value: Any) -> Callable[[], Any]:
    return lambda: value


MESH = gs.Mesh(np.eye(3), np.array([[0, 1, 2]]))
NODE = gs.Node(MESH, np.eye(4), "a")
SCENE = gs.Scene((NODE,))
# Values for required parameters, by name.
REQUIRED: dict[str, Any] = {
    "world": 0.1, "clip": 0.0, "position": (0.0, 3.0, 0.0), "positions": np.eye(3), "triangles": [[0, 1, 2]], "name": "a", "mesh": MESH,
    "world_from_mesh": np.eye(4), "nodes": (NODE,), "fx": 500.0, "fy": 500.0, "cx": 320.0, "cy": 240.0, "pose": np.eye(4),
    "image": np.full((2, 2, 3), 128, np.uint8), "lights": (gs.DirectionalLight(),),
    "scene": SCENE, "source": SCENE, "matrices": {"a": np.eye(4)}, "matrix": np.eye(4), "costs": [1.0, 2.0], "errors": [2.0, 1.0],
    "camera": gs.PerspectiveCamera(), "count": 3, "points_w": (1.0, 0.0, 0.0), "output": "a.png", "names": ("map",), "subdivisions": 1,
    "K": np.array([[500.0, 0.0, 320.0], [0.0, 500.0, 240.0], [0.0, 0.0, 1.0]]), "R": np.eye(3), "t": (0.0, 0.0, 3.0), "size": SIZE,
    "points": (0.1, 0.2), "radiance": np.full((2, 4, 3), 0.5), "pixels": np.full((2, 2, 4), 128, np.uint8),
    "segments": [[0, 1]], "latitude": 48.1, "longitude": 11.6, "when": "2026-06-21T12:00+02:00",
    "start": datetime.datetime(2026, 6, 21, tzinfo=datetime.UTC),
    "end": datetime.datetime(2026, 6, 22, tzinfo=datetime.UTC), "light": gs.DirectionalLight(),
}  # fmt: skip
# Created by glshadow, not by callers; and callables that raise, name or draw. The renderer's arguments have tests of their own.
NOT_BUILT = {
    "AlphaMode", "Camera", "Faces", "Flip", "Frame", "Renderer", "Score", "Measurement", "ShadowView", "Target", "Truth", "Used", "flip",
    "Caster", "Compared", "Comparison", "PyrenderRenderer", "ShadowMap", "Explorer", "compare", "explore", "export_page",
    "measure", "read_colmap", "render", "render_distorted", "show", "trace", "Light", "ColmapImage", "Distortion",
    "Baked", "Blockers", "FittedLight", "ShadowMasks", "ShadowOutline", "ShadowPair", "SunHours", "SurfaceOutline", "TerrainRaster",
    "bake", "fit_light", "read_dem", "shadow_masks", "shadow_pair", "sun_hours", "terrain_horizon", "terrain_shadow", "to_coco",
    "visibility", "blockers", "surface_outline", "Dem",
}  # fmt: skip


def built() -> dict[str, Call]:
    """Public callables and their arguments: the defaults, or the required ones; some with other values than the defaults."""
    named: dict[str, Callable[..., Any]] = {}
    for name in gs.__all__:  # in fixed order: workers that share the tests must generate the same names
        value = getattr(gs, name)
        if (
            name not in NOT_BUILT
            and not inspect.isabstract(value)
            and callable(value)
            and not (isinstance(value, type) and issubclass(value, gs.GlshadowError | gs.GlshadowWarning))
        ):
            named[name] = value
    named |= {f"scenes.{name}": getattr(gs.scenes, name) for name in gs.scenes.__all__ if name != "AnalyticScene"}
    for camera in (gs.PerspectiveCamera, gs.OrthographicCamera, gs.IntrinsicsCamera):
        named |= {
            f"{camera.__name__}.{maker}": getattr(camera, maker)
            for maker in ("from_pose", "from_intrinsics", "from_opencv")
            if hasattr(camera, maker)
        }
    named |= {f"filters.{kind.__name__}": kind for kind in FILTERS}
    named |= {
        "Scene.moved": SCENE.moved, "Scene.moved matrix": lambda matrix: SCENE.moved({"a": matrix}), "study.Grid": study.Grid,
        "study.Grid.default": study.Grid.default, "study.pareto_front": study.pareto_front, "image.read": image.read,
        "overlay.required_outputs": overlay.required_outputs, "batch.Job": batch.Job,
        "AnalyticScene.exact": gs.scenes.wall().exact, "PerspectiveCamera.K": gs.PerspectiveCamera().K,
    }  # fmt: skip
    for lens in (gs.BrownDistortion(0.1, p1=0.01), gs.BrownDistortion(-0.1), gs.FisheyeDistortion(0.1)):
        named |= {f"{lens}.{each}": getattr(lens, each) for each in ("distorted", "undistorted", "slopes")}
    calls = {}
    for name, function in named.items():
        parameters = inspect.signature(function).parameters.values()
        given_values = {
            each.name: REQUIRED[each.name]
            if each.default is each.empty or each.name == "subdivisions"
            else each.default
            for each in parameters
            if each.kind is not each.VAR_KEYWORD
        }
        calls[name] = (function, {key: given(value) for key, value in given_values.items()})
    calls["batch.Job"][1]["scene"] = given("courtyard")
    calls["image.read"] = (image.read, {"source": given(b"no image")})
    for name, other in [("scenes.plates", 3.0), ("scenes.sphere", 9.0)]:
        function, arguments = calls[name]
        calls[f"{name} lamp"] = (function, arguments | {"lamp_height": given(other)})
    return calls


@dataclass(frozen=True)
class Case:
    """A call with odd arguments, which `text` describes."""

    text: str
    call: Callable[[], Any]


def case(rng: np.random.Generator) -> Case:
    """One public callable with a few of its arguments drawn from ODD, or made of several of them."""
    calls = built()
    name = str(rng.choice([key for key, (_, arguments) in calls.items() if arguments]))
    function, arguments = calls[name]
    chosen = rng.choice(list(arguments), size=min(len(arguments), int(rng.integers(1, 4))), replace=False)
    drawn = {str(each): _drawn(rng) for each in chosen}
    text = f"{name}({', '.join(f'{key}={odd}' for key, (odd, _) in drawn.items())})"
    values = arguments | {key: make for key, (_, make) in drawn.items()}
    return Case(text, lambda: function(**{key: make() for key, make in values.items()}))


def _drawn(rng: np.random.Generator) -> tuple[str, Callable[[], Any]]:
    way = rng.random()
    if way < 0.5:
        name = str(rng.choice(list(ODD)))
        return f"<{name}>", ODD[name]
    if way < 0.75:
        names = [str(each) for each in rng.choice(list(ODD), size=int(rng.integers(1, 6)))]
        kind = (tuple, list, iter)[int(rng.integers(3))]
        return f"{kind.__name__} of <{'>, <'.join(names)}>", lambda: kind([ODD[each]() for each in names])
    shape = tuple(int(n) for n in rng.integers(0, 5, size=int(rng.integers(0, 4))))
    dtype = np.dtype(str(rng.choice(["f2", "f4", "f8", "i1", "u1", "i4", "u8", "c8", "?", "M8[s]", "U3", "O"])))
    data = bytes(rng.integers(0, 256, size=dtype.itemsize * math.prod(shape), dtype=np.uint8))
    if dtype.kind in "OU":
        return f"zeros {shape} of {dtype}", lambda: np.zeros(shape, dtype=dtype)
    return f"random bytes as {shape} of {dtype}", lambda: np.frombuffer(data, dtype=dtype).reshape(shape).copy()


def in_use(value: Any) -> dict[str, Any] | None:
    """Arguments of `Renderer.render` that use the result of a call; None: nothing to draw."""
    if isinstance(value, gs.Scene):
        return {"scene": value}
    if isinstance(value, gs.scenes.AnalyticScene):
        return {"scene": value.scene}
    if isinstance(value, gs.Node | gs.Mesh | gs.Material):
        material = value if isinstance(value, gs.Material) else gs.Material()
        mesh = value if isinstance(value, gs.Mesh) else gs.Mesh(np.eye(3), np.array([[0, 1, 2]]), material=material)
        node = value if isinstance(value, gs.Node) else gs.Node(mesh, np.eye(4), "a")
        return {"scene": gs.Scene((node,))}
    if isinstance(value, gs.Camera):
        return {"scene": SCENE, "camera": value}
    if isinstance(value, gs.DirectionalLight | gs.SpotLight | gs.PointLight):
        return {"scene": SCENE, "lights": value}
    return {"scene": SCENE, "lights": gs.DirectionalLight(shadow=value)} if isinstance(value, gs.Shadow) else None
