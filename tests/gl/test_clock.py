"""Seconds per stage: GPU time where the driver's timestamps are plausible, wall-clock time otherwise."""

from __future__ import annotations

import time
from collections.abc import Iterator

import pytest

import glshadow as gs
from glshadow.gl.driver.clock import Clock
from glshadow.gl.driver.context import GLContext
from glshadow.gl.driver.queries import Timestamp, has_timestamps


@pytest.fixture
def trusted(glcontext: GLContext) -> Iterator[GLContext]:
    """Pretend that a GPU renders."""
    glcontext.trusts_timestamps = True
    yield glcontext
    glcontext.trusts_timestamps = glcontext.caps.timestamps


def driver_timestamps(monkeypatch: pytest.MonkeyPatch, *seconds: float) -> None:
    """Timestamps that the driver returns one by one: begin and end of each stage, the end first, because it is read first."""
    answers = iter(seconds)
    real = Timestamp.read

    def read(self: Timestamp) -> float:
        real(self)
        return next(answers)

    monkeypatch.setattr(Timestamp, "read", read)


def test_software_driver_is_not_queried(glcontext: GLContext) -> None:
    assert has_timestamps(glcontext.gl), "the driver has timestamps"
    assert not glcontext.caps.timestamps, "but no GPU"
    clock = Clock(glcontext, True)
    with clock("a"):
        time.sleep(0.02)
    with clock("b"):
        pass
    with clock("a"):
        time.sleep(0.02)
    times = clock.times()
    assert times["a"] >= 0.04
    assert 0.0 <= times["b"] < 0.02


def test_unused_timing_costs_nothing(trusted: GLContext, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Clock, "_now", lambda self: pytest.fail("the driver was queried"))
    clock = Clock(trusted, False)
    with clock("a"):
        pass
    assert clock.times() == {}


def test_gpu_time_is_used(trusted: GLContext, monkeypatch: pytest.MonkeyPatch) -> None:
    driver_timestamps(monkeypatch, 5.001, 5.0, 7.003, 7.002, 9.002, 9.0)
    clock = Clock(trusted, True)
    for name in ("a", "b", "a"):
        with clock(name):
            time.sleep(0.01)
    assert clock.times() == {"a": pytest.approx(0.003), "b": pytest.approx(0.001)}
    assert trusted.trusts_timestamps


@pytest.mark.parametrize("seconds", [(5.0, 5.1), (9.0, 5.0)], ids=["backwards", "longer than the frame"])
def test_impossible_gpu_time_is_not_trusted_again(
    trusted: GLContext, monkeypatch: pytest.MonkeyPatch, seconds: tuple[float, float]
) -> None:
    driver_timestamps(monkeypatch, *seconds)
    clock = Clock(trusted, True)
    with clock("a"):
        time.sleep(0.01)
    assert 0.01 <= clock.times()["a"] < 1.0
    assert not trusted.trusts_timestamps


def test_frame_timed_by_the_gpu_is_unchanged() -> None:
    scene = gs.scenes.courtyard()
    requested = ("image", "timings")
    with gs.Renderer("egl") as renderer:
        frame = renderer.render(scene, size=(160, 90), samples=4, outputs=requested)
        renderer._context.trusts_timestamps = True
        other = renderer.render(scene, size=(160, 90), samples=4, outputs=requested)
        assert set(other.timings) <= set(frame.timings)
        assert {"shadow", "resolve", "read"} <= set(other.timings)
        assert (other.image == frame.image).all()
        with renderer._context as context:
            assert context.gl.errors() == []


def test_timestamps_are_seconds(glcontext: GLContext) -> None:
    begin = Timestamp(glcontext.gl)
    glcontext.ctx.finish()
    start = time.perf_counter()
    time.sleep(0.05)
    end = Timestamp(glcontext.gl)
    glcontext.ctx.finish()
    wall = time.perf_counter() - start
    # the driver may take the timestamp slightly before or after the call
    assert 0.04 < end.read() - begin.read() < wall + 0.05
