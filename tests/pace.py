"""How slow this machine is at the moment: tests of what something costs compare it with work that is measured beside it."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np

QUIET_S = 0.06
"""Processor time of `_work` on a quiet core of the machine on which the tests' seconds were measured."""


def pace() -> float:
    """1 on that machine or a faster one, 2 where the same work takes twice the processor time."""
    start = time.process_time()
    _work()
    return max((time.process_time() - start) / QUIET_S, 1.0)


def _work() -> None:
    """Half of it Python, half numpy, as loading is."""
    table: dict[int, int] = {}
    for k in range(400_000):
        table[k * 7919 % 10_007] = k
    values = np.random.default_rng(0).random(600_000)
    np.sort(values)
    np.unique(values // 0.001)


@contextmanager
def at_most(seconds: float) -> Iterator[None]:
    """Fails where what is inside takes more processor time than `seconds` of a quiet core."""
    before, start = pace(), time.process_time()
    yield
    taken = time.process_time() - start
    slowness = max(before, pace())
    assert taken < seconds * slowness, f"{taken:.2f} s, where the machine is {slowness:.1f} times as slow as usual"
