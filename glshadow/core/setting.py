"""Declares a setting once: its allowed values, default and help. Any other value raises a SettingsError."""

from __future__ import annotations

import math
import os
import reprlib
from collections.abc import Callable, Mapping, Set
from dataclasses import MISSING, field, fields
from enum import Enum
from functools import cache
from numbers import Integral, Real
from pathlib import Path
from types import EllipsisType
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from glshadow.errors import GlshadowError, SettingsError

Numbers = NDArray[Any]
Floats = NDArray[np.float64]
Shape = tuple[int | EllipsisType | None, ...]
"""Expected lengths; None: any length; a leading ...: any further dimensions."""

Rule = Callable[[str, Any], Any]
"""(name, given value) -> value to store, or a SettingsError that names the setting, what is allowed and what was given."""

_LONGEST = 120  # characters of a value in a message
_LONGEST_NAME, _LONGEST_PATH = 255, 4095  # bytes that file systems allow


def setting(
    rule: Rule, default: Any = MISSING, *, factory: Any = MISSING, help: str = "", kw_only: Any = MISSING
) -> Any:
    """A field of a frozen dataclass that derives from Settings.

    Parameters
    ----------
    rule : Rule
        A rule of this module, or `optional` of one.
    default, factory : optional
        As for dataclasses.field. Without either, the setting is required.
    help : str
        One line for the command line and reports.
    kw_only : bool
        Keyword only, also on the command line.
    """
    return field(default=default, default_factory=factory, metadata={"rule": rule, "help": help}, kw_only=kw_only)


class Settings:
    """Base of frozen dataclasses whose fields are checked and normalised when they are built."""

    refusal: ClassVar[type[GlshadowError]] = SettingsError  # error that a subclass raises

    @property
    def label(self) -> str:
        """Name of the settings in messages."""
        return type(self).__name__

    def __post_init__(self) -> None:
        for name, rule in _rules(type(self)):  # type: ignore[arg-type]  # mypy takes classes for unhashable
            try:
                kept = rule(name, getattr(self, name))
            except SettingsError as error:
                refusal = SettingsError if issubclass(SettingsError, self.refusal) else self.refusal
                raise refusal(f"{self.label} {error}") from None
            object.__setattr__(self, name, kept)


@cache
def _rules(kind: type[Settings]) -> tuple[tuple[str, Rule], ...]:
    """The fields that have one, once for each class: a file may hold a hundred thousand nodes."""
    declared = fields(kind)  # type: ignore[arg-type]  # every subclass is a dataclass
    return tuple((each.name, each.metadata["rule"]) for each in declared if "rule" in each.metadata)


_short = reprlib.Repr()
_short.maxlist = _short.maxtuple = _short.maxarray = _short.maxset = _short.maxfrozenset = _short.maxdict = 8
_short.maxstring = _short.maxother = _short.maxlong = _LONGEST


def shown(value: Any) -> str:
    """A value for a message: its repr on one line, shortened; its type if it has no repr; the shape of an array."""
    if isinstance(value, np.ndarray) and value.size > 4:
        return f"an array {value.shape} of {value.dtype}"
    try:
        text = " ".join(_short.repr(value).split())
    except Exception:  # an error in a foreign object's repr must not hide ours
        text = f"<{type(value).__name__}>"
    return text if len(text) <= _LONGEST else f"{text[: _LONGEST - 3]}..."


def refuse(name: str, allowed: str, value: Any) -> SettingsError:
    """The error for a setting that must be `allowed`."""
    return SettingsError(f"{name} must be {allowed}, got {shown(value)}")


def number(
    least: float = -math.inf, most: float = math.inf, *, unit: str = "", above: bool = False, below: bool = False
) -> Rule:
    """Rule: a finite real number in [least, most]. With above or below, the end itself is excluded."""
    span = _span(least, most, above, below)
    allowed = f"a finite number{' in ' + span if span else ''}{' ' + unit if unit else ''}"

    def rule(name: str, value: Any) -> float:
        kept = as_float(value)
        inside = least < kept if above else least <= kept
        if not (math.isfinite(kept) and inside and (kept < most if below else kept <= most)):
            raise refuse(name, allowed, value)
        return kept

    return rule


