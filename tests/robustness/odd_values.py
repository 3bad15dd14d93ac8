"""Arguments that no caller should give, and some that look odd but are fine: for the tests, and for scripts/fuzz."""

from __future__ import annotations

import datetime
import itertools
from collections import UserDict, UserList
from collections.abc import Callable
from decimal import Decimal
from enum import StrEnum
from fractions import Fraction
from typing import Any

import numpy as np

import glshadow as gs


class Raising:
    """Whatever is asked of it, it raises."""

    def __fail(self, *_: object, **__: object) -> Any:
        raise RuntimeError("a foreign object's own fault")

    __repr__ = __str__ = __float__ = __int__ = __index__ = __len__ = __iter__ = __array__ = __bool__ = __fspath__ = (
        __fail
    )
    __eq__ = __lt__ = __getitem__ = __call__ = __complex__ = __fail
    __hash__ = object.__hash__


class Escaping:
    """Its repr drives a terminal."""

    def __repr__(self) -> str:
        return "\x1b]0;title\x07\u202e" + "x" * 10_000


class RaisingNumber(int):
    """An integer whose conversions fail."""

    def __float__(self) -> float:
        raise ZeroDivisionError("a foreign number's own fault")

    __index__ = __int__ = __float__  # type: ignore[assignment]


class Word(StrEnum):
    """A string that is an enum's member."""

    IMAGE = "image"


class ShoutingText(str):
    """A string that says something else."""

    __slots__ = ()

    def __str__(self) -> str:
        raise RuntimeError("a foreign string's own fault")


def _self_containing() -> list[Any]:
    rows: list[Any] = [1.0, 2.0]
    rows.append(rows)
    return rows


def _stairs() -> Any:
    yield from (0.25, 0.5, 0.75)


# Made anew for every call: iterators are used up, arrays could be written to.
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
