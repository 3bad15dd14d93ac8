"""How a family of settings is written in one word, on the command line and in reports: pcf:1, slope:1.1,4, none."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import MISSING, fields
from typing import Any, ClassVar, TypeVar

from glshadow.core.setting import Settings, shown
from glshadow.core.spaces import Triple
from glshadow.errors import SettingsError


class Spelled(Settings):
    """A member of a family of settings, identified by its name.

    Attributes
    ----------
    spelling : str
        Its name.
    terse : bool
        Whether the name alone means that all settings have their default.
    elsewhere : str
        Hint for settings that have moved elsewhere.
    """

    spelling: ClassVar[str] = ""
    terse: ClassVar[bool] = False
    elsewhere: ClassVar[str] = ""

    def __str__(self) -> str:
        """`spelling`, or `spelling:value,value`; a switch that differs from its default is written by its name, or no-name."""
        values = [(item, getattr(self, item.name)) for item in fields(self)]  # type: ignore[arg-type]
        if self.terse and all(value == item.default for item, value in values):
            return self.spelling
        words = [
            f"{item.name}={value if isinstance(value, Spelled) else format(value, 'g')}"
            if item.kw_only and not isinstance(value, bool)
            else _word(item.name, value)
            for item, value in values
            if not (item.kw_only and value == item.default)
            and (value is not item.default or not isinstance(value, bool))
        ]
        return f"{self.spelling}:{','.join(words)}" if words else self.spelling

    @classmethod
    def usage(cls) -> str:
        """How it may be written: `slope[:FACTOR,UNITS]`."""
        items = fields(cls)  # type: ignore[arg-type]
        if not items:
            return cls.spelling
        words = [
            f"{item.name}={'...' if isinstance(item.default, Spelled) else 'N'}"
            if item.kw_only and not isinstance(item.default, bool)
            else item.name.upper()
            if not isinstance(item.default, bool)
            else _word(item.name, not item.default)
            for item in items
        ]
        needed = sum(item.default is MISSING for item in items)
        text = cls.spelling + "".join(f"{',' if i else ':'}{word}" for i, word in enumerate(words[:needed]))
        rest = ",".join(words[needed:])
        return f"{text}[{',' if needed else ':'}{rest}]" if rest else text


T = TypeVar("T", bound=Spelled)


def parse(text: str, family: Sequence[type[T]], name: str = "value") -> T:
    """The member of a family that a text describes.

    Raises
    ------
    SettingsError
        If there is no such member, or its values are not allowed; the message lists what is.
    """
    head, colon, rest = text.strip().partition(":")
    kind = next((each for each in family if each.spelling == head), None)
    words = rest.split(",") if colon else []
    if kind is None or "" in words or (colon and not words):
        raise SettingsError(
            f"{shown(text)} is not a {name}; expected one of: {', '.join(each.usage() for each in family)}"
        )
    items = list(fields(kind))  # type: ignore[arg-type]
    values: dict[str, Any] = {}
    for word in words:
        switches = {
            _word(item.name, on): (item.name, on)
            for item in items
            if isinstance(item.default, bool)
            for on in (True, False)
        }
        plain = [item.name for item in items if not item.kw_only and not isinstance(item.default, bool)]
        free = [name for name in plain if name not in values]
        name, equals, rest = word.partition("=")
        if equals and name in {item.name for item in items if item.kw_only and item.name not in values}:
            free, word = [name], rest
        member = next(
            (item for item in items if equals and item.name == name and isinstance(item.default, Spelled)), None
        )
        if member is not None and free:
            values[name] = parse(word, family, member.name)
            continue
        number = _number(word)
        if word == DERIVED and free and next(item for item in items if item.name == free[0]).default is None:
            values[free[0]] = None
        elif word in switches:
            values.update([switches[word]])
        elif number is not None and free:
            values[free[0]] = number
        else:
            more = f"; {kind.elsewhere}" if kind.elsewhere else ""
            raise SettingsError(f"{shown(text)}: {shown(word)} is not understood; it is written {kind.usage()}{more}")
    try:
        return kind(**values)
    except TypeError:  # a value that has no default is missing
        raise SettingsError(f"{shown(text)} is incomplete; it is written {kind.usage()}") from None


DERIVED = "derived"


def _word(name: str, value: bool | float | None) -> str:
    if value is None:
        return DERIVED
    if isinstance(value, bool):
        return name if value else f"no-{name}"
    return f"{value:g}"


def _number(word: str) -> int | float | None:
    for read in (int, float):
        kind: Callable[[str], int | float] = read
        try:
            value = kind(word)
        except ValueError:
            continue
        return value if math.isfinite(value) else None
    return None


def number(text: str) -> float:
    """A finite number from text."""
    try:
        value = math.nan if "_" in text else float(text)  # Python reads 1_0 as 10
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise SettingsError(f"{text!r} is not a finite number")
    return value


def numbers(text: str, count: int) -> tuple[float, ...]:
    """`count` finite numbers from text, separated by commas."""
    parts = text.split(",")
    try:
        values = tuple(number(part) for part in parts)
    except SettingsError:
        values = ()
    if len(values) != count:
        example = ",".join(("1", "2.5", "-3")[:count])
        raise SettingsError(f"{text!r} is not {count} finite numbers separated by commas, such as {example}")
    return values


def vector(text: str) -> Triple:
    """x,y,z."""
    x, y, z = numbers(text, 3)
    return x, y, z
