"""Signals are deferred until moderngl is done."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator

import pytest

from glshadow.gl.driver.context import GLContext
from glshadow.gl.driver.current import current
from glshadow.signals import undisturbed

from ..tolerances import PATIENCE_S


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


@pytest.mark.skipif(sys.platform != "linux", reason="optional: signals of POSIX")
@pytest.mark.parametrize("name", ["SIGALRM", "SIGVTALRM", "SIGPROF", "SIGHUP", "SIGUSR1", "SIGCHLD", "SIGRTMIN"])
def test_every_signal_waits(name: str) -> None:
    seen: list[int] = []
    number = signal.Signals[name]
    before = signal.signal(number, lambda number, _: seen.append(number))
    try:
        with undisturbed():
            os.kill(os.getpid(), number)
            assert seen == []
        assert seen == [number]
    finally:
        signal.signal(number, before)


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


def test_every_handler_runs_also_after_one_that_raises(handlers: list[int]) -> None:
    def interrupted_and_ended() -> None:
        with undisturbed():
            os.kill(os.getpid(), signal.SIGINT)
            os.kill(os.getpid(), signal.SIGTERM)

    with pytest.raises(KeyboardInterrupt):
        interrupted_and_ended()
    assert handlers == [signal.SIGTERM]
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


# A handler raises in a Python function that moderngl calls from C and whose failure it does not expect.
RAISES = """
import signal, sys
import _moderngl
import glshadow as gs
from glshadow.gl.driver import egl

class Late(Exception):
    pass

def late(*_):
    raise Late

signal.signal(signal.SIGALRM, late)
scene = gs.scenes.plane().scene

def disturb(owner, name):
    was = getattr(owner, name)
    def called(*arguments):
        setattr(owner, name, was)
        signal.raise_signal(signal.SIGALRM)
        return was(*arguments)
    setattr(owner, name, called)

if sys.argv[1] == "program":
    disturb(_moderngl, "make_uniform")
    work = lambda: gs.Renderer().render(scene, size=(16, 9))
elif sys.argv[1] == "compute":
    disturb(_moderngl, "make_storage_block")
    work = lambda: gs.Renderer().render(scene, size=(16, 9))
elif sys.argv[1] == "context":
    disturb(egl.Egl, "address")
    work = gs.Renderer
try:
    work()
except Late:
    with gs.Renderer() as renderer:
        renderer.render(scene, size=(16, 9))
    sys.exit(42)
"""


@pytest.mark.skipif(sys.platform != "linux", reason="optional: signals of POSIX")
@pytest.mark.parametrize("place", ["program", "compute", "context"])
def test_no_handler_raises_inside_moderngl(place: str) -> None:
    """It comes out of glshadow, and the process goes on."""
    done = subprocess.run(
        [sys.executable, "-c", RAISES, place], capture_output=True, text=True, timeout=PATIENCE_S, check=False
    )
    assert done.returncode == 42, f"{done.returncode} (-11: a segmentation fault)\n{done.stderr}"
    assert done.stderr == ""


class _Late(Exception):
    pass


def test_no_exception_of_a_handler_is_lost(glcontext: GLContext) -> None:
    """Which context is current is asked by way of a function that C calls: there Python would print what a handler raises."""
    raised = caught = 0

    def late(*_: object) -> None:
        nonlocal raised
        raised += 1
        raise _Late

    before = signal.signal(signal.SIGALRM, late)
    try:
        for turn in range(200):
            try:
                signal.setitimer(signal.ITIMER_REAL, 2e-4)
                while raised == turn:
                    current()
            except _Late:
                caught += 1
    finally:
        signal.signal(signal.SIGALRM, before)
    assert caught == raised == 200