def _span(least: float, most: float, above: bool = False, below: bool = False) -> str:
    """The interval, such as `[0, inf)`; empty if every number is allowed."""
    if least == -math.inf and most == math.inf:
        return ""
    left = "(" if above or least == -math.inf else "["
    right = ")" if below or most == math.inf else "]"
    return f"{left}{least:g}, {most:g}{right}"


def as_float(value: Any) -> float:
    """A real number or one-element array as a float; NaN for everything else, including booleans."""
    if (
        isinstance(value, np.ndarray)
        and value.ndim == 0
        and value.dtype.kind in "iuf"
        and not np.ma.isMaskedArray(value)
    ):
        value = value.item()
    if isinstance(value, bool | np.bool_) or not isinstance(value, Real):
        return math.nan
    try:
        return float(value)
    except Exception:  # beyond float64, or an error in a foreign number
        return math.nan


def as_int(value: Any) -> int | None:
    """An integer (Python's or numpy's) or one-element array as an int; None for everything else, including booleans."""
    if isinstance(value, np.ndarray) and value.ndim == 0 and not np.ma.isMaskedArray(value):
        value = value.item()
    if isinstance(value, bool | np.bool_) or not isinstance(value, Integral):
        return None
    try:
        return int(value)
    except Exception:  # an error in a foreign number
        return None


def whole(least: int, most: int, *, unit: str = "") -> Rule:
    """Rule: an integer in [least, most], Python's or numpy's."""
    allowed = f"an integer in [{least}, {most}]{' ' + unit if unit else ''}"

    def rule(name: str, value: Any) -> int:
        kept = as_int(value)
        if kept is None or not least <= kept <= most:
            raise refuse(name, allowed, value)
        return kept

    return rule


def one_of(*values: Any) -> Rule:
    """Rule: one of the given integers or strings."""
    allowed = f"one of {', '.join(map(repr, values))}"
    kinds = {type(each) for each in values}

    def rule(name: str, value: Any) -> Any:
        number = as_int(value)
        # convert numpy's to Python's
        kept = str.__str__(value) if isinstance(value, str) else value if number is None else number
        if type(kept) not in kinds or kept not in values:
            raise refuse(name, allowed, value)
        return kept

    return rule


def vector(size: int = 3, least: float = -math.inf, most: float = math.inf) -> Rule:
    """Rule: `size` finite real numbers, each in [least, most]; stored as a tuple of floats."""
    span = _span(least, most)
    allowed = f"{size} finite numbers{', each in ' + span if span else ''}"

    def rule(name: str, value: Any) -> tuple[float, ...]:
        kept = as_floats(value, (size,))
        if kept is None or not ((kept >= least) & (kept <= most) & np.isfinite(kept)).all():
            raise refuse(name, allowed, value)
        return tuple(kept.tolist())

    return rule


def numbers_in(value: Any) -> Numbers | None:
    """A sequence or array of real numbers as an array; None for everything else (masked, complex, text, iterators)."""
    if isinstance(value, str | bytes | bytearray | memoryview | dict | set | frozenset):
        return None
    try:
        if _masked(value):
            return None
        array = np.asarray(value)
        if array.dtype.kind == "O":  # huge integers, None, ragged rows
            array = np.array([as_float(each) for each in array.ravel()], dtype=np.float64).reshape(array.shape)
    except MemoryError:
        raise SettingsError(f"there is not enough memory for {shown(value)}") from None
    except Exception:  # whatever numpy or a foreign __array__ raises: not an array of numbers
        return None
    return array if array.dtype.kind in "iuf" else None


def _masked(value: Any) -> bool:
    """Whether any element is masked: numpy would drop the mask, or warn."""
    if isinstance(value, list | tuple):
        return any(map(_masked, value))
    return isinstance(value, np.ma.MaskedArray)


def as_floats(value: Any, shape: Shape = (...,)) -> Floats | None:
    """A sequence or array of real numbers as a float64 copy; None if it is not one, or does not match the shape."""
    array = numbers_in(value)
    if array is None or not fits(array, shape):
        return None
    with np.errstate(all="ignore"):
        return array.astype(np.float64)


