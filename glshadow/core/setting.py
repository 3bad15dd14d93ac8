"""One declaration per setting: what it may be, its default and its help. Whatever else is given, of any type, is a SettingsError."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import MISSING, field, fields
from enum import Enum
from numbers import Integral, Real
from typing import Any

import numpy as np

from glshadow.errors import SettingsError

Rule = Callable[[str, Any], Any]
"""(name, value as given) -> value as it is kept; a SettingsError that names the setting, what it may be and what it was."""

_LONGEST = 120  # characters of a value in a message


def setting(rule: Rule, default: Any = MISSING, *, factory: Any = MISSING, help: str = "") -> Any:
    """A field of a frozen dataclass that derives from Settings.

    Parameters
    ----------
    rule : Rule
        One of this file's, or `optional` of one.
    default, factory : optional
        As of dataclasses.field; neither: it must be given.
    help : str
        One line for the command line and the reports.
    """
    return field(default=default, default_factory=factory, metadata={"rule": rule, "help": help})


class Settings:
    """Base of frozen dataclasses whose fields are checked, and normalised, when they are built."""

    def __post_init__(self) -> None:
        for each in fields(self):  # type: ignore[arg-type]  # every heir is a dataclass
            rule = each.metadata.get("rule")
            if rule is not None:
                kept = rule(f"{type(self).__name__} {each.name}", getattr(self, each.name))
                object.__setattr__(self, each.name, kept)


def shown(value: Any) -> str:
    """A value for a message: its repr on one line, cut where it is long, its type where it has none."""
    try:
        text = " ".join(repr(value).split())
    except Exception:  # a foreign object's own fault must not hide ours
        text = f"<{type(value).__name__}>"
    return text if len(text) <= _LONGEST else f"{text[: _LONGEST - 3]}..."


def refuse(name: str, allowed: str, value: Any) -> SettingsError:
    """The error of a setting that must be `allowed`."""
    return SettingsError(f"{name} must be {allowed}, got {shown(value)}")


def number(
    least: float = -math.inf, most: float = math.inf, *, unit: str = "", above: bool = False, below: bool = False
) -> Rule:
    """A finite real number in [least, most]; above, below: the end itself is excluded."""
    span = ""
    if least > -math.inf or most < math.inf:
        left = "(" if above or least == -math.inf else "["
        right = ")" if below or most == math.inf else "]"
        span = f" in {left}{least:g}, {most:g}{right}"
    allowed = f"a finite number{span}{' ' + unit if unit else ''}"

    def rule(name: str, value: Any) -> float:
        kept = as_float(value)
        inside = least < kept if above else least <= kept
        if not (math.isfinite(kept) and inside and (kept < most if below else kept <= most)):
            raise refuse(name, allowed, value)
        return kept

    return rule


def as_float(value: Any) -> float:
    """A real number, or an array that holds just one; NaN for everything else, booleans too."""
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
    except (OverflowError, ValueError):
        return math.nan


def whole(least: int, most: int, *, unit: str = "") -> Rule:
    """An integer in [least, most], Python's or numpy's."""
    allowed = f"an integer in [{least}, {most}]{' ' + unit if unit else ''}"

    def rule(name: str, value: Any) -> int:
        if isinstance(value, bool | np.bool_) or not isinstance(value, Integral):
            raise refuse(name, allowed, value)
        kept = int(value)
        if not least <= kept <= most:
            raise refuse(name, allowed, value)
        return kept

    return rule


def one_of(*values: Any) -> Rule:
    """One of some integers or strings."""
    allowed = f"one of {', '.join(map(str, values))}"

    def rule(name: str, value: Any) -> Any:
        if isinstance(value, Integral) and not isinstance(value, bool):
            value = int(value)
        kinds = {type(each) for each in values}
        if type(value) not in kinds or value not in values:
            raise refuse(name, allowed, value)
        return value

    return rule


def vector(size: int = 3, least: float = -math.inf, most: float = math.inf) -> Rule:
    """So many finite real numbers, each in [least, most], as a tuple of floats."""
    span = "" if least == -math.inf and most == math.inf else f" from {least:g} to {most:g}"
    allowed = f"{size} finite numbers{span}"

    def rule(name: str, value: Any) -> tuple[float, ...]:
        kept = as_floats(value)
        if kept is None or kept.shape != (size,) or not ((kept >= least) & (kept <= most) & np.isfinite(kept)).all():
            raise refuse(name, allowed, value)
        return tuple(kept.tolist())

    return rule


def as_floats(value: Any) -> np.ndarray[Any, np.dtype[np.float64]] | None:
    """A sequence or array of real numbers as float64 of its shape; None for everything else (masked, complex, text, iterators)."""
    if np.ma.isMaskedArray(value) or isinstance(value, str | bytes | dict | set | frozenset):
        return None
    try:
        array = np.asarray(value)
        if array.dtype.kind == "O":  # huge integers, None, ragged rows
            array = np.array([as_float(each) for each in array.ravel()], dtype=np.float64).reshape(array.shape)
        if array.dtype.kind not in "iuf":
            return None
        with np.errstate(all="ignore"):
            return array.astype(np.float64)
    except Exception:  # whatever numpy or a foreign __array__ raises: it is no array of numbers
        return None


def instance(*kinds: type) -> Rule:
    """An instance of one of some classes."""
    names = [kind.__name__ for kind in kinds]
    allowed = names[0] if len(names) == 1 else f"{', '.join(names[:-1])} or {names[-1]}"
    if any(issubclass(kind, Enum) for kind in kinds):
        allowed += "".join(f" ({', '.join(str(each) for each in kind)})" for kind in kinds if issubclass(kind, Enum))

    def rule(name: str, value: Any) -> Any:
        if not isinstance(value, kinds):
            raise refuse(name, allowed, value)
        return value

    return rule


def flag() -> Rule:
    """True or False."""

    def rule(name: str, value: Any) -> bool:
        if not isinstance(value, bool | np.bool_):
            raise refuse(name, "True or False", value)
        return bool(value)

    return rule


def optional(rule: Rule, meaning: str = "derived") -> Rule:
    """The same, or None; `meaning`: what None stands for."""

    def either(name: str, value: Any) -> Any:
        if value is None:
            return None
        try:
            return rule(name, value)
        except SettingsError as error:
            raise SettingsError(str(error).replace(", got ", f" or None ({meaning}), got ", 1)) from None

    return either
