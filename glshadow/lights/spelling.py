"""How a light is written in one word on the command line: sun:-1,-2,-1:angle=0.5."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshadow.core.spelling import number, numbers
from glshadow.errors import SettingsError
from glshadow.lights.light import Light
from glshadow.shadows.cookie import Cookie
from glshadow.shadows.shadow import Shadow

Read = Callable[[str | Path], NDArray[np.uint8]]
"""Reads a cookie's image file."""


def usage(family: Sequence[type[Light]]) -> str:
    """How every kind of light is written."""
    return f"{', '.join(kind.usage for kind in family)}, each with any :key=value after it"


def keys(kind: type[Light]) -> tuple[str, ...]:
    """Keys that a light takes as `key=value`: its settings but those read by position; `cookie` is a file, at infinity with a size."""
    names = [each.name for each in fields(kind) if each.name not in kind.by_place]
    return tuple(names + ["cookie_size"] * (kind.at_infinity and "cookie" in names))


def parse(text: str, family: Sequence[type[Light]], read: Read) -> Light:
    """The light that a text describes.

    Parameters
    ----------
    family : sequence of classes
        Kinds of light that may be written.
    read : callable
        Reads the image file of a cookie.

    Raises
    ------
    SettingsError
        If the text matches no light, or its settings are not allowed; the message lists what is.
    """
    name, *parts = text.split(":")
    kind = next((each for each in family if each.spelling == name), None)
    placed = [part for part in parts if "=" not in part]
    if kind is None or parts[: len(placed)] != placed or not kind.places[0] <= len(placed) <= kind.places[1]:
        raise SettingsError(f"{text!r} is not a light; expected one of: {usage(family)}")
    given = dict(_key(kind, part) for part in parts[len(placed) :])
    path, size = given.pop("cookie", None), given.pop("cookie_size", None)
    if path is not None:
        given["cookie"] = Cookie(image=read(path), repeat=kind.at_infinity, size=1.0 if size is None else size)
    elif size is not None:
        raise SettingsError("cookie_size needs a cookie: cookie=FILE")
    return kind(**{**kind.from_places(placed), **given})


def _key(kind: type[Light], text: str) -> tuple[str, Any]:
    key, _, value = text.partition("=")
    if key not in keys(kind):
        raise SettingsError(f"a {kind.spelling} has no setting {key!r}; it takes {', '.join(keys(kind))}")
    if key == "cookie":
        return key, value
    if key not in ("shadow", "photometric"):
        return key, numbers(value, value.count(",") + 1) if "," in value else number(value)
    if value not in ("on", "off"):
        raise SettingsError(f"{key} must be on or off, got {value!r}")
    return key, value == "on" if key == "photometric" else Shadow() if value == "on" else None
