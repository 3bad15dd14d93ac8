"""Delays Ctrl-C and SIGTERM while C code calls Python: an exception there ends the process, in moderngl with a segmentation fault, in
OpenImageIO, while it is imported, with an abort."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Any

_NUMBERS = (signal.SIGINT, signal.SIGTERM)


@contextmanager
def undisturbed() -> Iterator[None]:
    """Run the Python handlers of signals at the end of the block. Handlers run on the main thread only: other threads delay nothing."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    came: list[tuple[int, FrameType | None]] = []
    before: dict[int, Any] = {}
    try:
        for number in _NUMBERS:
            handler = signal.getsignal(number)
            if callable(handler):
                before[number] = handler
                signal.signal(number, lambda number, frame: came.append((number, frame)))
        yield
    finally:
        for held, handler in before.items():
            signal.signal(held, handler)
        for caught, frame in came:
            before[caught](caught, frame)
