"""Signals wait while C code calls Python: an exception there ends the process, in moderngl by a segmentation fault, in OpenImageIO,
while it is imported, by an abort."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from types import FrameType
from typing import Any

_NUMBERS = tuple(map(int, signal.valid_signals()))


@contextmanager
def undisturbed() -> Iterator[None]:
    """Signals with a handler in Python run it at the end of the block. On other threads than the main one nothing waits: handlers
    never run there.

    Handlers are replaced, not masked: a signal that this thread blocks goes to another one, and its handler still runs here.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    handlers = ((number, signal.getsignal(number)) for number in _NUMBERS)
    before: dict[int, Any] = {number: handler for number, handler in handlers if callable(handler)}
    came: list[tuple[int, FrameType | None]] = []
    holding = True

    def hold(number: int, frame: FrameType | None) -> None:
        if holding:
            came.append((number, frame))
        else:  # putting the handlers back was itself interrupted
            before[number](number, frame)

    with ExitStack() as afterwards:  # calls every handler, also after one that raises
        try:
            for number in before:
                signal.signal(number, hold)
            yield
        finally:
            try:
                for number, handler in before.items():
                    signal.signal(number, handler)
            finally:
                holding = False
                for number, frame in reversed(came):
                    afterwards.callback(before[number], number, frame)
