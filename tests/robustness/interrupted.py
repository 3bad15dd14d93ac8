"""Ctrl-C at a chosen step of Python code, where a timer would reach only a few of many thousands."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from types import FrameType
from typing import Any

import moderngl

import glshadow

_WATCHED = tuple(str(Path(module.__file__).resolve().parent) for module in (glshadow, moderngl))
# Python only prints what is raised in a finaliser
_UNHEARD = {"__del__"}


class Interrupted(KeyboardInterrupt):
    """The exception raised here."""


def interrupt(at: int, call: Callable[[], Any]) -> bool:
    """Call a function, and raise at the line, call or return with that number, from 0; returns whether there were as many."""
    count = -1

    def trace(frame: FrameType, event: str, _: Any) -> Any:
        nonlocal count
        if not frame.f_code.co_filename.startswith(_WATCHED) or _unheard(frame):
            return None
        count += 1
        if count == at:
            sys.settrace(None)
            raise Interrupted
        return trace

    sys.settrace(trace)
    try:
        call()
    except Interrupted:
        pass
    finally:
        sys.settrace(None)
    return count >= at


def _unheard(frame: FrameType | None) -> bool:
    while frame is not None:
        if frame.f_code.co_name in _UNHEARD:
            return True
        frame = frame.f_back
    return False
