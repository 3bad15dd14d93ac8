"""JSON from others' files, read strictly: no key twice in one object, no integer that nothing can hold."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Callable
from typing import Any

LONGEST = 300  # digits of an integer; a float holds numbers of 308


def strict_json(text: str, each: Callable[[dict[str, Any]], None] | None = None) -> Any:
    """The value of a JSON text.

    Parameters
    ----------
    text : str
        With or without a byte order mark.
    each : callable, optional
        Called with every object in it.

    Raises
    ------
    ValueError
        Says what is wrong with it.
    """

    def made(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
        found = dict(pairs)
        if len(found) < len(pairs):
            twice = next(key for key, times in Counter(key for key, _ in pairs).items() if times > 1)
            raise ValueError(f"an object has the key {twice[:60]!r} more than once")
        if each is not None:
            each(found)
        return found

    try:
        return json.loads(text.removeprefix("\ufeff"), object_pairs_hook=made, parse_int=_integer)
    except RecursionError:
        raise ValueError("it is nested too deeply") from None


def _integer(digits: str) -> int:
    if len(digits) > LONGEST:
        raise ValueError(f"it has an integer of {len(digits.lstrip('-'))} digits")
    return int(digits)
