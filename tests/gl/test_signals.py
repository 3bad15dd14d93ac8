"""Signals are deferred until moderngl is done."""

from __future__ import annotations

import os
import signal
import threading
from collections.abc import Iterator

import pytest

from glshadow.signals import undisturbed


@pytest.fixture
def handlers() -> Iterator[list[int]]:
    """Signals that SIGTERM's own handler has received; restored at the end."""
    seen: list[int] = []
    before = signal.signal(signal.SIGTERM, lambda number, _: seen.append(number))
    yield seen
    signal.signal(signal.SIGTERM, before)


def test_ctrl_c_is_delivered_at_the_end() -> None:
    reached = []

    def interrupted() -> None:
        with undisturbed():
            os.kill(os.getpid(), signal.SIGINT)
            reached.append(True)

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    assert reached == [True]
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_every_handler_is_called_once_and_restored(handlers: list[int]) -> None:
    mine = signal.getsignal(signal.SIGTERM)
    with undisturbed():
        os.kill(os.getpid(), signal.SIGTERM)
        assert handlers == []
    assert handlers == [signal.SIGTERM]
    assert signal.getsignal(signal.SIGTERM) is mine


def test_error_inside_propagates(handlers: list[int]) -> None:
    with pytest.raises(ValueError, match="inside"), undisturbed():
        raise ValueError("inside")
    with undisturbed():
        pass
    assert handlers == []


def test_another_thread_leaves_handlers_alone() -> None:
    found = []

    def work() -> None:
        with undisturbed():
            found.append(signal.getsignal(signal.SIGINT))

    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    assert found == [signal.default_int_handler]
