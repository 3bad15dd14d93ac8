"""File names with one field for a number, such as view_{:03d}.png."""

from __future__ import annotations

import re
import string
from collections.abc import Callable

from glshadow.errors import SettingsError

MOST_IMAGES = 100_000  # per name pattern

# allowed format specs of a field: MOST_IMAGES have five digits
_WHOLE = re.compile(r"0?[0-9]{0,2}[bdoxX]?")


def numbered(what: str, text: str) -> Callable[[int], str]:
    """A function from number to name, for the pattern `text`. `what` names the pattern in messages.

    Raises
    ------
    SettingsError
        If there is no field, several fields, or a field that writes anything but a whole number: two images could get the
        same name, or one could be in another folder.
    """
    try:
        parts = list(string.Formatter().parse(text))
        (field,) = [(name, spec, how) for _, name, spec, how in parts if name is not None]
    except ValueError:  # unbalanced braces, or a wrong count of fields
        raise _refusal(what, text) from None
    name, spec, conversion = field
    if name not in ("", "0") or conversion or not _WHOLE.fullmatch(spec or ""):
        raise _refusal(what, text)
    return text.format


def has_field(text: str) -> bool:
    """Whether a text contains braces, for a field or doubled."""
    return "{" in text or "}" in text


def _refusal(what: str, text: str) -> SettingsError:
    return SettingsError(
        f"{what} needs a name with one field for the image's number, such as view_{{:03d}}.png, got {text!r}"
    )
