"""The rules of settings: accepted values, their stored types, and messages of refusal."""

from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from glshadow.core.setting import (
    Rule,
    Settings,
    as_float,
    as_floats,
    as_path,
    fits,
    flag,
    instance,
    number,
    numbers_in,
    one_of,
    optional,
    setting,
    several,
    shown,
    text,
    vector,
    whole,
)
from glshadow.errors import SceneError, SettingsError

KEPT: list[tuple[Rule, Any, Any]] = [
    (number(), 3, 3.0),
    (number(), np.float32(0.5), 0.5),
    (number(), np.array(2), 2.0),
    (number(0.0), -0.0, 0.0),
    (whole(1, 9), np.int8(9), 9),
    (whole(1, 9), np.array(1), 1),
    (one_of(1, 4), np.int64(4), 4),
    (one_of("a", "b"), np.str_("b"), "b"),
    (vector(3), range(3), (0.0, 1.0, 2.0)),
    (vector(2), np.array([1, 2], dtype=">i2"), (1.0, 2.0)),
    (several(whole(1, 9), "digits"), iter((1, 2)), (1, 2)),
    (several(whole(1, 9), "digits"), np.arange(1, 3), (1, 2)),
    (optional(number()), None, None),
    (flag(), np.True_, True),
    (text(), np.str_("a"), "a"),
]


@pytest.mark.parametrize(("rule", "given", "kept"), KEPT)
def test_values_are_stored_in_the_simplest_type(rule: Rule, given: Any, kept: Any) -> None:
    found = rule("x", given)
    assert found == kept
    assert type(found) is type(kept)


REFUSED: list[tuple[Rule, Any, str]] = [
    (number(0.0, 1.0, unit="degrees", below=True), 1, "x must be a finite number in [0, 1) degrees, got 1"),
    (number(0.0, above=True), 0.0, "x must be a finite number in (0, inf), got 0.0"),
    (number(), True, "x must be a finite number, got True"),
    (number(), 10**400, "x must be a finite number, got 1000"),
    (whole(1, 9), 3.0, "x must be an integer in [1, 9], got 3.0"),
    (one_of("a", "b"), "c", "x must be one of 'a', 'b', got 'c'"),
    (one_of(1, 4), True, "x must be one of 1, 4, got True"),
    (vector(3, 0.0, 1.0), (0, 1, 2), "x must be 3 finite numbers, each in [0, 1], got (0, 1, 2)"),
    (vector(3), np.zeros((5, 3)), "x must be 3 finite numbers, got an array (5, 3) of float64"),
    (several(whole(1, 9), "digits"), {1, 2}, "x must be a sequence of digits, got {1, 2}"),
    (several(whole(1, 9), "digits"), (1, 0), "x[1] must be an integer in [1, 9], got 0"),
    (several(whole(1, 9), "digits", 2), iter((1, 2, 3)), "x must be at most 2 of digits"),
    (optional(number(), "derived"), "a", "x must be a finite number or None (derived), got 'a'"),
    (flag(), 1, "x must be True or False, got 1"),
    (instance(Fraction), "a", "x must be Fraction, got 'a'"),
    (text(), b"a", "x must be a string, got b'a'"),
]


@pytest.mark.parametrize(("rule", "given", "message"), REFUSED)
def test_refusals_name_setting_range_and_value(rule: Rule, given: Any, message: str) -> None:
    with pytest.raises(SettingsError) as caught:
        rule("x", given)
    assert str(caught.value).startswith(message)
    assert len(str(caught.value)) < 250


def test_shapes() -> None:
    cube = np.zeros((2, 3, 4))
    assert fits(cube, (2, 3, 4))
    assert fits(cube, (None, 3, None))
    assert fits(cube, (..., 4))
    assert fits(cube, (...,))
    assert fits(np.zeros(()), (...,))
    assert not fits(cube, (..., 3))
    assert not fits(cube, (3, 4))
    assert not fits(np.zeros(3), (..., 3, 3))
    given = np.eye(4)
    kept = as_floats(given)
    assert kept is not None
    np.testing.assert_array_equal(kept, given)
    assert not np.shares_memory(kept, given)  # later changes by the caller must not reach the setting
    assert as_floats(given, (3, 3)) is None


def test_shape_is_checked_before_allocation() -> None:
    assert as_floats(np.broadcast_to(np.float32(0.0), (1 << 40, 5)), (None, 3)) is None


def test_non_numbers_are_refused() -> None:
    masked = [np.ma.masked, 1.0]  # numpy would convert it to NaN, with a warning
    dates = np.array(["2026"], dtype="M8[Y]")
    for value in ("1", b"1", bytearray(b"1"), {1: 2}, {1}, [True], [1j], [[1], [1, 2]], masked, np.ma.ones(3), dates):
        assert numbers_in(value) is None, value
    found = numbers_in(iter([1]))
    assert found is not None
    assert np.isnan(found).all()  # an object, which no rule accepts as a number


def test_numbers_beyond_float64_are_refused() -> None:
    assert np.isnan(as_float(10**400))
    found = numbers_in([10**400, 1])
    assert found is not None
    assert np.isnan(found[0])


@pytest.mark.parametrize("bad", ["", "a\0b", "x" * 256, "a/" * 3000, "\ud800", b"a", 3, None])
def test_paths(bad: Any) -> None:
    assert as_path("path", Path("a") / "b") == Path("a/b")
    with pytest.raises(SettingsError, match="path must be a path"):
        as_path("path", bad)


def test_class_may_raise_its_own_error() -> None:
    @dataclass(frozen=True)
    class Part(Settings):
        refusal = SceneError
        size: float = setting(number(0.0), 1.0, help="how large it is")

    assert Part(2).size == 2.0
    with pytest.raises(SceneError, match=r"Part size must be a finite number in \[0, inf\), got -1"):
        Part(-1)


def test_values_in_messages_are_short_and_on_one_line() -> None:
    class Bad:
        def __repr__(self) -> str:
            raise RuntimeError

    for value in ("x" * 1000, list(range(1000)), np.eye(3), {1: "\n\n"}, Bad(), 10**5000):
        assert len(shown(value)) <= 120
        assert "\n" not in shown(value)
