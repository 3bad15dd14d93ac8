"""Clock: seconds that each stage of a frame takes."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Iterator
from dataclasses import dataclass

from glshadow.gl.driver.context import GLContext
from glshadow.gl.driver.queries import Timestamp

MOST = 1.05
"""Share of the wall clock's time: a GPU that reports more than this is wrong; the two clocks differ by far less."""


@dataclass(frozen=True)
class _Stage:
    name: str
    seconds: float  # wall clock
    begin: Timestamp | None = None
    end: Timestamp | None = None


class Clock:
    """Times the stages of a frame; disabled, it costs nothing.

    Where the GPU has timestamps they are used, without waiting. A CPU driver is waited for before and after each stage and timed by the
    wall clock. Timestamps are no longer used once the stages take longer than the whole frame, or a negative time.
    """

    def __init__(self, context: GLContext, wanted: bool) -> None:
        self._context, self.wanted = context, wanted
        self._uses_gpu = wanted and context.trusts_timestamps
        self._stages: list[_Stage] = []
        self._start = time.perf_counter()

    @contextlib.contextmanager
    def __call__(self, name: str) -> Iterator[None]:
        if not self.wanted:
            yield
            return
        begin = self._now()
        start = time.perf_counter()
        yield
        end = self._now()
        self._stages.append(_Stage(name, time.perf_counter() - start, begin, end))

    def _now(self) -> Timestamp | None:
        if self._uses_gpu:
            return Timestamp(self._context.gl)
        self._context.ctx.finish()
        return None

    def times(self) -> dict[str, float]:
        """Seconds by stage; waits for the GPU."""
        spent = [each.seconds for each in self._stages]
        if self._uses_gpu:
            gpu = [each.end.read() - each.begin.read() for each in self._stages if each.begin and each.end]
            whole = time.perf_counter() - self._start
            self._context.trusts_timestamps = min(gpu) >= 0.0 and sum(gpu) <= MOST * whole
            spent = gpu if self._context.trusts_timestamps else spent
        total: dict[str, float] = {}
        for stage, seconds in zip(self._stages, spent, strict=True):
            total[stage.name] = total.get(stage.name, 0.0) + seconds
        return total
