"""Names of files with one field for a number, such as view_{:03d}.png."""

from __future__ import annotations

import re
import string
from collections.abc import Callable

from glshadow.errors import SettingsError

MOST_IMAGES = 100_000  # of one name

# how a field may write it: MOST_IMAGES have five digits
_WHOLE = re.compile(r"0?[0-9]{0,2}[bdoxX]?")


def numbered(what: str, text: str) -> Callable[[int], str]:
    """Number -> name, of the pattern `text`; `what` is what messages call it.

    Raises
    ------
    SettingsError
        If there is no field, if there are several, or one that writes anything but a whole number: two images could share a
        name, or one lie in another folder.
    """
    try:
        parts = list(string.Formatter().parse(text))
        (field,) = [(name, spec, how) for _, name, spec, how in parts if name is not None]
    except ValueError:  # braces that do not match, or another count of fields
        raise _refusal(what, text) from None
    name, spec, conversion = field
    if name not in ("", "0") or conversion or not _WHOLE.fullmatch(spec or ""):
        raise _refusal(what, text)
    return text.format


def has_field(text: str) -> bool:
    """Whether it has braces, which stand for a field or are doubled."""
    return "{" in text or "}" in text


def _refusal(what: str, text: str) -> SettingsError:
    return SettingsError(
        f"{what} needs a name with one field for the picture's number, such as view_{{:03d}}.png, got {text!r}"
    )
