"""An explorer in a real browser with a real kernel: its controls, moved with the mouse, change the image."""

from __future__ import annotations

import json
import os
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from shutil import which

import numpy as np
import pytest
from numpy.typing import NDArray

from ..tolerances import PATIENCE_S
from .screen import kept, pressed, seen_on

SKY = (206, 208, 214)  # of an image's upper corners, which JPEG moves by 3
STEP, MOVED = (
    12,
    0.02,
)  # a change of a pixel that JPEG never causes, and the share of pixels that 100 degrees of azimuth change at least
CELL = """import glshadow as gs
sun = gs.DirectionalLight(direction=(-0.55, -0.8, -0.25), shadow=gs.Shadow(filter=gs.Pcf(1), resolution=512))
gs.explore(gs.scenes.courtyard(), lights=[sun])"""
AZIMUTH, MAP = (182, 46), (98, 268)  # of slider and box, from the image's upper right corner


@pytest.fixture
def page(screen: str, headless: dict[str, str], optional: Callable[[str, str], None], tmp_path: Path) -> Iterator[str]:
    """A display on which a browser shows the notebook, with a kernel behind it."""
    program = which("chromium") or which("google-chrome")
    if program is None:
        optional("Chromium", "chromium")
    cell = {"cell_type": "code", "execution_count": None, "metadata": {}, "outputs": [], "source": CELL}
    kernel = {"kernelspec": {"name": "python3", "display_name": "Python 3", "language": "python"}}
    (tmp_path / "page.ipynb").write_text(
        json.dumps({"cells": [cell], "metadata": kernel, "nbformat": 4, "nbformat_minor": 5})
    )
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    serve = [sys.executable, "-m", "voila", "--no-browser", "--Voila.ip=127.0.0.1", f"--port={port}", "page.ipynb"]
    show = [
        str(program), "--no-sandbox", "--test-type", "--no-first-run", "--use-angle=swiftshader", f"--user-data-dir={tmp_path / 'profile'}",
        "--window-position=0,0", "--window-size=1200,780", f"--app=http://127.0.0.1:{port}/",
    ]  # fmt: skip
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL, "start_new_session": True}
    with subprocess.Popen(serve, cwd=tmp_path, env=headless, **quiet) as server:  # type: ignore[call-overload]
        try:
            _wait_for_server(port, server)
            with subprocess.Popen(show, cwd=tmp_path, env=os.environ | {"DISPLAY": screen}, **quiet) as browser:  # type: ignore[call-overload]
                try:
                    yield screen
                finally:
                    browser.terminate()
        finally:
            server.terminate()


def _wait_for_server(port: int, server: subprocess.Popen[bytes]) -> None:
    until = time.monotonic() + PATIENCE_S
    while time.monotonic() < until and server.poll() is None:
        with socket.socket() as probe:
            if probe.connect_ex(("127.0.0.1", port)) == 0:
                return
        time.sleep(0.1)
    pytest.fail("no server")


def picture_in(seen: NDArray[np.uint8]) -> tuple[int, int] | None:
    """Upper right corner (x, y) of the image on a page."""
    sky = np.abs(seen.astype(int) - SKY).max(axis=-1) <= 3
    # most of its 640 columns, and of its 360 rows what is above the horizon
    rows, columns = np.flatnonzero(sky.sum(axis=1) > 500), np.flatnonzero(sky.sum(axis=0) > 50)
    return (int(columns[-1]), int(rows[0])) if len(rows) and len(columns) else None


def waits_for(
    display: str, folder: Path, what: str, condition: Callable[[NDArray[np.uint8]], bool]
) -> NDArray[np.uint8]:
    until = time.monotonic() + PATIENCE_S
    while time.monotonic() < until:
        seen = seen_on(display, folder)
        if condition(seen):
            kept(f"explorer {what}", seen)
            return seen
        time.sleep(0.2)
    pytest.fail(f"never seen: {what}")


@pytest.mark.slow
def test_controls_respond_to_the_mouse(page: str, tmp_path: Path) -> None:
    first = waits_for(page, tmp_path, "a picture", lambda seen: picture_in(seen) is not None)
    corner = picture_in(first)
    assert corner is not None
    x, y = corner
    whole = np.s_[y : y + 360, x - 639 : x + 1]

    def changed(seen: NDArray[np.uint8], before: NDArray[np.uint8], where: tuple[slice, slice]) -> float:
        return float((np.abs(seen[where].astype(int) - before[where].astype(int)).max(axis=-1) > STEP).mean())

    pressed(page, "mousemove", str(x + AZIMUTH[0]), str(y + AZIMUTH[1]), "mousedown", "1")
    for step in range(10, 61, 10):
        pressed(page, "mousemove", str(x + AZIMUTH[0] - step), str(y + AZIMUTH[1]))
    dragged = waits_for(page, tmp_path, "shadows elsewhere", lambda seen: changed(seen, first, whole) > MOVED)
    pressed(page, "mouseup", "1")
    rested = waits_for(page, tmp_path, "a picture drawn whole", lambda seen: _is_whole(seen[whole]))
    assert changed(rested, first, whole) > MOVED
    assert dragged.shape == rested.shape
    corner_of_map = np.s_[y + 5 : y + 60, x - 60 : x - 5]
    assert changed(rested, first, corner_of_map) < MOVED
    pressed(page, "mousemove", str(x + MAP[0]), str(y + MAP[1]), "click", "1")
    waits_for(page, tmp_path, "the map", lambda seen: changed(seen, rested, corner_of_map) > 0.5)


def _is_whole(picture: NDArray[np.uint8]) -> bool:
    """Whether the image has full resolution. At half resolution all pixels equal their even neighbours."""
    even = picture[0::2, 0::2].astype(int)
    return bool((np.abs(picture[1::2, 1::2].astype(int) - even).max(axis=-1) > STEP).mean() > 0.005)
