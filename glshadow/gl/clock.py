"""Clock: seconds that each stage of a frame takes."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Iterator

import moderngl


class Clock:
    """Seconds per stage, waiting for the GPU before and after; not wanted: costs nothing."""

    def __init__(self, ctx: moderngl.Context, wanted: bool) -> None:
        self._ctx = ctx
        self.times: dict[str, float] | None = {} if wanted else None

    @contextlib.contextmanager
    def __call__(self, name: str) -> Iterator[None]:
        if self.times is None:
            yield
            return
        self._ctx.finish()
        start = time.perf_counter()
        yield
        self._ctx.finish()
        self.times[name] = self.times.get(name, 0.0) + time.perf_counter() - start