def fits(array: Numbers, shape: Shape) -> bool:
    """Whether an array matches a shape."""
    if shape[0] is ...:
        return array.shape[max(array.ndim + 1 - len(shape), 0) :] == shape[1:]
    return array.ndim == len(shape) and all(b is None or a == b for a, b in zip(array.shape, shape, strict=True))


def several(rule: Rule, what: str, most: int = 1 << 16) -> Rule:
    """Rule: a sequence or iterator of items, each checked by `rule`; stored as a tuple. `what` names the items in messages."""
    allowed = f"a sequence of {what}"

    def all_of(name: str, value: Any) -> tuple[Any, ...]:
        if isinstance(value, str | bytes | bytearray | Mapping | Set):  # iterable, but not a sequence of items
            raise refuse(name, allowed, value)
        kept: list[Any] = []
        try:
            items = iter(value)
        except Exception:  # an error in a foreign __iter__, or no __iter__
            raise refuse(name, allowed, value) from None
        for item in items:
            if len(kept) == most:
                raise SettingsError(f"{name} must be at most {most} of {what}")
            try:
                kept.append(rule(name, item))
            except SettingsError:
                rule(f"{name}[{len(kept)}]", item)  # with its index in the message
                raise
        return tuple(kept)

    return all_of


def text() -> Rule:
    """Rule: a string."""

    def rule(name: str, value: Any) -> str:
        if not isinstance(value, str):
            raise refuse(name, "a string", value)
        return str.__str__(value)  # a subclass may override __str__

    return rule


def instance(*kinds: type) -> Rule:
    """Rule: an instance of one of these classes. The message lists the members of a family."""

    def allowed() -> str:
        names = [kind.__name__ + _members(kind) for kind in kinds]
        return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} or {names[-1]}"

    def rule(name: str, value: Any) -> Any:
        if not isinstance(value, kinds):
            raise refuse(name, allowed(), value)
        return value

    return rule


def _members(kind: type) -> str:
    """Of an enumeration or a family, in parentheses."""
    names = [str(each) for each in kind] if issubclass(kind, Enum) else list(dict.fromkeys(_leaf_classes(kind)))
    return f" ({', '.join(names)})" if names else ""


def _leaf_classes(kind: type) -> list[str]:
    """Names of the concrete classes of a family, without intermediate bases."""
    found: list[str] = []
    subclass: type
    for subclass in kind.__subclasses__():
        found += _leaf_classes(subclass) or [subclass.__name__]
    return found


def as_path(name: str, value: str | os.PathLike[str]) -> Path:
    """A path given as text or by an object with __fspath__.

    Raises
    ------
    SettingsError
        For anything else, including bytes, and for text that cannot name a file.
    """
    try:
        given = os.fspath(value)
        path = str.__str__(given)
        parts = os.fsencode(path).split(os.fsencode(os.sep))
    except Exception:  # whatever a foreign __fspath__ raises, bytes, and lone surrogates
        raise refuse(name, "a path (str or os.PathLike)", value) from None
    if not path or "\0" in path or max(map(len, parts)) > _LONGEST_NAME or len(path) > _LONGEST_PATH:
        raise refuse(
            name, f"a path without NUL, its names from 1 to {_LONGEST_NAME} bytes long, {_LONGEST_PATH} in all", value
        )
    return Path(path)


def flag() -> Rule:
    """Rule: True or False."""

    def rule(name: str, value: Any) -> bool:
        if not isinstance(value, bool | np.bool_):
            raise refuse(name, "True or False", value)
        return bool(value)

    return rule


def optional(rule: Rule, meaning: str = "derived") -> Rule:
    """Rule: the same, or None. `meaning` is what None stands for."""

    def either(name: str, value: Any) -> Any:
        if value is None:
            return None
        try:
            return rule(name, value)
        except SettingsError as error:
            raise SettingsError(str(error).replace(", got ", f" or None ({meaning}), got ", 1)) from None

    return either
