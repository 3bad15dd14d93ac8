"""A real window on a real screen (Xvfb): keys and mouse as a user would use them, each result seen in a screenshot."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import trimesh
from click.testing import CliRunner
from numpy.typing import NDArray

import glshadow as gs
from glshadow import image
from glshadow.cli import main

from ..tolerances import PATIENCE_S
from .drop import dropped
from .screen import kept, pressed, seen_on

SIZE = (400, 240)


def test_missing_screen_is_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    done = CliRunner().invoke(main, ["view"])
    assert done.exit_code == 1
    assert done.stderr.count("error:") == 1
    assert "needs a screen" in done.stderr
    assert "glshadow render" in done.stderr


def test_missing_screen_is_reported_in_python(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    with pytest.raises(gs.ContextError, match="needs a screen"):
        gs.show(gs.scenes.courtyard())
    with pytest.raises(gs.SettingsError, match="size must be two integers"):
        gs.show(gs.scenes.courtyard(), size=(0, 100))


class User:
    """Presses keys and takes screenshots."""

    def __init__(self, display: str, process: subprocess.Popen[str], folder: Path) -> None:
        self.display, self._process, self._folder, self._number = display, process, folder, 0

    def does(self, *words: str) -> None:
        pressed(self.display, *words)

    def looks(self) -> NDArray[np.uint8]:
        """Pixels of the window."""
        return seen_on(self.display, self._folder)[: SIZE[1], : SIZE[0]]

    def waits_for(self, what: str, condition: Callable[[NDArray[np.uint8]], bool]) -> NDArray[np.uint8]:
        """Take screenshots until a condition holds."""
        self._number += 1
        until = time.monotonic() + PATIENCE_S
        while time.monotonic() < until:
            assert self._process.poll() is None, "the window closed"
            seen = self.looks()
            if condition(seen):
                kept(f"window_{self._number:02d} {what}", seen)
                return seen
            time.sleep(0.1)
        pytest.fail(f"never seen: {what}")


def differs(one: NDArray[np.uint8], other: NDArray[np.uint8], where: tuple[slice, slice]) -> float:
    """Share of changed pixels."""
    gap = np.abs(one[where].astype(int) - other[where].astype(int)).max(axis=-1)
    return float((gap > 12).mean())


TOP, MAP, ALL, WORDS = np.s_[0:40, 0:120], np.s_[0:64, 330:400], np.s_[0:200, :], np.s_[215:240, 0:300]


@pytest.mark.slow
def test_user_moves_lights_and_inspects_errors(screen: str, tmp_path: Path) -> None:
    environment = os.environ | {"DISPLAY": screen}
    command = [sys.executable, "-m", "glshadow", "view", "--size", f"{SIZE[0]}x{SIZE[1]}"]
    with subprocess.Popen(command, env=environment, cwd=tmp_path, stderr=subprocess.PIPE, text=True) as process:
        try:
            _work_with(User(screen, process, tmp_path), tmp_path)
            _, said = process.communicate(timeout=PATIENCE_S)
        finally:
            process.kill()
        assert process.returncode == 0, said
        assert "Traceback" not in said


def _work_with(user: User, folder: Path) -> None:
    first = user.waits_for("the courtyard", lambda seen: len(np.unique(seen[ALL])) > 50)
    user.does("key", "h")
    user.waits_for("the help", lambda seen: differs(first, seen, TOP) > 0.5)
    user.does("key", "h")
    user.waits_for("no help", lambda seen: differs(first, seen, TOP) < 0.02)
    user.does("key", "d")
    user.waits_for("the map", lambda seen: differs(first, seen, MAP) > 0.3)
    user.does("key", "d")
    plain = user.waits_for("no map", lambda seen: differs(first, seen, MAP) < 0.02)
    user.does("key", "g", "key", "x", "key", "l")
    user.waits_for("grid, axes and light", lambda seen: differs(plain, seen, ALL) > 0.02)
    user.does("key", "g", "key", "x", "key", "l")
    user.waits_for("none of them", lambda seen: differs(plain, seen, ALL) < 0.005)
    user.does("key", "b", "key", "B", "key", "B")  # the last: no bias
    user.waits_for("acne", lambda seen: differs(plain, seen, ALL) > 0.1)
    user.does("key", "e")
    user.waits_for("errors in red", lambda seen: _painted(seen) > 0.02)
    user.does("key", "e", "key", "b")
    user.waits_for("nothing wrong", lambda seen: _painted(seen) < 0.001)
    user.does("key", "Left", "key", "Left", "key", "Up")
    user.waits_for("shadows elsewhere", lambda seen: differs(plain, seen, ALL) > 0.02)
    user.does("key", "space")
    user.waits_for("the first view", lambda seen: differs(plain, seen, ALL) < 0.005)
    user.does("mousemove", "200", "100", "mousedown", "1", "mousemove", "260", "110", "mousemove", "300", "120")
    user.does("mouseup", "1")
    turned = user.waits_for("another side", lambda seen: differs(plain, seen, ALL) > 0.05)
    user.does("click", "4")
    user.waits_for("nearer", lambda seen: differs(turned, seen, ALL) > 0.02)
    user.does("key", "2")
    other = user.waits_for("a landscape", lambda seen: differs(turned, seen, ALL) > 0.05)
    user.does("key", "a")
    user.waits_for("its light moves", lambda seen: differs(other, seen, ALL) > 0.02)
    model = folder / "a model.ply"
    trimesh.creation.torus(1.0, 0.4).export(model)
    user.does("key", "a")
    before = user.looks()
    dropped(user.display, model, "glshadow")
    model_seen = user.waits_for("the model that was dropped", lambda seen: differs(before, seen, ALL) > 0.05)
    (folder / "broken.ply").write_text("ply\nnothing")
    dropped(user.display, folder / "broken.ply", "glshadow")
    error_shown = user.waits_for("what is wrong with a file", lambda seen: differs(model_seen, seen, WORDS) > 0.05)
    assert differs(model_seen, error_shown, np.s_[0:160, :]) < 0.02, "the model stays"
    user.does("key", "c")
    until = time.monotonic() + PATIENCE_S
    while not (folder / "glshadow_001.png").exists() and time.monotonic() < until:
        time.sleep(0.1)
    time.sleep(0.3)
    assert image.read(folder / "glshadow_001.png").shape[:2] == (SIZE[1], SIZE[0])
    user.does("key", "q")


def _painted(seen: NDArray[np.uint8]) -> float:
    """Share of pixels of a colour that only errors have."""
    colors = seen[ALL].astype(int)
    return float(((colors[..., 0] - colors[..., 2]) > 110).mean())
