"""How slow this machine currently is: tests of costs compare them with a workload that is measured next to them."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np

QUIET_S = 0.06
"""Processor time of `_work` on an idle core of the machine on which the tests' seconds were measured."""


def pace() -> float:
    """1 on the reference machine or a faster one, 2 where the same workload takes twice the processor time."""
    start = time.process_time()
    _work()
    return max((time.process_time() - start) / QUIET_S, 1.0)


def _work() -> None:
    """Half Python, half numpy, like loading a file."""
    table: dict[int, int] = {}
    for k in range(400_000):
        table[k * 7919 % 10_007] = k
    values = np.random.default_rng(0).random(600_000)
    np.sort(values)
    np.unique(values // 0.001)


@contextmanager
def at_most(seconds: float) -> Iterator[None]:
    """Fails if the block takes more processor time than `seconds` of an idle core."""
    before, start = pace(), time.process_time()
    yield
    taken = time.process_time() - start
    slowness = max(before, pace())
    assert taken < seconds * slowness, f"{taken:.2f} s, where the machine is {slowness:.1f} times as slow as usual"
